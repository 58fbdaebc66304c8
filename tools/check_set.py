#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds a set of tools/render_polar.py against its own truth: poses, mesh and masks, and what the angles of polarization
should be. Uses nothing of the renderer, so that a wrong convention shows.

    tools/check_set.py SET

Rays from the true poses into truth/mesh.ply give the object's pixels and their normals. Prints JSON: the share of these
pixels with a degree of polarization (DoP) over 0.05, and of those the angle between AoP and the normal's azimuth: its
median modulo 90 degrees, absolute and signed, and as it would be if AoP ran clockwise; the shares of diffuse (AoP =
azimuth) and specular reflection (azimuth + 90 degrees); intersection over union of the masks. A right set has a signed
median near 0 and an absolute one far under the mirrored one, which is near 22.5. docs/conventions.md: what azimuth means
in perspective.
Needs numpy and Pillow.
"""
import argparse
import json
import pathlib

import numpy as np

from files.meshes import read_mesh
from files.model import read_model
from files.pictures import read_grey, read_mask
from render.stokes import ANGLES, of_angles, of_raw_frame
from truth.first_hit import NONE, object_hits, true_normals

LEAST_DOP = 0.05


def azimuth(view, normals):
    """Degrees, anticlockwise as displayed from the picture's x axis, of normals (h, w, 3) in the camera's frame."""
    rays = view.rays(view.pixel_grid())
    flat = normals[..., :2] - normals[..., 2:] * rays[..., :2]
    return np.degrees(np.arctan2(-flat[..., 1], flat[..., 0]))


def folded(degrees, period):
    """The same angle modulo `period`, in [-period / 2, period / 2)."""
    return (degrees + period / 2) % period - period / 2


def stokes_of(folder, view):
    """Stokes image of a view and the view at its size: that of the pictures, or half of a mosaic's."""
    if not (folder / 'mosaic').exists():
        return of_angles({a: read_grey(folder / f'I-{a:02d}' / view.name) / 65535 for a in ANGLES}), view
    return of_raw_frame(read_grey(folder / 'mosaic' / view.name)), view.resized(view.width // 2, view.height // 2)


def check_view(folder, view, mesh, table):
    """DoP of the object's pixels, AoP - azimuth and AoP + azimuth of the polarized ones (degrees), the masks' overlap."""
    stokes, view = stokes_of(folder, view)
    hit = object_hits(view, mesh, table)
    seen = hit != NONE
    towards = azimuth(view, true_normals(view, mesh, hit))[seen]
    s0, s1, s2 = stokes[:, seen]
    dop, aop = np.hypot(s1, s2) / np.maximum(s0, 1e-6), np.degrees(np.arctan2(s2, s1)) / 2
    overlap = None
    if (folder / 'masks').exists():
        mask = read_mask(folder / 'masks', view.name, view.width, view.height)
        overlap = (mask & seen).sum() / max((mask | seen).sum(), 1)
    polarized = dop > LEAST_DOP
    return dop, (aop - towards)[polarized], (aop + towards)[polarized], overlap


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('set', type=pathlib.Path)
    folder = parser.parse_args().set
    truth = folder / 'truth'
    views = read_model(truth / 'sparse' if (truth / 'sparse').exists() else folder / 'sparse')
    table = read_mesh(truth / 'table.ply') if (truth / 'table.ply').exists() else None
    mesh = read_mesh(truth / 'mesh.ply')
    checked = [check_view(folder, view, mesh, table) for view in views]
    dop, difference, mirrored = (np.concatenate([c[k] for c in checked]) for k in range(3))
    overlaps = [c[3] for c in checked if c[3] is not None]
    off = folded(difference, 90)
    diffuse = float((np.abs(folded(difference, 180)) < 45).mean())
    report = {'views': len(views), 'object_pixels': len(dop), 'dop_median': np.median(dop), 'polarized': len(off) / len(dop),
              'aop_off_azimuth_deg': np.median(np.abs(off)), 'signed_deg': np.median(off),
              'mirrored_deg': np.median(np.abs(folded(mirrored, 90))), 'within_10_deg': (np.abs(off) < 10).mean(),
              'diffuse': diffuse, 'specular': 1 - diffuse, 'least_mask_overlap': min(overlaps, default=None)}
    rounded = lambda v: round(float(v), 4) if isinstance(v, (float, np.floating)) else v
    print(json.dumps({k: rounded(v) for k, v in report.items()}, indent=1))


if __name__ == '__main__':
    main()
