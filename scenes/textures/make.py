"""Makes the images of these scenes: `python3 make.py` (needs numpy)."""

import struct
import zlib

import numpy as np


def write_png(path, pixels):
    """8-bit RGB, rows from the top."""
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    chunk = lambda kind, data: struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def write_exr(path, pixels):
    """Half floats R, G, B, every line zipped."""
    height, width, _ = pixels.shape
    attribute = lambda name, kind, data: name + b"\0" + kind + b"\0" + struct.pack("<I", len(data)) + data
    channels = b"".join(name + b"\0" + struct.pack("<IBBBBII", 1, 0, 0, 0, 0, 1, 1) for name in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<II", 20000630, 2)
    header += attribute(b"channels", b"chlist", channels) + attribute(b"compression", b"compression", b"\2")
    header += attribute(b"dataWindow", b"box2i", window) + attribute(b"displayWindow", b"box2i", window)
    header += attribute(b"lineOrder", b"lineOrder", b"\0") + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    header += attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0))
    header += attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    lines = [zip_line(np.concatenate([row[:, 2], row[:, 1], row[:, 0]]).astype("<f2")) for row in pixels]
    starts = len(header) + 8 * height + np.cumsum([0] + [8 + len(line) for line in lines])
    with open(path, "wb") as file:
        file.write(header + starts[:-1].astype("<u8").tobytes())
        for y, line in enumerate(lines):
            file.write(struct.pack("<iI", y, len(line)) + line)


def zip_line(halves):
    """OpenEXR's ZIPS: low bytes, then high bytes, their differences, deflated."""
    data = halves.view(np.uint8)
    split = np.concatenate([data[0::2], data[1::2]]).astype(int)
    split[1:] = (split[1:] - split[:-1] + 128 + 256) % 256
    return zlib.compress(split.astype(np.uint8).tobytes(), 9)


def grid(size=256, cells=8):
    """Coloured cells with a bright frame each: shows orientation, distortion and blur."""
    v, u = np.mgrid[0:size, 0:size] / size
    column, row = np.floor(u * cells), np.floor(v * cells)
    light = 0.7 + 0.3 * ((column + row) % 2)
    color = np.stack([0.35 + 0.6 * column / (cells - 1), 0.75 - 0.25 * row / (cells - 1), 0.3 + 0.65 * row / (cells - 1)], -1)
    pixels = light[..., None] * color
    inside = np.maximum(np.abs(u * cells - column - 0.5), np.abs(v * cells - row - 0.5))
    pixels[inside > 0.44] = [0.93, 0.9, 0.82]
    return np.round(255 * pixels).astype(np.uint8)


def sky(size=128):
    """A clear sky with a low, soft sun, z up, on an equal-area octahedral map (Clarberg 2008)."""
    v, u = (np.mgrid[0:size, 0:size] + 0.5) / size * 2 - 1
    distance = 1 - (np.abs(u) + np.abs(v))
    r = 1 - np.abs(distance)
    phi = ((np.abs(v) - np.abs(u)) / np.maximum(r, 1e-9) + 1) * np.pi / 4
    sine = r * np.sqrt(2 - r * r)
    direction = np.stack([np.copysign(np.cos(phi) * sine, u), np.copysign(np.sin(phi) * sine, v),
                          np.copysign(1 - r * r, distance)], -1)
    up = direction[..., 2:]
    blue, haze, ground = np.array([0.12, 0.28, 0.65]), np.array([0.75, 0.7, 0.62]), np.array([0.16, 0.14, 0.12])
    mix = np.clip(up, 0, 1) ** 0.6
    above = np.clip(up / 0.16 + 0.5, 0, 1)
    pixels = above * (haze * (1 - mix) + blue * mix) + (1 - above) * ground
    sun = np.array([-0.62, 0.5, 0.6]) / np.linalg.norm([-0.62, 0.5, 0.6])
    toward = np.sum(direction * sun, -1, keepdims=True)
    glow = 0.6 * np.exp((toward - 1) * 12) + 300 * np.exp((toward - 1) * 700)
    return pixels + above * glow * np.array([1.0, 0.82, 0.55])


def screen(width=160, height=90):
    """A picture for a video wall: a dark sea of letters in rows, with a few that are bright, and a burning sun."""
    v, u = (np.mgrid[0:height, 0:width] + 0.5) / np.array([height, width]).reshape(2, 1, 1)
    random = np.random.default_rng(7)
    pixels = np.zeros((height, width, 3))
    pixels += np.array([0.004, 0.006, 0.014])
    for row in range(4, height - 6, 8):
        x = 5
        while x < width - 8:
            length = int(random.integers(4, 16))
            bright = random.random() < 0.12
            color = np.array([0.04, 0.2, 0.26]) if not bright else np.array([1.0, 0.25, 0.5])
            pixels[row:row + 3, x:min(x + length, width - 5)] = color * (0.35 + 0.65 * bright)
            x += length + int(random.integers(2, 7))
    distance = np.hypot((u - 0.76) * width, (v - 0.4) * height)
    disk = np.clip(17 - distance, 0, 1)[..., None]
    stripes = ((v * height % 5) < 3.6)[..., None]
    sun = np.stack([np.ones_like(v), 0.95 - 0.75 * v, 0.25 + 0 * v], -1)
    pixels = pixels * (1 - disk) + sun * disk * stripes
    encoded = np.where(pixels <= 0.0031308, 12.92 * pixels, 1.055 * np.clip(pixels, 0, 1) ** (1 / 2.4) - 0.055)
    return np.round(255 * np.clip(encoded, 0, 1)).astype(np.uint8)


def sunny_sky(size=192):
    """A deep sky with a small sun, 60,000 times as bright, z up, on an equal-area octahedral map."""
    pixels = sky(size)
    v, u = (np.mgrid[0:size, 0:size] + 0.5) / size
    pixels = np.minimum(pixels, 2.5) * 0.4
    # One texel of 192 × 192 is about as wide as the sun: 1.1 degrees.
    direction = np.array([-0.62, 0.5, 0.6]) / np.linalg.norm([-0.62, 0.5, 0.6])
    x, y = octahedral(direction)
    pixels[int(y * size), int(x * size)] = np.array([1.0, 0.86, 0.66]) * 30000
    return pixels


def octahedral(d):
    """Coordinates in the map of a direction."""
    r = np.sqrt(1 - abs(d[2]))
    phi = np.arctan2(abs(d[1]), abs(d[0])) * 2 / np.pi
    v = phi * r
    u = r - v
    if d[2] < 0:
        u, v = 1 - v, 1 - u
    return np.copysign(u, d[0]) / 2 + 0.5, np.copysign(v, d[1]) / 2 + 0.5


write_png("grid.png", grid())
write_png("screen.png", screen())
write_exr("sunny-sky.exr", sunny_sky())
write_exr("sky.exr", sky())
