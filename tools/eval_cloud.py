#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Accuracy and completeness of a cloud against a mesh; prints JSON. Shares nothing with `polarscan evaluate`, and so is a
test of it.

    tools/eval_cloud.py CLOUD.ply MESH [--exact] [--cap 0.1] [--threshold 0.005 0.01] [--samples 500000] [--seed 1]
                        [--visible-from SPARSE] [--min-views 2] [--out FILE]

The mesh (PLY or OBJ) is sampled uniformly by area. accuracy: distance of each point of the cloud to the nearest sample, or
with --exact to the surface; completeness: distance of each sample to the nearest point of the cloud. Distances are in the
mesh's unit. Without --exact the accuracy of a perfect cloud is about half of `sample_spacing`, not 0.
precision, recall: shares of points, and of samples, within a threshold; F: their harmonic mean.
--cap: distances above it count as it in the means, so that a few strays or one large hole do not rule them.
--visible-from: only samples that at least --min-views cameras of that text model of COLMAP see (in the picture, from the
front, nothing between) count for completeness. Accuracy is to the whole mesh.
Needs numpy and scipy.
"""
import argparse
import json
import pathlib

import numpy as np
from scipy.spatial import cKDTree

from files.meshes import read_mesh, read_points
from files.model import read_model
from truth.distance import face_normals, sample, to_surface
from truth.first_hit import visible

LIFT = 1e-4  # of the mesh's longest side: by how much a sample is lifted before the mesh may hide it


def summary(distance, cap):
    capped = np.minimum(distance, cap) if cap else distance
    return {'mean': float(capped.mean()), 'median': float(np.median(distance)),
            'rms': float(np.sqrt((capped ** 2).mean())), 'p90': float(np.percentile(distance, 90))}


def within(accuracy, completeness, threshold):
    precision, recall = float((accuracy < threshold).mean()), float((completeness < threshold).mean())
    both = precision + recall
    return {'precision': precision, 'recall': recall, 'F': 2 * precision * recall / both if both else 0.0}


def seen_by(views, mesh, points, triangle):
    """In how many views each of the points on the mesh is visible."""
    normals = face_normals(mesh, triangle)
    lift = LIFT * np.ptp(mesh.vertices, axis=0).max()
    return sum((visible(view, mesh, points, normals, lift).astype(int) for view in views), np.zeros(len(points), int))


def finite_points(path):
    points = read_points(path)
    points = points[np.isfinite(points).all(1)]
    if not len(points):
        raise SystemExit(f'{path}: no points')
    return points


def exact(points, mesh, tree, triangle):
    centroids = np.mean(mesh.corners(), axis=0)
    return to_surface(points, mesh, (tree, triangle), (cKDTree(centroids), np.arange(len(centroids))))


def evaluate(args):
    mesh, points = read_mesh(args.mesh), finite_points(args.cloud)
    samples, triangle, area = sample(mesh, args.samples, np.random.default_rng(args.seed))
    tree = cKDTree(samples)
    accuracy = exact(points, mesh, tree, triangle) if args.exact else tree.query(points)[0]
    report = {'cloud': str(args.cloud), 'mesh': str(args.mesh), 'points': len(points), 'samples': len(samples),
              'area': float(area), 'sample_spacing': float(np.sqrt(area / len(samples))), 'cap': args.cap,
              'accuracy_to': 'triangles' if args.exact else 'samples'}
    if args.visible_from:
        counted = seen_by(read_model(args.visible_from), mesh, samples, triangle) >= args.min_views
        if not counted.any():
            raise SystemExit(f'{args.visible_from}: no part of the mesh is seen by {args.min_views} views')
        report['visible_share'] = float(counted.mean())
        samples = samples[counted]
    completeness = cKDTree(points).query(samples)[0]
    return report | {'accuracy': summary(accuracy, args.cap), 'completeness': summary(completeness, args.cap),
                     'thresholds': {f'{t:g}': within(accuracy, completeness, t) for t in args.threshold}}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('cloud', type=pathlib.Path)
    parser.add_argument('mesh', type=pathlib.Path)
    parser.add_argument('--threshold', type=float, nargs='+', default=[0.001, 0.002, 0.005, 0.01, 0.02])
    parser.add_argument('--samples', type=int, default=500000)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--cap', type=float, default=0)
    parser.add_argument('--exact', action='store_true')
    parser.add_argument('--visible-from', type=pathlib.Path, metavar='SPARSE')
    parser.add_argument('--min-views', type=int, default=2)
    parser.add_argument('--out', type=pathlib.Path)
    args = parser.parse_args()
    text = json.dumps(evaluate(args), indent=1)
    print(text)
    if args.out:
        args.out.write_text(text + '\n')


if __name__ == '__main__':
    main()
