"""Tests of the benchmark's own parts, without Mitsuba: `python3 bench/peer/test_peer.py`."""

import tempfile
import unittest
from pathlib import Path

import numpy as np
from efficiency import denominator, efficiency, jackknife_ratio, relative_mse, student_t_975
from loop_subdivision import loop_subdivide
from pbrt_scene import Unsupported, read_scene

TETRAHEDRON = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], dtype=float)
TETRAHEDRON_FACES = np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]])


def grid(n):
    """An open square of n × n cells in the plane z = 0, its corners at 0 and n."""
    y, x = np.mgrid[0 : n + 1, 0 : n + 1]
    points = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(float)
    i = np.arange((n + 1) ** 2).reshape(n + 1, n + 1)
    a, b, c, d = (v.ravel() for v in (i[:-1, :-1], i[:-1, 1:], i[1:, 1:], i[1:, :-1]))
    return points, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


class LoopSubdivision(unittest.TestCase):
    def test_the_limit_does_not_depend_on_the_level(self):
        # Refinement keeps the control points' indices, and their limit positions and normals.
        zero, zero_normals, _ = loop_subdivide(TETRAHEDRON, TETRAHEDRON_FACES, 0)
        three, three_normals, faces = loop_subdivide(TETRAHEDRON, TETRAHEDRON_FACES, 3)
        self.assertEqual(len(faces), 4 * 4**3)
        np.testing.assert_allclose(zero, three[:4], atol=1e-12)
        np.testing.assert_allclose(zero_normals, three_normals[:4], atol=1e-12)

    def test_closed_surfaces_have_outward_normals(self):
        points, normals, faces = loop_subdivide(TETRAHEDRON, TETRAHEDRON_FACES, 3)
        np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1, atol=1e-12)
        corner = points[faces]
        flat = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        agreement = np.sum(flat[:, None] * normals[faces], axis=-1)
        self.assertGreater(agreement.min(), 0.9)

    def test_a_plane_stays_a_plane_and_boundaries_do_not_shrink_along_their_edges(self):
        points, faces = grid(4)
        fine, normals, _ = loop_subdivide(points, faces, 2)
        np.testing.assert_allclose(normals, np.broadcast_to([0, 0, 1.0], normals.shape), atol=1e-12)
        middle = np.abs(fine[:, 0] - 2) < 0.5
        self.assertAlmostEqual(fine[middle, 1].min(), 0)
        self.assertAlmostEqual(fine[middle, 1].max(), 4)

    def test_boundary_normals_follow_a_cylinder(self):
        points, faces = grid(16)
        angle = points[:, 0] / 16
        bent = np.stack([np.sin(angle), points[:, 1] / 16, np.cos(angle)], axis=1)
        fine, normals, _ = loop_subdivide(bent, faces, 1)
        radial = fine * [1, 0, 1]
        radial /= np.linalg.norm(radial, axis=1, keepdims=True)
        self.assertGreater(np.abs(np.sum(radial * normals, axis=1)).min(), 0.995)

    def test_what_is_no_surface_is_refused(self):
        points = np.eye(5, 3)
        for faces in ([[0, 1, 2], [0, 1, 3], [1, 0, 4]], [[0, 1, 2], [0, 1, 3]], [[0, 1, 2], [0, 3, 4]]):
            with self.assertRaises(ValueError):
                loop_subdivide(points, np.array(faces), 1)


class PbrtScene(unittest.TestCase):
    def read(self, text):
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene.pbrt"
            path.write_text(text)
            return read_scene(path)

    def test_attributes_nest_and_transforms_multiply_from_the_right(self):
        scene = self.read(
            """LookAt 0 0 -5  0 0 0  0 1 0   # the camera
            Camera "perspective" "float fov" 30
            WorldBegin
            AttributeBegin
              Translate 1 2 3 Scale 2 2 2 ReverseOrientation
              AreaLightSource "diffuse" "rgb L" [ 1 2 3 ]
              Shape "sphere" "float radius" 0.5
            AttributeEnd
            CoordSysTransform "camera"
            LightSource "distant" "rgb L" [ 1 1 1 ]
            Shape "sphere" """
        )
        first, second = scene.shapes
        np.testing.assert_allclose(first.world_from_object @ [1, 1, 1, 1], [3, 4, 5, 1])
        self.assertTrue(first.reverse_orientation)
        self.assertEqual(first.area_light.get("L"), [1, 2, 3])
        self.assertFalse(second.reverse_orientation)
        self.assertIsNone(second.area_light)
        self.assertEqual(scene.camera.get("fov"), [30])
        np.testing.assert_allclose(scene.camera_from_world @ [0, 0, 0, 1], [0, 0, 5, 1], atol=1e-12)
        np.testing.assert_allclose(scene.lights[0].world_from_light @ [0, 0, 1, 0], [0, 0, 1, 0], atol=1e-12)

    def test_rotate_turns_counter_clockwise(self):
        scene = self.read('Camera "perspective" WorldBegin Rotate 90 0 0 1 Shape "sphere"')
        np.testing.assert_allclose(scene.shapes[0].world_from_object @ [1, 0, 0, 1], [0, 1, 0, 1], atol=1e-12)

    def test_what_is_not_known_is_refused(self):
        with self.assertRaises(Unsupported):
            self.read('Camera "perspective" WorldBegin MediumInterface "a" "b"')


class Efficiency(unittest.TestCase):
    def setUp(self):
        random = np.random.default_rng(1)
        self.truth = random.uniform(0.5, 2, (40, 40, 1)) * [1, 0.5, 0.2]
        self.noise = lambda seeds, sigma: self.truth * (1 + sigma * random.standard_normal((seeds, 40, 40, 3)))

    def test_relative_noise_gives_its_variance(self):
        # The standard error of relMSE over 4800 independent values with 19 degrees of freedom is below 0.7 %.
        stack = self.noise(20, 0.1)
        below = denominator([stack])
        self.assertAlmostEqual(relative_mse(stack, below) / 0.01, 1, delta=0.03)

    def test_trimming_takes_fireflies_out(self):
        stack = self.noise(20, 0.1)
        below = denominator([stack])
        stack[3, 7, 7] += 1000
        self.assertGreater(relative_mse(stack, below), 1)
        self.assertAlmostEqual(relative_mse(stack, below, trimmed=True) / 0.01, 1, delta=0.05)

    def test_the_interval_holds_the_truth(self):
        # Twice the noise at half the time: efficiency 1/2. 40 intervals of 95 %: 33 hold with probability > 0.998.
        random, held = np.random.default_rng(2), 0
        for _ in range(40):
            a, b = self.noise(8, 0.2), self.noise(8, 0.1)
            below = denominator([a, b])
            busy = random.lognormal(0, 0.3, 8)
            times = [busy * t * random.lognormal(0, 0.05, 8) for t in (0.5, 1)]

            def ratio(keep):
                return efficiency(a[keep], times[0][keep], below) / efficiency(b[keep], times[1][keep], below)

            _, low, high = jackknife_ratio(8, ratio)
            held += low <= 0.5 <= high
        self.assertGreaterEqual(held, 33)

    def test_student(self):
        for freedom, quantile in [(5, 2.5706), (7, 2.3646), (15, 2.1314), (100, 1.9840)]:
            self.assertAlmostEqual(student_t_975(freedom) / quantile, 1, delta=0.002)


if __name__ == "__main__":
    unittest.main()
