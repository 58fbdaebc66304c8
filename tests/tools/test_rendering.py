# SPDX-License-Identifier: Apache-2.0
"""The programs of tools/ that make or check polarization pictures, against the closed form of a sphere. What needs packages that
are not installed is skipped, and says which."""
import unittest

import numpy as np
from known_sphere import DISTANCE, InAFolder, exact_maps, needs, sphere, views  # first: it finds tools/
from files.meshes import write_mesh
from files.model import read_model, write_model
from render.denoise import Features, denoise
from render.stokes import ANGLES, behind_polarizer, of_angles, of_raw_frame, raw_frame, to_lens_frame


class Light(unittest.TestCase):
    def test_stokes_components_come_back_from_four_angles_and_from_a_raw_frame(self):
        rng = np.random.default_rng(5)
        s0 = rng.uniform(0.3, 0.9, (3, 4))
        stokes = np.stack([s0, 0.3 * s0, -0.2 * s0])
        self.assertTrue(np.allclose(of_angles({a: behind_polarizer(stokes, a) for a in ANGLES}), stokes))
        even = np.repeat(np.repeat(stokes, 2, 1), 2, 2)
        seen = np.mean([of_raw_frame(raw_frame(even, rng)) for _ in range(400)], 0)
        self.assertLess(np.abs(seen - stokes).max(), 0.003)

    def test_the_sensor_has_90_degrees_at_its_top_left_and_45_beside_it(self):
        one = np.ones((2, 2))
        level, diagonal = (raw_frame(np.stack(s), np.random.default_rng(1)) for s in ((one, one, 0 * one), (one, 0 * one, one)))
        self.assertTrue(level[0, 0] < 80 and level[1, 1] > 3900 and diagonal[0, 1] > 3900 and diagonal[1, 0] < 80)

    def test_the_lens_frame_is_that_of_the_shortest_rotation(self):
        view = views(1)[0]
        rays = view.rays(np.array([[view.centre, view.centre + 40, view.centre - 40, view.centre + [40, -40]]]))
        s0, s1, s2 = to_lens_frame(np.array([[[1.0] * 4], [[0.5] * 4], [[0.0] * 4]]), rays)
        other = to_lens_frame(np.array([[[1.0] * 4], [[0.0] * 4], [[0.5] * 4]]), rays)  # light at 45 degrees
        self.assertTrue(np.allclose(other[1], -s2) and np.allclose(other[2], s1))
        self.assertTrue(np.allclose(np.hypot(s1, s2), 0.5) and np.allclose(s0, 1))
        self.assertTrue(np.allclose([s1[0, 0], s2[0, 0]], [0.5, 0]))
        x, y = rays[0, 1, :2]  # by hand: the sine of the angle between the two references is x y / ((1 + |ray|) sqrt(1 + x^2))
        turn = np.arcsin(x * y / ((1 + np.sqrt(1 + x * x + y * y)) * np.sqrt(1 + x * x)))
        self.assertAlmostEqual(np.arctan2(s2[0, 1], s1[0, 1]) / 2, -turn)
        self.assertAlmostEqual(s2[0, 1], s2[0, 2])
        self.assertLess(s2[0, 1] * s2[0, 3], 0)

    def test_denoising_keeps_what_is_linear_and_takes_noise_out(self):
        y, x = np.mgrid[:20, :30] / 10.0
        normal = np.dstack([0 * x, 0 * x, np.ones_like(x)])
        features = Features(normal, np.dstack([x, y, 0 * x]), 0 * x, np.ones(x.shape, bool))
        plane = (2 + 0.5 * x - 0.3 * y)[:, :, None]
        self.assertLess(np.abs(denoise(plane, features, 3, 0.1) - plane).max(), 0.01)
        noise = np.random.default_rng(2).normal(0, 1, plane.shape)
        self.assertLess(denoise(noise, features, 3, 0.1).std(), 0.35)
        beyond = Features(normal, np.dstack([x, y, np.where(x > 1.5, 9, 0)]), 0 * x, np.ones(x.shape, bool))
        step = np.where(x > 1.5, 5.0, 1.0)[:, :, None]
        self.assertLess(np.abs(denoise(step, beyond, 3, 0.1) - step).max(), 1e-6)  # nothing crosses a step in depth


@needs('PIL')
class Sets(InAFolder):
    """tools/check_set.py on sets whose angles of polarization are made up from the sphere's normals."""

    def check(self, turn, offset=0):
        from files.pictures import write_png
        mesh = sphere(5)
        write_mesh(self.folder / 'truth/mesh.ply', mesh)
        write_model(self.folder / 'sparse', views())
        for view in views():
            depth, normals = exact_maps(view)
            rays = view.rays(view.pixel_grid())
            flat = normals[..., :2] - normals[..., 2:] * rays[..., :2]
            aop = turn * np.arctan2(-flat[..., 1], flat[..., 0]) + np.radians(offset)
            seen = np.where(depth > 0, 0.5, 0)
            stokes = seen * np.stack([np.ones_like(aop), 0.2 * np.cos(2 * aop), 0.2 * np.sin(2 * aop)])
            for a in ANGLES:
                write_png(self.folder / f'I-{a:02d}' / view.name, (65535 * behind_polarizer(stokes, a)).round().astype('u2'))
            write_png(self.folder / 'masks' / view.name, (255 * (depth > 0)).astype('u1'))
        return self.run_tool('check_set.py', self.folder)

    def test_diffuse_specular_and_turned_light_are_told_apart(self):
        diffuse, specular, turned = (self.check(1, offset) for offset in (0, 90, 5))
        for report in (diffuse, specular):
            self.assertLess(report['aop_off_azimuth_deg'], 0.1)
            self.assertAlmostEqual(report['polarized'], 1, 1)
            self.assertGreater(report['least_mask_overlap'], 0.97)
            self.assertAlmostEqual(report['dop_median'], 0.2, 3)
        self.assertGreater(diffuse['diffuse'], 0.99)
        self.assertGreater(specular['specular'], 0.99)
        self.assertAlmostEqual(turned['signed_deg'], 5, 1)

    def test_light_that_is_counted_clockwise_is_told(self):
        report = self.check(-1)
        self.assertLess(report['mirrored_deg'], 0.1)
        self.assertGreater(report['aop_off_azimuth_deg'], 15)


@needs('PIL', 'mitsuba')
class Rendering(InAFolder):
    def test_a_rendered_sphere_polarizes_as_its_normals_say(self):
        write_mesh(self.folder / 'sphere.ply', sphere(4))
        made = self.run_tool('render_polar.py', self.folder / 'sphere.ply', self.folder / 'set', '--rings', '20:2', '--width', 64,
                             '--height', 48, '--spp', 16, '--texture', 'none', '--light', 'overcast', '--albedo', 0.1)
        self.assertEqual(made['views'], 2)
        report = self.run_tool('check_set.py', self.folder / 'set')
        self.assertLess(abs(report['signed_deg']), 1)
        self.assertLess(report['aop_off_azimuth_deg'], 6)
        self.assertGreater(report['mirrored_deg'], 15)
        self.assertGreater(report['polarized'], 0.5)
        self.assertGreater(report['least_mask_overlap'], 0.95)
        view = read_model(self.folder / 'set/sparse')[0]
        self.assertLess(abs(view.translation[2] - DISTANCE), 2)


if __name__ == '__main__':
    unittest.main()
