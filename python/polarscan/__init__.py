# SPDX-License-Identifier: Apache-2.0
"""polarscan for numpy: sessions, demosaicing, polarization, PolarPMS stereo, COLMAP's maps.

Arrays are height x width, rows from the top; light is linear, in units of the sensor's full scale; angles are
radians, anticlockwise as displayed; pixel centres at integer + 0.5 (docs/conventions.md). What goes wrong is a
polarscan.Error with a sentence for people.
"""
import tempfile
from pathlib import Path
from typing import NamedTuple, Optional, Tuple, Union

import numpy as np

from . import _polarscan
from ._polarscan import (Error, Session, __version__, aop, demosaic_methods, dop, read_depth_map, read_normal_map,
                         stereo_options, write_depth_map, write_normal_map)

__all__ = ["Error", "Maps", "Session", "Stokes", "View", "aop", "demosaic", "demosaic_methods", "dop", "read_depth_map",
           "read_normal_map", "read_stokes", "stereo", "stereo_options", "write_depth_map", "write_normal_map",
           "write_stokes"]


class Stokes(NamedTuple):
    """Linear polarization: float32 arrays. noise: standard deviation of one sample; infinite where invalid.
    s0_noise: S0's noise over it; independence of neighbouring pixels, 1 if they share no samples."""
    s0: np.ndarray
    s1: np.ndarray
    s2: np.ndarray
    noise: np.ndarray
    s0_noise: float = 1.0
    independence: float = 1.0

    @property
    def aop(self):
        """Angle of polarization in [0, pi)."""
        return aop(self.s1, self.s2)

    @property
    def dop(self):
        """Degree of polarization, 0 where S0 <= 0."""
        return dop(self.s0, self.s1, self.s2)


def demosaic(counts, layout, *, bits=None, black=0, white=0, dn_per_e=0, read_noise_e=0, method="eari"):
    """Stokes of a raw mosaic.

    layout: angles of the 2x2 cell from the top-left pixel, "90 45 / 135 0"; colour: "90 45 / 135 0 rggb".
    bits: of a sample; taken to be 8 for uint8 arrays. black, white: counts without light and of full scale (0: the
    end of the bits). dn_per_e, read_noise_e: for the noise; 0: it is estimated. method: see demosaic_methods()."""
    counts = np.asarray(counts)
    if bits is None:
        if counts.dtype != np.uint8:
            raise Error("say how many bits a sample has (bits=12)")
        bits = 8
    return Stokes(*_polarscan.demosaic(counts, layout, bits, black, white, dn_per_e, read_noise_e, method))


def read_stokes(path):
    """Stokes of a file that polarscan demosaic wrote (VIEWS/NAME.tif)."""
    return Stokes(*_polarscan.read_stokes(path))


def write_stokes(path, stokes):
    _polarscan.write_stokes(path, *stokes)


class View(NamedTuple):
    """One view for stereo(). light: Stokes, or an array of S0 for pictures without polarization.
    K: camera matrix in pixels, no skew. cam_from_world: 3x4 or 4x4, camera axes x right, y down, z forward.
    depth_range: nearest and farthest z of what is seen, in world units. mask: not 0 where the object is."""
    light: Union[Stokes, np.ndarray]
    K: np.ndarray
    cam_from_world: np.ndarray
    depth_range: Tuple[float, float]
    mask: Optional[np.ndarray] = None


class Maps(NamedTuple):
    """depth: z in the camera frame, 0 where there is none. normal: unit, camera frame, height x width x 3."""
    depth: np.ndarray
    normal: np.ndarray


def _row(view):
    light = view.light
    if not isinstance(light, Stokes):
        light = np.asarray(light, np.float32)
        light = Stokes(light, *[np.zeros_like(light)] * 3)
    pose = np.asarray(view.cam_from_world, float)[:3]
    mask = None if view.mask is None else (np.asarray(view.mask) != 0) * np.uint8(255)
    return (*light, mask, np.asarray(view.K, float), pose, tuple(map(float, view.depth_range)))


def stereo(views, *, threads=0, folder=None, **options):
    """Depth and normal maps of all views by PolarPMS: a list of Maps in the order of the views.

    options: those of `polarscan stereo --help-all`, with underscores (preset="fast", masks=False, seed=2); their defaults:
    stereo_options(). threads 0: one a processor. folder: keeps the workspace (docs/scan.md, dense/) there, and a call
    with the same views and options goes on in it; otherwise it is temporary."""
    if folder is None:
        with tempfile.TemporaryDirectory(prefix="polarscan-") as temporary:
            return stereo(views, threads=threads, folder=temporary, **options)
    views, folder = list(views), Path(folder)
    if not views:
        raise Error("there are no views")
    _polarscan.write_arrays(folder, [_row(view) for view in views],
                            any(isinstance(view.light, Stokes) for view in views))
    _polarscan.estimate_depths(folder, options, threads)
    maps = folder / "stereo"
    names = [f"{number:06d}.png.geometric.bin" for number in range(len(views))]
    return [Maps(read_depth_map(maps / "depth_maps" / name), read_normal_map(maps / "normal_maps" / name))
            for name in names]
