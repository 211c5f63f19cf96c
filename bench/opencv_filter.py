#!/usr/bin/env python3
"""Races OpenCV's bilateralFilter on what `cargo bench -p luz-filter --bench filter -- --save FOLDER` has saved.

    pip install opencv-python-headless numpy
    python3 bench/opencv_filter.py FOLDER [--rounds N]

Both filter the same picture on one thread, with the window of the same width. Times are processor seconds, medians over rounds;
PSNR is against luz's exact result. OpenCV's window is a disk, luz's a square, and OpenCV looks the range weights up in a table
of sums of absolute differences: for several channels its distance is L1. Its accuracy is therefore given against luz's exact
filter with L2, as a matter of record: the two don't compute the same thing.
"""

import argparse
import json
import pathlib
import statistics
import time

import cv2
import numpy as np

GOALS = {4: 20, 8: 40, 16: 80, 32: 200}


def psnr(a, b):
    return -10 * np.log10(np.mean((a.astype(np.float64) - b) ** 2))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--rounds", type=int, default=2)
    arguments = parser.parse_args()
    cv2.setNumThreads(1)
    print(f"OpenCV {cv2.__version__}")
    print(f"{'picture':9} {'σ_s':>3} {'σ_r':>5} | {'OpenCV s':>9} {'dB':>6} | {'exact s':>8} {'/OpenCV':>8} | {'sampled s':>9} {'dB':>6} {'/OpenCV':>8} {'goal':>6}")
    for path in sorted(arguments.folder.glob("*.json"), key=lambda p: (p.stem.split("-")[0], float(p.stem.split("-")[1]))):
        name, sigma, sigma_range = path.stem.rsplit("-", 2)
        luz = json.loads(path.read_text())
        read = lambda kind: np.fromfile(path.with_name(f"{path.stem}-{kind}.f32"), np.float32).reshape(1024, 1024, 3)
        picture, exact = read("input"), read("exact")
        width = 2 * int(np.ceil(2.5 * float(sigma) - 1e-6)) + 1
        times = []
        for _ in range(arguments.rounds):
            start = time.process_time()
            result = cv2.bilateralFilter(picture, width, float(sigma_range), float(sigma))
            times.append(time.process_time() - start)
        opencv = statistics.median(times)
        goal = GOALS.get(int(float(sigma)), 0)
        print(
            f"{name:9} {sigma:>3} {sigma_range:>5} | {opencv:9.4f} {psnr(result, exact):6.2f} |"
            f" {luz['exact']:8.4f} {'1/%.1f' % (opencv / luz['exact']):>8} |"
            f" {luz['sampled']:9.4f} {luz['quality']:6.2f} {'1/%.0f' % (opencv / luz['sampled']):>8} {'1/%d' % goal:>6}",
            flush=True,
        )


if __name__ == "__main__":
    main()
