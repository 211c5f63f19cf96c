#!/bin/sh
# Races the bilateral filter against a permutohedral lattice and against OpenCV; see bench/README.md.
#
#     LUZ_DATA=../shared/data bench/filter.sh [FOLDER]
#
# FOLDER keeps the inputs and exact results; without it, a temporary one is used. OpenCV comes from
# `pip install opencv-python-headless numpy`; PYTHON names the interpreter.
set -e
cd "$(dirname "$0")/.."
if [ -n "$1" ]; then
    folder=$1
else
    folder=$(mktemp -d)
    trap 'rm -rf "$folder"' EXIT
fi
cargo bench -p luz-filter --bench filter -- --save "$folder"
"${PYTHON:-python3}" bench/opencv_filter.py "$folder"
