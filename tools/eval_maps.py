#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Errors of COLMAP's depth and normal maps against a mesh; prints JSON. Shares nothing with `polarscan evaluate`, and so is
a test of it.

    tools/eval_maps.py WORKSPACE SPARSE MESH [--kind geometric] [--masks FOLDER] [--pixel-centre 0.5] [--out FILE]
                       [--depth-penalty 0.05] [--normal-penalty 90] [--depth-thresholds ...] [--normal-thresholds ...]

WORKSPACE: holds stereo/depth_maps/NAME.KIND.bin and, if there are normals, stereo/normal_maps/NAME.KIND.bin; of a scan
its folder dense/. SPARSE: a text model of COLMAP with the views' true poses, in the frame of MESH (PLY or OBJ).
Truth of a pixel: the first hit of the ray through its centre: its z-depth, and the interpolated vertex normal in the
camera's frame, towards the camera. Object pixels: those whose ray hits the mesh (and that the masks keep, if given).
Depths are in the mesh's unit, normals in degrees. Each over the object pixels with an estimate and, as `over_all`, over
all of them: one without an estimate counts as the penalty, and no error counts as more. `beyond`: share of the estimates
that lie off the object. `mean`: means over the views.
--pixel-centre 0: for maps whose pixel (0, 0) looks through the model's point (0, 0) instead of (0.5, 0.5).
Needs numpy, and Pillow for --masks.
"""
import argparse
import json
import pathlib

import numpy as np

from files.maps import read_map
from files.meshes import read_mesh
from files.model import read_model
from truth.first_hit import true_maps, true_normals


def statistics(error, total, penalty, thresholds):
    """Of the errors of those of `total` object pixels that have an estimate; None if there is no object pixel."""
    if not total:
        return None
    everything = np.full(total, float(penalty))
    everything[:len(error)] = np.minimum(error, penalty)
    within = {f'{t:g}': int((error < t).sum()) for t in thresholds}
    over_all = {'mean': everything.mean(), 'median': np.median(everything),
                'within': {t: n / total for t, n in within.items()}}
    some = len(error) > 0
    return {'mean': error.mean() if some else None, 'median': np.median(error) if some else None, 'over_all': over_all,
            'within': {t: n / len(error) for t, n in within.items()} if some else {}}


def angles(normals, true):
    """Degrees between normals of any length and unit normals (n, 3), exact for small ones too (Kahan); those without a
    direction are left out."""
    length = np.linalg.norm(normals, axis=1)
    ok = np.isfinite(length) & (length > 1e-6)
    n, t = normals[ok] / length[ok, None], true[ok]
    return np.degrees(2 * np.arctan2(np.linalg.norm(n - t, axis=1), np.linalg.norm(n + t, axis=1)))


def compare(view, mesh, depth, normals, args):
    """The report of one view. depth: (height, width), normals: (height, width, 3) or None."""
    view = view.resized(depth.shape[1], depth.shape[0])
    true_depth, hit = true_maps(view, mesh, args.pixel_centre)
    target, estimated = true_depth > 0, np.isfinite(depth) & (depth > 0)
    if args.masks:
        from files.pictures import read_mask
        target &= read_mask(args.masks, view.name, view.width, view.height)
    both, total = target & estimated, int(target.sum())
    report = {'object_pixels': total, 'completeness': both.sum() / max(total, 1),
              'beyond': (estimated & ~target).sum() / max(estimated.sum(), 1),
              'depth': statistics(np.abs(depth - true_depth)[both], total, args.depth_penalty, args.depth_thresholds)}
    if normals is not None:
        error = angles(normals[both].astype(float), true_normals(view, mesh, hit, args.pixel_centre)[both])
        report['normal_degrees'] = statistics(error, total, args.normal_penalty, args.normal_thresholds)
    return report


def mean(reports):
    """Means over the views, number by number, of those views that have it."""
    if not isinstance(reports[0], dict):
        return float(np.mean(reports))
    keys = dict.fromkeys(k for r in reports for k in r)
    present = {k: [r[k] for r in reports if r.get(k) is not None] for k in keys}
    return {k: mean(values) for k, values in present.items() if values}


def rounded(value, digits=7):
    if isinstance(value, dict):
        return {k: rounded(v, digits) for k, v in value.items()}
    return round(float(value), digits) if isinstance(value, (float, np.floating)) else value


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('workspace', type=pathlib.Path)
    parser.add_argument('sparse', type=pathlib.Path)
    parser.add_argument('mesh', type=pathlib.Path)
    parser.add_argument('--kind', default='geometric')
    parser.add_argument('--pixel-centre', type=float, default=0.5)
    parser.add_argument('--masks', type=pathlib.Path)
    parser.add_argument('--depth-penalty', type=float, default=0.05)
    parser.add_argument('--normal-penalty', type=float, default=90)
    parser.add_argument('--depth-thresholds', type=float, nargs='+', default=[0.001, 0.002, 0.005, 0.01, 0.02])
    parser.add_argument('--normal-thresholds', type=float, nargs='+', default=[2.5, 5, 10, 15, 20, 30])
    parser.add_argument('--out', type=pathlib.Path)
    return parser.parse_args()


def main():
    args = arguments()
    mesh, reports = read_mesh(args.mesh), {}
    for view in read_model(args.sparse):
        depth, normals = (args.workspace / f'stereo/{kind}_maps/{view.name}.{args.kind}.bin' for kind in ('depth', 'normal'))
        if depth.exists():
            reports[view.name] = compare(view, mesh, read_map(depth), read_map(normals) if normals.exists() else None, args)
    if not reports:
        raise SystemExit(f'{args.workspace}/stereo: no map of kind {args.kind} of a view in {args.sparse}')
    report = {'views': len(reports), 'pixel_centre': args.pixel_centre, 'depth_penalty': args.depth_penalty,
              'normal_penalty': args.normal_penalty, 'mean': mean(list(reports.values())), 'per_view': reports}
    text = json.dumps(rounded(report), indent=1)
    print(text)
    if args.out:
        args.out.write_text(text + '\n')


if __name__ == '__main__':
    main()
