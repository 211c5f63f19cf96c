#!/usr/bin/env python3
"""Races luz against Mitsuba 3 on the same scenes; bench/README.md says how to run it and how to read what it prints."""

import argparse
import json
import os
import platform
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
# Python looks beside the script first, where this file's name would hide the library's.
sys.path[0] = str(HERE / "peer")

import numpy as np  # noqa: E402
from contestants import Luz, Mitsuba, Task, import_mitsuba, read_rgb  # noqa: E402
from efficiency import denominator, efficiency, jackknife_ratio, relative_mse  # noqa: E402
from mitsuba_scene import Converter  # noqa: E402
from pbrt_scene import read_scene  # noqa: E402

SCENES = {"cornell-box": "cornell-box/cornell-box.pbrt", "killeroo-gold": "killeroos/killeroo-gold.pbrt"}
SPEED_GOAL, EFFICIENCY_GOAL = 2.5, 1.0
BRIGHTNESS_TOLERANCE = 0.01
REFERENCE_DEPTH = 16


class Results:
    """All rounds of one race."""

    def __init__(self, task, contestants):
        self.task = task
        self.names = [c.name for c in contestants]
        self.samples = {c.name: c.samples for c in contestants}
        self.runs = {name: [] for name in self.names}

    def finish(self, reference):
        self.images = {n: np.stack([r.image for r in self.runs[n]]) for n in self.names}
        self.seconds = {n: np.array([r.seconds for r in self.runs[n]]) for n in self.names}
        self.cpu = {n: np.array([r.cpu_seconds for r in self.runs[n]]) for n in self.names}
        self.below = denominator(list(self.images.values()))
        self.rounds = len(self.runs[self.names[0]])
        self.reference = reference

    def speed(self, name, keep=slice(None), clock=None):
        """Samples per second."""
        return self.task.pixels * self.samples[name] / (clock or self.seconds)[name][keep].mean()

    def efficiency(self, name, keep=slice(None), trimmed=False, clock=None):
        return efficiency(self.images[name][keep], (clock or self.seconds)[name][keep], self.below, trimmed)

    def row(self, name):
        cores = self.cpu[name].sum() / self.seconds[name].sum()
        return {
            "name": name,
            "samples_per_pixel": self.samples[name],
            "seconds": float(self.seconds[name].mean()),
            "cores_busy": float(cores),
            "samples_per_second": float(self.speed(name)),
            "relative_mse": relative_mse(self.images[name], self.below),
            "relative_mse_trimmed": relative_mse(self.images[name], self.below, trimmed=True),
            "efficiency": self.efficiency(name),
            "efficiency_trimmed": self.efficiency(name, trimmed=True),
            "mean_rgb": self.images[name].mean(axis=(0, 1, 2)).tolist(),
            "brightness_to_pbrt": None if self.reference is None else float(self.images[name].mean() / self.reference),
        }

    def fastest(self, variant):
        return max((n for n in self.names if n.startswith(variant)), key=self.speed)

    def most_efficient(self, variant, trimmed=False):
        """The best of the variant's samplers, measured as it will be compared."""
        return max((n for n in self.names if n.startswith(variant)), key=lambda n: self.efficiency(n, trimmed=trimmed))

    def compare(self, name):
        """The ratios that the goals are about, of one contestant against the best of each Mitsuba variant."""
        scalar, best = self.fastest("scalar_rgb"), self.most_efficient("llvm_ad_rgb")
        best_trimmed = self.most_efficient("llvm_ad_rgb", trimmed=True)

        def ratio(kind, other, statistic, goal=None):
            value, low, high = jackknife_ratio(self.rounds, statistic)
            return {"kind": kind, "of": name, "to": other, "ratio": value, "low": low, "high": high, "goal": goal}

        def speed(clock=None):
            return lambda keep: self.speed(name, keep, clock) / self.speed(scalar, keep, clock)

        def efficiencies(other, trimmed=False, clock=None):
            return lambda keep: self.efficiency(name, keep, trimmed, clock) / self.efficiency(other, keep, trimmed, clock)

        return [
            ratio("samples/s", scalar, speed(), SPEED_GOAL),
            ratio("efficiency", best, efficiencies(best), EFFICIENCY_GOAL),
            ratio("efficiency, trimmed", best_trimmed, efficiencies(best_trimmed, trimmed=True), EFFICIENCY_GOAL),
            ratio("samples per core-second", scalar, speed(self.cpu)),
            ratio("efficiency per core-second", best, efficiencies(best, clock=self.cpu)),
            ratio("mean brightness", best, lambda k: self.images[name][k].mean() / self.images[best][k].mean()),
        ]


def race(task, contestants, rounds, reference):
    """Everyone warms up (which compiles kernels), then renders by turns, each round in another order."""
    for contestant in contestants:
        contestant.warm_up()
    results = Results(task, contestants)
    for r in range(rounds):
        turn = r % len(contestants)
        for contestant in contestants[turn:] + contestants[:turn]:
            results.runs[contestant.name].append(contestant.render(r + 1))
            progress(f"{task.name} {task.width}×{task.height}: round {r + 1} of {rounds}, {contestant.name}")
    progress("")
    results.finish(reference)
    return results


def reference_brightness(mi, data, task):
    """Mean of pbrt-v4's reference over pixels and channels; None if there is none for this resolution and depth."""
    path = data / "references" / f"{task.name}.exr"
    if task.max_depth != REFERENCE_DEPTH or not path.is_file():
        return None
    pixels = read_rgb(mi, path)
    return pixels.mean() if pixels.shape[:2] == (task.height, task.width) else None


def progress(text):
    if sys.stderr.isatty():
        print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)


def print_table(results):
    t = results.task
    print(f"\n## {t.name}, {t.width}×{t.height}, {t.max_depth} bounces, {results.rounds} seeds\n")
    print("| | spp | s/picture | cores | Msamples/s | relMSE | trimmed | efficiency | trimmed | brightness/pbrt |")
    print("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|")
    for name in results.names:
        r = results.row(name)
        brightness = r["brightness_to_pbrt"]
        print(
            f"| {name} | {r['samples_per_pixel']} | {r['seconds']:.3f} | {r['cores_busy']:.2f} "
            f"| {r['samples_per_second'] / 1e6:.3f} | {r['relative_mse']:.3e} | {r['relative_mse_trimmed']:.3e} "
            f"| {r['efficiency']:.4g} | {r['efficiency_trimmed']:.4g} "
            f"| {'' if brightness is None else f'{brightness:.4f}'} |"
        )


def print_ratios(ratios):
    print("\n| ratio of | to | | 95 % interval | goal |\n|---|---|--:|---|---|")
    for r in ratios:
        goal = ""
        if r["kind"] == "mean brightness":
            goal = "the same picture" if abs(r["ratio"] - 1) <= BRIGHTNESS_TOLERANCE else "**not the same picture**"
        elif r["goal"]:
            verdict = "reached" if r["low"] >= r["goal"] else "missed" if r["high"] < r["goal"] else "undecided"
            goal = f"≥ {r['goal']}: {verdict}"
        print(f"| {r['of']}: {r['kind']} | {r['to']} | **{r['ratio']:.3f}** | {r['low']:.3f} – {r['high']:.3f} | {goal} |")


def save_means(mi, results, folder):
    """Each contestant's mean picture as EXR, and all side by side as PNG, in the table's order."""
    folder.mkdir(parents=True, exist_ok=True)
    t = results.task
    means = [results.images[n].mean(axis=0).astype(np.float32) for n in results.names]
    for name, mean in zip(results.names, means):
        mi.Bitmap(mean).write(str(folder / f"{t.name}-{t.width}-{name.replace(' ', '-')}.exr"))
    mi.util.write_bitmap(str(folder / f"{t.name}-{t.width}.png"), np.concatenate(means, axis=1))


def arguments():
    p = argparse.ArgumentParser(description="Races luz against Mitsuba 3 on the same scenes, by turns.")
    p.add_argument("--data", type=Path, default=HERE.parent.parent / "shared" / "data", help="folder of scenes/pbrt")
    p.add_argument("--luz", type=Path, default=HERE.parent / "target/release/luz", help="the program")
    p.add_argument("--without-luz", action="store_true", help="measure Mitsuba alone")
    p.add_argument("--scenes", nargs="+", choices=SCENES, default=list(SCENES), metavar="NAME", help=", ".join(SCENES))
    p.add_argument("--resolution", nargs="+", type=int, default=[128], metavar="N", help="N×N pixels (default 128)")
    p.add_argument("--spp", type=int, default=64, help="samples per pixel (default 64)")
    p.add_argument("--seeds", type=int, default=8, help="measured rounds (default 8, at least 6)")
    p.add_argument("--max-depth", type=int, default=16, help="scattering events (default 16)")
    p.add_argument("--threads", type=int, default=os.cpu_count(), help="for all (default: all cores)")
    p.add_argument("--variants", nargs="+", default=["scalar_rgb", "llvm_ad_rgb"], help="Mitsuba's")
    p.add_argument("--samplers", nargs="+", default=["independent", "multijitter"], help="Mitsuba's")
    p.add_argument("--luz-samplers", nargs="+", default=[None], help="luz's (default: its own choice)")
    p.add_argument("--luz-arguments", default="", help="more words for luz's command line, in one string")
    p.add_argument("--json", type=Path, metavar="FILE", help="write all numbers")
    p.add_argument("--pictures", type=Path, metavar="DIR", help="write the mean pictures")
    a = p.parse_args()
    if a.spp < 2:
        p.error("--spp: at least 2")
    if a.seeds < 6:
        p.error("--seeds: at least 6, or the variance is not known well enough")
    if not a.without_luz:
        if not a.luz.is_file():
            p.error(f"{a.luz} doesn't exist: cargo build --release, or --luz PATH, or --without-luz")
        a.luz = a.luz.resolve()
        missing = {"scalar_rgb", "llvm_ad_rgb"} - set(a.variants)
        if missing:
            p.error(f"the goals need --variants {' '.join(missing)}")
    return a


def main():
    a = arguments()
    mi, dr = import_mitsuba(a.threads)
    machine = {
        "mitsuba": mi.__version__,
        "threads": a.threads,
        "cores": os.cpu_count(),
        "machine": processor(),
        "load_before": os.getloadavg()[0],
        "date": time.strftime("%Y-%m-%d %H:%M"),
    }
    print(f"Mitsuba {machine['mitsuba']}, {a.threads} threads, {machine['machine']}, load {machine['load_before']:.1f}")
    report = machine | {"races": []}
    for name in a.scenes:
        path = (a.data / "scenes/pbrt" / SCENES[name]).resolve()
        if not path.is_file():
            raise SystemExit(f"{path} doesn't exist: --data names the folder that holds scenes/pbrt")
        with tempfile.TemporaryDirectory() as folder:
            converter = Converter(read_scene(path), folder)
            for side in a.resolution:
                task = Task(name, path, side, side, a.spp, a.max_depth, a.threads)
                contestants = [Mitsuba(mi, dr, v, s, task, converter) for v in a.variants for s in a.samplers]
                if not a.without_luz:
                    extra = a.luz_arguments.split()
                    contestants[:0] = [Luz(mi, a.luz, task, folder, s, extra) for s in a.luz_samplers]
                results = race(task, contestants, a.seeds, reference_brightness(mi, a.data, task))
                print_table(results)
                ratios = [r for n in results.names if n.startswith("luz") for r in results.compare(n)]
                if ratios:
                    print_ratios(ratios)
                if a.pictures:
                    save_means(mi, results, a.pictures)
                rows = [results.row(n) for n in results.names]
                settings = {"scene": name, "resolution": side, "max_depth": a.max_depth, "seeds": a.seeds}
                report["races"].append(settings | {"contestants": rows, "ratios": ratios})
                sys.stdout.flush()
    if a.json:
        a.json.write_text(json.dumps(report, indent=2) + "\n")


def processor():
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


if __name__ == "__main__":
    main()
