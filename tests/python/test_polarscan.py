# SPDX-License-Identifier: Apache-2.0
"""The Python module, compared with closed forms, with readers of its files in plain Python, and with the program."""
import json, os, signal, subprocess, sys, tempfile, time, unittest
from pathlib import Path

try:
    import numpy as np
except ImportError:
    raise unittest.SkipTest("python3-numpy is not installed")
import polarscan

PROGRAM = os.environ["POLARSCAN_PROGRAM"]
sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
import read_session


def run(*arguments):
    subprocess.run([PROGRAM, "--quiet", *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def mosaic(s0, s1, s2, full_scale):
    """Counts of even light behind ideal polarizers at 90 45 / 135 0 (docs/conventions.md)."""
    intensity = lambda deg: (s0 + s1 * np.cos(2 * np.radians(deg)) + s2 * np.sin(2 * np.radians(deg))) / 2
    return full_scale * np.tile([[intensity(90), intensity(45)], [intensity(135), intensity(0)]], (8, 10))


class Temporary(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)


class Demosaicing(Temporary):
    def test_every_method_finds_the_polarization_of_even_light(self):
        counts = 60 + mosaic(0.8, 0.12, -0.2, 4000).round()
        for method in polarscan.demosaic_methods():
            stokes = polarscan.demosaic(counts.astype(np.uint16), "90 45 / 135 0", bits=12, black=60, white=4060,
                                        method=method)
            np.testing.assert_allclose(stokes.s0, 0.8, atol=5e-4, err_msg=method)
            np.testing.assert_allclose(stokes.s1, 0.12, atol=5e-4, err_msg=method)
            np.testing.assert_allclose(stokes.s2, -0.2, atol=5e-4, err_msg=method)

    def test_angle_and_degree_are_those_of_the_closed_forms(self):
        angle, degree = np.meshgrid(np.linspace(0, np.pi, 50, endpoint=False) + 0.01, np.linspace(0.1, 1, 10))
        s1, s2 = degree * np.cos(2 * angle), degree * np.sin(2 * angle)
        np.testing.assert_allclose(polarscan.aop(s1, s2), angle, atol=1e-6)
        np.testing.assert_allclose(polarscan.dop(np.ones_like(s1), s1, s2), degree, atol=1e-6)

    def test_errors_say_what_is_wrong(self):
        with self.assertRaisesRegex(polarscan.Error, "does not consist of whole 2x2 cells"):
            polarscan.demosaic(np.zeros((3, 4), np.uint8), "90 45 / 135 0")
        with self.assertRaisesRegex(polarscan.Error, "bits=12"):
            polarscan.demosaic(np.zeros((4, 4), np.uint16), "90 45 / 135 0")
        with self.assertRaisesRegex(polarscan.Error, "1 dimensions"):
            polarscan.demosaic(np.zeros(16, np.uint8), "90 45 / 135 0")

    def test_stokes_files_come_back_as_they_were(self):
        stokes = polarscan.demosaic(mosaic(0.8, 0.12, -0.2, 255).astype(np.uint8), "90 45 / 135 0")
        polarscan.write_stokes(self.folder / "view.tif", stokes)
        for there, back in zip(stokes, polarscan.read_stokes(self.folder / "view.tif")):
            np.testing.assert_array_equal(there, back)


class Sessions(Temporary):
    def test_frames_are_those_that_the_reader_in_plain_python_finds(self):
        path = self.folder / "session"
        run("capture", "--camera", "simulated", "-o", path, "--frames", 3, "--set", "width=32", "--set", "height=24",
            "--set", "pixel-format=Mono12p", "--set", "prepared=1", "--set", "rings=30:1", "--set", "samples=1")
        session = polarscan.Session(path)
        frames = list(read_session.frames(path))
        self.assertEqual(len(session.frames), 3)
        for number, (header, payload) in enumerate(frames):
            self.assertEqual(session.frames[number]["sequence"], header["sequence"])
            np.testing.assert_equal(session.frames[number]["exposure_us"], header["exposure_us"])  # NaN: unknown
            np.testing.assert_array_equal(session.frame(number), read_session.samples(header, payload))
        self.assertEqual(session.sensor["bits"], 12)
        view = session.views[0]
        self.assertEqual(session.counts(view).shape, (24, 32))
        self.assertEqual(session.damage, [])
        with self.assertRaises(IndexError):
            session.frame(3)
        with self.assertRaisesRegex(polarscan.Error, "no view nobody"):
            session.counts("nobody")


def colmap_map(path):
    """A reader of its own: width&height&channels&, float32 planes."""
    header, rest = path.read_bytes().split(b"&", 3)[:3], path.read_bytes().split(b"&", 3)[3]
    width, height, channels = map(int, header)
    return np.frombuffer(rest, "<f4").reshape(channels, height, width)


class Maps(Temporary):
    def test_files_are_colmaps_and_come_back_as_they_were(self):
        random = np.random.default_rng(1)
        depth = random.random((5, 7), np.float32)
        normal = random.normal(size=(5, 7, 3)).astype(np.float32)
        polarscan.write_depth_map(self.folder / "depth.bin", depth)
        polarscan.write_normal_map(self.folder / "normal.bin", normal)
        np.testing.assert_array_equal(colmap_map(self.folder / "depth.bin")[0], depth)
        np.testing.assert_array_equal(colmap_map(self.folder / "normal.bin"), normal.transpose(2, 0, 1))
        np.testing.assert_array_equal(polarscan.read_depth_map(self.folder / "depth.bin"), depth)
        np.testing.assert_array_equal(polarscan.read_normal_map(self.folder / "normal.bin"), normal)

    def test_a_short_file_is_an_error_that_names_it(self):
        (self.folder / "short.bin").write_bytes(b"7&5&1&" + bytes(12))
        with self.assertRaisesRegex(polarscan.Error, "short.bin"):
            polarscan.read_depth_map(self.folder / "short.bin")


class Stereo(Temporary):
    def test_maps_of_arrays_are_the_bytes_that_the_program_makes(self):
        scan, dense = self.folder / "scan", self.folder / "scan/dense"
        run("simulate", "-o", self.folder / "input", "--texture", "strong", "--samples", 1, "--known-poses", "--rings",
            "30:6", "--width", 96, "--height", 80)
        run("reconstruct", self.folder / "input", "-o", scan, "--preset", "fast", "--rounds", 1, "--no-filter", "--no-mesh")
        views, names = [], []
        for view in json.loads((dense / "views.json").read_text())["views"]:
            names.append(view["name"])
            c, pose = view["camera"], view["cam_from_world"]
            views.append(polarscan.View(
                polarscan.read_stokes(dense / "polar" / f"{view['name']}.tif"),
                [[c["fx"], 0, c["cx"]], [0, c["fy"], c["cy"]], [0, 0, 1]],
                np.c_[np.reshape(pose["rotation_rows"], (3, 3)), pose["translation"]],
                (view["depth_min"], view["depth_max"])))
        maps = polarscan.stereo(views, preset="fast", rounds=1, filter=False, threads=1)
        for name, (depth, normal) in zip(names, maps):
            file = f"{name}.png.geometric.bin"
            np.testing.assert_array_equal(depth, colmap_map(dense / "stereo/depth_maps" / file)[0])
            np.testing.assert_array_equal(normal.transpose(2, 0, 1), colmap_map(dense / "stereo/normal_maps" / file))
            self.assertGreater((depth > 0).mean(), 0.02)

    def test_ctrl_c_stops_it_soon(self):
        script = ("import numpy as np, polarscan\n"
                  "light = np.random.default_rng(1).random((600, 800), np.float32)\n"
                  "pose = lambda x: np.c_[np.eye(3), [x, 0, 0]]\n"
                  "views = [polarscan.View(light, [[800, 0, 400], [0, 800, 300], [0, 0, 1]], pose(x), (1, 9)) for x in range(4)]\n"
                  "print('begun', flush=True)\n"
                  "polarscan.stereo(views, preset='best')\n")
        program = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        self.assertEqual(program.stdout.readline(), "begun\n")
        time.sleep(3)
        self.assertIsNone(program.poll(), "it was done before it could be stopped")
        program.send_signal(signal.SIGINT)
        _, error = program.communicate(timeout=20)
        self.assertIn("KeyboardInterrupt", error)

    def test_a_mask_keeps_the_estimates_inside_of_it(self):
        light = np.random.default_rng(1).random((24, 32), np.float32)
        mask = np.zeros(light.shape, bool)
        mask[6:18, 8:24] = True
        pose = lambda x: np.c_[np.eye(3), [x, 0, 0]]
        views = [polarscan.View(light, [[32, 0, 16], [0, 32, 12], [0, 0, 1]], pose(x), (1, 9), mask) for x in (0, 1, 2)]
        for depth, _ in polarscan.stereo(views, preset="fast", filter=False):
            self.assertTrue((depth[mask] > 0).any())
            self.assertFalse((depth[~mask] > 0).any())

    def test_what_cannot_be_is_an_error(self):
        with self.assertRaisesRegex(polarscan.Error, "no views"):
            polarscan.stereo([])
        view = polarscan.View(np.ones((8, 8)), np.diag([10, 10, 1]), np.eye(4), (1, 2))
        with self.assertRaisesRegex(polarscan.Error, "mask"):
            polarscan.stereo([view._replace(mask=np.ones((4, 4)))] * 2)

    def test_an_option_that_is_not_there_is_named(self):
        view = polarscan.View(np.ones((8, 8)), np.diag([10, 10, 1]), np.eye(4), (1, 2))
        with self.assertRaisesRegex(polarscan.Error, "no such option: window-size"):
            polarscan.stereo([view, view], window_size=3)
