"""Makes the shapes of these scenes that are too long to be written by hand: `python3 make.py` (needs numpy)."""

import textwrap

import numpy as np


def write_shape(path, comment, kind, points, indices, more=""):
    """A shape of triangles or patches, `Include`d by a scene in its own coordinates."""
    number = lambda v: f"{v:.4f}".rstrip("0").rstrip(".").replace("-0.", "-.").removeprefix("0") or "0"
    places = "  ".join(" ".join(number(v if abs(v) >= 5e-5 else 0.0) for v in p) for p in points)
    faces = "  ".join(" ".join(str(i) for i in face) for face in indices)
    lines = lambda text: "\n".join(textwrap.wrap(text, 136, initial_indent="    ", subsequent_indent="    "))
    with open(path, "w") as file:
        file.write(f"# {comment} Made by make.py.\n")
        file.write(f'Shape "{kind}"{more}\n  "point3 P" [\n{lines(places)}\n  ]\n')
        file.write(f'  "integer indices" [\n{lines(faces)}\n  ]\n')


def keyhole(radius=0.09, slot=(0.032, 0.07, -0.31), plate=(0.3, 0.45), depth=0.06, arcs=28):
    """A board with a keyhole, a circle above a slot that widens: rings of patches from the hole's rim to the board's.

    The board's faces are x = 0 and x = -depth, the circle's centre is y = z = 0; the board reaches `plate` (z, y) to each side. The slot
    has half the width `top` above, `bottom` below, and ends at y = `low`.
    """
    top, bottom, low = slot
    # Counter-clockwise as (z, y), from where the slot's right side leaves the circle, around the circle to its left side.
    begin = -np.arccos(top / radius)
    circle = np.linspace(begin, np.pi - begin, arcs + 1)
    rim = [(radius * np.cos(t), radius * np.sin(t)) for t in circle] + [(-bottom, low), (bottom, low)]
    # Rays from the circle's centre meet the rim once, since it widens less than they do; those through the board's corners are needed.
    corners = [(z, y) for z in (-plate[0], plate[0]) for y in (-plate[1], plate[1])]
    rim = sorted(rim + [hit(rim, corner) for corner in corners], key=lambda p: np.arctan2(p[1], p[0]))
    edge = [tuple(np.array(p) / max(abs(p[0]) / plate[0], abs(p[1]) / plate[1])) for p in rim]
    n = len(rim)
    points = [(x, y, z) for x in (0, -depth) for ring in (rim, edge) for z, y in ring]
    ring = lambda a, b: [(a * n + i, a * n + (i + 1) % n, b * n + i, b * n + (i + 1) % n) for i in range(n)]
    return points, ring(0, 1) + ring(2, 3) + ring(0, 2)


def hit(rim, direction):
    """Where the ray from the origin meets a closed line."""
    for a, b in zip(np.array(rim), np.roll(np.array(rim), -1, axis=0)):
        t, s = np.linalg.solve(np.array([direction, a - b]).T, a)
        if t > 0 and 0 <= s <= 1:
            return t * direction[0], t * direction[1]
    raise ValueError("the rim is not closed")


def water(size=(3.1, 2.1), cells=(42, 28), steepness=0.25):
    """Small waves on a rectangle around the origin, y up: the control points of a smooth surface.

    Five plane waves run every which way, whose slopes' root mean square is `steepness`, and whose curvatures' is 2.6 per metre. Water
    of curvature c gathers light from above at a depth of 4 / c: the sharper crests do at 80 cm.
    """
    x, z = np.meshgrid(np.linspace(-0.5, 0.5, cells[0] + 1) * size[0], np.linspace(-0.5, 0.5, cells[1] + 1) * size[1])
    y = np.zeros_like(x)
    random = np.random.default_rng(5)
    lengths = (0.95, 0.74, 0.62, 0.53, 0.47)
    for i, length in enumerate(lengths):
        angle, phase, k = 2.4 * i + 0.4, random.uniform(0, 2 * np.pi), 2 * np.pi / length
        y += steepness * np.sqrt(2 / len(lengths)) / k * np.sin(k * (np.cos(angle) * x + np.sin(angle) * z) + phase)
    points = list(zip(x.ravel(), y.ravel(), z.ravel()))
    row = cells[0] + 1
    faces = []
    for j in range(cells[1]):
        for i in range(cells[0]):
            a, b, c, d = j * row + i, j * row + i + 1, (j + 1) * row + i, (j + 1) * row + i + 1
            # Diagonals by turns, so that no direction is preferred.
            faces += [(a, b, c), (b, d, c)] if (i + j) % 2 else [(a, b, d), (a, d, c)]
    return points, faces


write_shape("keyhole.pbrt", "A board with a keyhole.", "bilinearmesh", *keyhole())
write_shape("water.pbrt", "Small waves, smoothed by subdivision.", "loopsubdiv", *water(), more=' "integer levels" 3')
