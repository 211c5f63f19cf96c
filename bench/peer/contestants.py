"""The renderers in the race. Each renders one scene with one seed and says what it took."""

import glob
import json
import os
import resource
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Mitsuba's scalar modes seed each image block with `seed + block`, so seeds must lie far apart.
MITSUBA_SEED_STRIDE = 1_000_003
WARM_UP_SEED = 999


@dataclass
class Task:
    """What all contestants render."""

    name: str
    path: Path
    width: int
    height: int
    samples: int
    max_depth: int
    threads: int

    @property
    def pixels(self):
        return self.width * self.height


@dataclass
class Run:
    """One picture: linear RGB (height, width, 3), seconds of rendering, and processor seconds spent meanwhile."""

    image: np.ndarray
    seconds: float
    cpu_seconds: float


class Luz:
    """The `luz` program. Its report says how long rendering took, without loading and building."""

    def __init__(self, mi, program, task, folder, sampler=None, extra=()):
        self.mi, self.program, self.task, self.folder = mi, program, task, Path(folder)
        self.name = f"luz {sampler}" if sampler else "luz"
        self.samples = task.samples
        self.extra = (["--sampler", sampler] if sampler else []) + list(extra)
        self.overhead = None

    def warm_up(self):
        """Reads the files once and learns what processor time a run takes beside rendering."""
        self.overhead = min(self._run(seed=1, samples=1)[1] for _ in range(2))

    def render(self, seed):
        t = self.task
        seconds, cpu = self._run(seed, t.samples)
        # The overhead holds one sample per pixel of rendering too.
        cpu = (cpu - self.overhead) * t.samples / (t.samples - 1)
        return Run(read_rgb(self.mi, self.folder / "luz.exr"), seconds, cpu)

    def _run(self, seed, samples):
        """Seconds of rendering, and processor seconds of the whole process."""
        t, image, report = self.task, self.folder / "luz.exr", self.folder / "luz.json"
        command = [self.program, "render", t.path, "-o", image, "--report", report, "--quiet", "--seed", seed]
        command += ["--spp", samples, "--resolution", f"{t.width}x{t.height}", "--max-depth", t.max_depth]
        command += ["--filter", "box", "--integrator", "path", "--threads", t.threads, *self.extra]
        before = _children_cpu()
        subprocess.run([str(word) for word in command], check=True)
        cpu = _children_cpu() - before
        return json.loads(report.read_text())["seconds"]["render"], cpu


class Mitsuba:
    """One variant of Mitsuba 3 with one sampler, in this process."""

    def __init__(self, mi, dr, variant, sampler, task, converter):
        self.mi, self.dr, self.variant = mi, dr, variant
        self.name = f"{variant} {sampler}"
        mi.set_variant(variant)
        dictionary = converter.dictionary(mi, task.width, task.height, task.samples, sampler, task.max_depth)
        self.scene = mi.load_dict(dictionary)
        # Stratifying samplers may round the count up.
        self.samples = self.scene.sensors()[0].sampler().sample_count()

    def warm_up(self):
        """Compiles the kernels."""
        self.render(WARM_UP_SEED)

    def render(self, seed):
        self.mi.set_variant(self.variant)
        wall, cpu = time.perf_counter(), time.process_time()
        image = self.mi.render(self.scene, seed=seed * MITSUBA_SEED_STRIDE)
        if self.variant != "scalar_rgb":
            self.dr.eval(image)
            self.dr.sync_thread()
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        return Run(np.array(image, dtype=np.float64), wall, cpu)


def import_mitsuba(threads):
    """(mitsuba, drjit), with LLVM found and the number of threads set."""
    if "DRJIT_LIBLLVM_PATH" not in os.environ:
        found = [p for v in (19, 18, 17, 16) for p in glob.glob(f"/usr/lib/*/libLLVM-{v}.so")]
        if not found:
            raise SystemExit("no LLVM library of version 16 to 19: apt-get install libllvm19, or set DRJIT_LIBLLVM_PATH")
        os.environ["DRJIT_LIBLLVM_PATH"] = found[0]
    try:
        import drjit
        import mitsuba
    except ImportError as error:
        raise SystemExit(f"{error}: pip install mitsuba") from error
    mitsuba.set_variant("llvm_ad_rgb")
    drjit.set_thread_count(threads)
    return mitsuba, drjit


def read_rgb(mi, path):
    """The R, G and B channels of an EXR file that may have more."""
    bitmap = mi.Bitmap(str(path))
    names = [channel.name for channel in bitmap.struct_()]
    pixels = np.array(bitmap, dtype=np.float64)
    return pixels[:, :, [names.index(c) for c in "RGB"]]


def _children_cpu():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
