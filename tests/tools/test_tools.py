# SPDX-License-Identifier: Apache-2.0
"""The programs of tools/ against closed forms: of a sphere everything is known. Files, rays, and errors of maps and clouds;
pictures are in test_rendering.py. What needs packages that are not installed is skipped, and says which."""
import unittest

import numpy as np
from known_sphere import DISTANCE, InAFolder, exact_maps, needs, sphere, views  # first: it finds tools/
from files.maps import read_map, write_map
from files.meshes import Mesh, read_mesh, read_points, write_mesh
from files.model import quaternion_of, read_model, rotation_of, write_model
from render.cameras import unit_object
from truth.distance import face_normals, sample
from truth.first_hit import NONE, first_hits, object_hits, true_maps, true_normals, visible


class Files(InAFolder):
    def test_a_mesh_comes_back_from_every_form_of_ply_and_obj(self):
        mesh = sphere(1)
        write_mesh(self.folder / 'binary.ply', mesh)
        head = 'ply\nformat {}\ncomment by hand\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n'
        faces = 'element face {}\nproperty list uchar uint vertex_index\nproperty uchar flag\nend_header\n'
        text = (head + faces).format('ascii 1.0', len(mesh.vertices), len(mesh.triangles))
        text += ''.join('%r %r %r\n' % tuple(map(float, p)) for p in mesh.vertices)
        (self.folder / 'ascii.ply').write_text(text + ''.join('3 %d %d %d 7\n' % tuple(t) for t in mesh.triangles))
        text = (head + faces).format('binary_big_endian 1.0', len(mesh.vertices), len(mesh.triangles)).encode()
        rows = b''.join(b'\3' + t.astype('>u4').tobytes() + b'\7' for t in mesh.triangles)
        (self.folder / 'big.ply').write_bytes(text + mesh.vertices.astype('>f8').tobytes() + rows)
        lines = ['v %r %r %r' % tuple(map(float, p)) for p in mesh.vertices]
        lines += ['f %d//1 %d//1 %d//1' % tuple(t + 1) for t in mesh.triangles]
        (self.folder / 'mesh.obj').write_text('# by hand\n' + '\n'.join(lines))
        for name in ('binary.ply', 'ascii.ply', 'big.ply', 'mesh.obj'):
            read = read_mesh(self.folder / name)
            self.assertTrue(np.allclose(read.vertices, mesh.vertices, atol=1e-7), name)
            self.assertTrue((read.triangles == mesh.triangles).all(), name)
            self.assertGreater((read.normals * mesh.normals).sum(1).min(), 0.99, name)

    def test_polygons_become_fans_and_strips_triangles_of_one_orientation(self):
        head = 'ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n'
        points = '0 0 0\n1 0 0\n1 1 0\n0 1 0\n2 0 0\n'
        (self.folder / 'fan.ply').write_text(head + 'element face 2\nproperty list uchar int vertex_indices\nend_header\n'
                                             + points + '4 0 1 2 3\n3 1 4 2\n')
        (self.folder / 'strip.ply').write_text(head + 'element tristrips 1\nproperty list int int vertex_indices\nend_header\n'
                                               + points + '8 3 0 2 1 -1 1 4 2\n')
        for name in ('fan.ply', 'strip.ply'):
            mesh = read_mesh(self.folder / name)
            self.assertEqual(len(mesh.triangles), 3)
            self.assertTrue(np.allclose(face_normals(mesh, np.arange(3)), [0, 0, 1]), name)
            self.assertAlmostEqual(sample(mesh, 1, np.random.default_rng(0))[2], 1.5)

    def test_poses_and_maps_come_back(self):
        rng, before = np.random.default_rng(1), views()
        for _ in range(100):
            q = rng.normal(size=4)
            self.assertTrue(np.allclose(rotation_of(quaternion_of(rotation_of(q))), rotation_of(q), atol=1e-12))
        self.assertTrue(np.allclose(rotation_of([1, 0, 0, 1]) @ [1, 0, 0], [0, 1, 0]))  # a quarter turn about z
        write_model(self.folder, before)
        for a, b in zip(before, read_model(self.folder)):
            self.assertEqual((a.name, a.width, a.height), (b.name, b.width, b.height))
            for name in ('focal', 'centre', 'rotation', 'translation'):
                self.assertTrue(np.allclose(getattr(a, name), getattr(b, name), atol=1e-10), name)
        values = rng.random((4, 5, 3)).astype('f4')
        write_map(self.folder / 'map.bin', values)
        self.assertTrue((read_map(self.folder / 'map.bin') == values).all())

    def test_an_object_becomes_a_unit_sphere_with_y_up(self):
        ball = sphere(2)
        moved = Mesh(np.vstack([[9, 9, 9], 5 * ball.vertices + [1, 2, 3]]), ball.triangles + 1, None)  # one vertex is unused
        made = unit_object(moved, 'z')
        self.assertEqual(len(made.vertices), len(ball.vertices))
        turned = ball.vertices[:, [0, 2, 1]] * [1, 1, -1]
        self.assertLess(np.abs(made.vertices - turned).max(), 2e-3)
        self.assertAlmostEqual(np.linalg.norm(made.vertices, axis=1).max(), 1)
        self.assertGreater((made.normals * made.vertices).sum(1).min(), 0.95)


class Rays(unittest.TestCase):
    def test_what_a_view_sees_of_a_sphere_is_the_closed_form(self):
        mesh = sphere(5)
        for view in views():
            for offset in (0.5, 0.0):
                exact, normals = exact_maps(view, offset)
                depth, hit = true_maps(view, mesh, offset)
                both = (depth > 0) & (exact > 0)
                self.assertLess(((depth > 0) != (exact > 0)).sum(), 0.03 * both.sum())  # at the rim
                radius = np.linalg.norm((view.rays(view.pixel_grid(offset)) * depth[..., None] - view.translation)[both], axis=1)
                self.assertTrue(0.9985 < radius.min() and radius.max() < 1 + 1e-9)  # triangles lie inside of the sphere
                inner = both & (-normals[..., 2] > 0.5)
                self.assertLess(np.median(np.abs(depth - exact)[inner]), 1e-3)
                angle = np.degrees(np.arccos((true_normals(view, mesh, hit, offset) * normals).sum(-1)[inner].clip(-1, 1)))
                self.assertLess(angle.max(), 0.2)  # the ray meets the triangle beside where it meets the sphere

    def test_no_ray_slips_between_triangles(self):
        view = views(1, 400, 300)[0].resized(1600, 1200)
        on_edges = sphere(3).vertices @ view.rotation.T  # rays exactly through vertices, where six triangles meet
        facing = sphere(3).vertices[on_edges[:, 2] < -0.3]
        depth, _ = first_hits(view, sphere(3), view.to_pixels(view.to_camera(facing)))
        self.assertLess(np.abs(depth - view.to_camera(facing)[:, 2]).max(), 1e-9)

    def test_a_triangle_behind_or_through_the_camera_does_no_harm(self):
        view, ball = views(1)[0], sphere(3)
        behind = np.array([[-1, -1, 9], [1, -1, 9], [0, 1, 9], [-30, -5, 9], [30, -5, 9], [0, -5, -90.0]])
        mesh = Mesh(np.vstack([ball.vertices, behind]), np.vstack([ball.triangles, len(ball.vertices) + np.arange(6).reshape(2, 3)]),
                    None)
        there, alone = true_maps(view, mesh)[0], true_maps(view, ball)[0]
        self.assertTrue((there[alone > 0] == alone[alone > 0]).all())

    def test_a_floor_that_runs_under_the_camera_is_hit_at_its_height(self):
        view = views(1)[0]
        corners = np.array([[-900, 1, -900], [900, 1, -900], [0, 1, 900.0]]) - [0, 0, DISTANCE]  # y is down, in the camera's axes
        floor = Mesh((corners - view.translation) @ view.rotation, np.array([[0, 1, 2]]), None)
        depth, _ = true_maps(view, floor)
        below = view.rays(view.pixel_grid())[..., 1] > 0.02
        self.assertLess(np.abs(depth * view.rays(view.pixel_grid())[..., 1] - 1)[below].max(), 1e-9)
        self.assertEqual(depth[:25].max(), 0)

    def test_what_stands_before_a_surface_hides_it(self):
        view, ball = views(1)[0], sphere(3)
        points, triangle, _ = sample(ball, 5000, np.random.default_rng(4))
        normals = face_normals(ball, triangle)
        right = view.to_camera(points)[:, 0] > 0.01
        plate = np.array([[0, -3, 2], [3, -3, 2], [3, 3, 2], [0, 3, 2.0]]) - view.translation  # before the right half
        corners = np.vstack([ball.vertices, plate @ view.rotation])
        both = Mesh(corners, np.vstack([ball.triangles, len(ball.vertices) + np.array([[0, 1, 2], [0, 2, 3]])]), None)
        alone, hidden = visible(view, ball, points, normals, 1e-4), visible(view, both, points, normals, 1e-4)
        self.assertGreater(alone[right].sum(), 500)
        self.assertEqual(hidden[right].sum(), 0)

    def test_a_table_hides_the_object(self):
        view, ball = views(1)[0], sphere(3)
        corners = np.array([[-2, -2, 2], [2, -2, 2], [2, 0, 2], [-2, 0, 2.0]])  # before the lower half of the sphere
        hit = object_hits(view, ball, Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), None))
        alone, edge = object_hits(view, ball), int(view.centre[1])
        self.assertTrue((hit[edge:] == NONE).all() and (hit[:edge] == alone[:edge]).all() and (alone[edge:] != NONE).any())

    def test_a_camera_sees_the_cap_of_a_sphere_that_faces_it(self):
        mesh, view = sphere(4), views(2)[1]
        points, triangle, area = sample(mesh, 50000, np.random.default_rng(3))
        self.assertLess(abs(area / (4 * np.pi) - 1), 0.01)
        seen = visible(view, mesh, points, face_normals(mesh, triangle), 1e-4)
        self.assertLess(abs(seen.mean() - (1 - 1 / DISTANCE) / 2), 0.01)
        self.assertGreater((points[seen] @ view.position() / DISTANCE).min(), 1 / DISTANCE - 0.08)  # triangles at the rim are tilted


class Maps(InAFolder):
    def evaluate(self, change=lambda depth, normals: (depth, normals), *words):
        mesh = sphere(4)
        write_mesh(self.folder / 'mesh.ply', mesh)
        write_model(self.folder / 'sparse', views())
        for view in views():
            depth, hit = true_maps(view, mesh)
            depth, normals = change(depth, true_normals(view, mesh, hit))
            write_map(self.folder / f'stereo/depth_maps/{view.name}.geometric.bin', depth)
            write_map(self.folder / f'stereo/normal_maps/{view.name}.geometric.bin', normals)
        return self.run_tool('eval_maps.py', self.folder, self.folder / 'sparse', self.folder / 'mesh.ply', *words)['mean']

    def test_the_truth_has_no_error(self):
        mean = self.evaluate()
        self.assertEqual((mean['completeness'], mean['beyond']), (1, 0))
        self.assertLess(mean['depth']['mean'], 1e-6)
        self.assertLess(mean['normal_degrees']['over_all']['mean'], 1e-4)
        self.assertEqual(mean['depth']['within']['0.001'], 1)

    def test_depths_moved_by_three_thousandths_have_that_error(self):
        mean = self.evaluate(lambda depth, normals: (np.where(depth > 0, depth + 0.003, 0), normals))
        self.assertAlmostEqual(mean['depth']['mean'], 0.003, 5)
        self.assertEqual((mean['depth']['within']['0.002'], mean['depth']['within']['0.005']), (0, 1))

    def test_normals_turned_about_an_axis_across_them_have_that_error(self):
        def change(depth, normals):
            across = np.cross(normals, [0.3, 0.5, 0.1])
            across /= np.maximum(np.linalg.norm(across, axis=-1, keepdims=True), 1e-9)
            turn = np.radians(7)
            return depth, 2.5 * (np.cos(turn) * normals + np.sin(turn) * np.cross(across, normals))  # of any length
        mean = self.evaluate(change)['normal_degrees']
        self.assertAlmostEqual(mean['mean'], 7, 3)
        self.assertEqual((mean['within']['5'], mean['within']['10']), (0, 1))

    def test_missing_pixels_count_as_the_penalty_and_others_as_beyond(self):
        def change(depth, normals):
            there = depth > 0
            depth[:, :35] = 0
            depth[0] = 1
            return np.where(there | (depth == 1), depth, 0), normals
        mean = self.evaluate(change, '--depth-penalty', 0.2, '--normal-penalty', 45)
        missing = 1 - mean['completeness']
        self.assertTrue(0.2 < missing < 0.6)
        self.assertAlmostEqual(mean['depth']['over_all']['mean'], 0.2 * missing, 5)
        self.assertAlmostEqual(mean['normal_degrees']['over_all']['mean'], 45 * missing, 3)
        self.assertGreater(mean['beyond'], 0.01)

    def test_no_error_counts_as_more_than_the_penalty(self):
        mean = self.evaluate(lambda d, n: (np.where(d > 0, d + 1, 0), -n), '--depth-penalty', 0.25, '--normal-penalty', 30)
        self.assertAlmostEqual(mean['depth']['mean'], 1, 5)
        self.assertEqual((mean['depth']['over_all']['mean'], mean['normal_degrees']['over_all']['mean']), (0.25, 30))

    def test_the_other_pixel_centre_is_told(self):
        right, wrong = self.evaluate(), self.evaluate(lambda d, n: (d, n), '--pixel-centre', 0)
        self.assertGreater(wrong['depth']['median'], 1e-3)
        self.assertLess(right['depth']['median'], 1e-6)


@needs('scipy')
class Clouds(InAFolder):
    def evaluate(self, points, *words):
        write_mesh(self.folder / 'mesh.ply', sphere(5))
        write_model(self.folder / 'sparse', views())
        header = f'ply\nformat ascii 1.0\nelement vertex {len(points)}\n'
        header += ''.join(f'property float {k}\n' for k in 'xyz') + 'end_header\n'
        (self.folder / 'cloud.ply').write_text(header + '\n'.join('%.9g %.9g %.9g' % tuple(p) for p in points))
        self.assertTrue(np.allclose(read_points(self.folder / 'cloud.ply'), points, atol=1e-6))
        return self.run_tool('eval_cloud.py', self.folder / 'cloud.ply', self.folder / 'mesh.ply', '--samples', 50000, *words)

    def points(self, count=20000):
        return sample(sphere(5), count, np.random.default_rng(7))[0]

    def test_points_of_the_surface_have_no_error(self):
        report = self.evaluate(self.points(), '--exact')
        self.assertLess(report['accuracy']['mean'], 1e-6)
        self.assertLess(report['completeness']['mean'], 0.02)
        self.assertLess(abs(report['area'] / (4 * np.pi) - 1), 0.01)

    def test_a_cloud_moved_outward_by_a_hundredth_has_that_accuracy(self):
        report = self.evaluate(1.01 * self.points(), '--exact', '--threshold', 0.009, 0.012)
        self.assertLess(abs(report['accuracy']['mean'] - 0.01), 2e-4)
        self.assertEqual([report['thresholds'][t]['precision'] for t in ('0.009', '0.012')], [0, 1])

    def test_half_a_sphere_is_complete_by_half_and_a_cap_holds_the_rest(self):
        points = self.points()
        report = self.evaluate(points[points[:, 2] > 0], '--threshold', 0.05, '--cap', 0.1)
        self.assertLess(abs(report['thresholds']['0.05']['recall'] - 0.525), 0.02)  # half, and 0.05 beyond its rim
        self.assertLess(report['completeness']['mean'], 0.06)
        self.assertGreater(report['completeness']['p90'], 0.85)

    def test_only_what_cameras_see_counts(self):
        points = self.points()
        cap = points[points @ views(1)[0].position() > 0.5]
        report = self.evaluate(cap, '--visible-from', self.folder / 'sparse', '--min-views', 3, '--threshold', 0.05)
        self.assertTrue(0.15 < report['visible_share'] < 0.375)
        self.assertGreater(report['thresholds']['0.05']['recall'], 0.75)


if __name__ == '__main__':
    unittest.main()
