# SPDX-License-Identifier: Apache-2.0
"""What the tests of tools/ share: a sphere, of which everything is known in closed form, its views, and a folder of a test's own."""
import importlib.util
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

import numpy as np

TOOLS = pathlib.Path(__file__).parents[2] / 'tools'
sys.dont_write_bytecode = True
sys.path.insert(0, str(TOOLS))
from files.meshes import Mesh  # noqa: E402
from files.model import View  # noqa: E402
from render.cameras import look_at_origin  # noqa: E402

DISTANCE = 4.0


def needs(*packages):
    missing = [p for p in packages if importlib.util.find_spec(p) is None]
    return unittest.skipIf(missing, f'python has no {", ".join(missing)}')


def sphere(steps=4):
    """The unit sphere as an octahedron whose triangles are halved `steps` times; normals are exact."""
    v = [np.array(p, float) for p in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))]
    f = [(a, b, c) if (a + b + c) % 2 else (b, a, c) for a in (0, 1) for b in (2, 3) for c in (4, 5)]
    f = [t if np.linalg.det([v[k] for k in t]) > 0 else t[::-1] for t in f]
    for _ in range(steps):
        middle, halved = {}, []
        for a, b, c in f:
            m = []
            for p, q in ((a, b), (b, c), (c, a)):
                key = (min(p, q), max(p, q))
                if key not in middle:
                    middle[key] = len(v)
                    v.append((v[p] + v[q]) / np.linalg.norm(v[p] + v[q]))
                m.append(middle[key])
            halved += [(a, m[0], m[2]), (m[0], b, m[1]), (m[2], m[1], c), tuple(m)]
        f = halved
    return Mesh(np.array(v), np.array(f), np.array(v))


def views(count=3, width=80, height=60):
    """Views of the unit sphere whose axes do not meet the origin's pixel at the picture's centre."""
    turns = [look_at_origin(0.3 * k, 0.7 * k, 0.2 * k) for k in range(count)]
    return [View(f'{k}.png', width, height, np.array([100.0, 104]), np.array([38.5, 31]), turn, np.array([0, 0, DISTANCE]))
            for k, turn in enumerate(turns)]


def exact_maps(view, offset=0.5):
    """z-depth (0: nothing) and normals in the camera's frame of the unit sphere, in closed form."""
    rays = view.rays(view.pixel_grid(offset))
    square, along = (rays ** 2).sum(-1), rays @ view.translation
    root = along ** 2 - square * (view.translation @ view.translation - 1)
    depth = np.where(root > 0, (along - np.sqrt(root.clip(0))) / square, 0)
    return depth, np.where(depth[..., None] > 0, rays * depth[..., None] - view.translation, 0)


class InAFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_tool(self, name, *words):
        environment = {**os.environ, 'PYTHONDONTWRITEBYTECODE': '1'}
        run = subprocess.run([sys.executable, TOOLS / name, *map(str, words)], capture_output=True, text=True, env=environment)
        self.assertEqual(run.returncode, 0, run.stderr)
        return json.loads(run.stdout)
