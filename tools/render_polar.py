#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Renders a polarimetric set of pictures with exact truth, by Mitsuba 3: a renderer that shares nothing with polarscan.

    tools/render_polar.py MESH OUT [options]          MESH: PLY or OBJ

An object of polarized plastic or metal in the unit sphere, y up, under unpolarized light, seen by cameras on rings.
    --format angles   I-00 I-45 I-90 I-135 (16 bits, linear), masks/, sparse/ (true poses), truth/mesh.ply
    --format mosaic   mosaic/ (12-bit counts, cells 90 45 / 135 0, shot and read noise), truth/ (poses, masks, meshes)
Both: set.json, which says all options, the scale from radiance, and what noise is left. tools/check_set.py OUT holds the set
against its own truth. docs/datasets.md: the commands of the sets that figures were measured on.

The Monte Carlo noise is common to the four pictures of a view, which come from one Stokes image: I0 + I90 = I45 + I135.
The same options and versions of Mitsuba and LLVM give the same pictures to the rounding of float32.
Needs numpy, Pillow and mitsuba (pip) and LLVM 19 (Debian: libllvm19); for --table also opencv-python-headless.
"""
import argparse
import json
import pathlib
import sys
import time

import numpy as np

from files.meshes import read_mesh, write_mesh
from files.model import write_model
from files.pictures import write_png
from render.cameras import unit_object, views_around
from render.stokes import ANGLES, SENSOR, behind_polarizer, raw_frame
from truth.first_hit import NONE, object_hits

CLIPPED = 0.005  # share of the object's pixels that clip in their brightest picture


def arguments():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument('mesh', type=pathlib.Path)
    p.add_argument('out', type=pathlib.Path)
    p.add_argument('--format', default='angles', choices=['angles', 'mosaic'])
    p.add_argument('--up', default='y', choices=['y', 'z'], help="the mesh's axis that points up")
    p.add_argument('--rings', default='-5:12,20:12,50:12', help='elevation in degrees:views,...')
    p.add_argument('--width', type=int, default=800, help='pixels')
    p.add_argument('--height', type=int, default=600, help='pixels')
    p.add_argument('--fov', type=float, default=35, help='horizontal, degrees')
    p.add_argument('--fill', type=float, default=0.93, help='share of the half picture that the object reaches')
    p.add_argument('--jitter', type=float, default=2, help='of the cameras, degrees')
    p.add_argument('--texture', default='weak', choices=['none', 'weak', 'strong'])
    p.add_argument('--light', default='indoor', choices=['indoor', 'overcast', 'studio'])
    p.add_argument('--table', default='none', choices=['none', 'matte', 'glossy'], help='a printed table under the object')
    p.add_argument('--material', default='plastic', choices=['plastic', 'metal'])
    p.add_argument('--albedo', type=float, default=0.45, help='mean; the texture scales along')
    p.add_argument('--alpha', type=float, default=0.18, help='roughness')
    p.add_argument('--ior', type=float, default=1.5, help='index of plastic')
    p.add_argument('--eta', type=float, default=1.4, help='real part of the index of metal')
    p.add_argument('--kappa', type=float, default=4.5, help='imaginary part of the index of metal')
    p.add_argument('--turntable', action='store_true', help='the light turns with the camera')
    p.add_argument('--spp', type=int, default=64, help='samples a pixel and pass')
    p.add_argument('--passes', type=int, default=2, help='an even number')
    p.add_argument('--clean', default='all', choices=['all', 's0', 'none'], help='what is denoised (render/denoise.py)')
    p.add_argument('--radius', type=int, default=4, help="of denoising's window, pixels")
    p.add_argument('--seed', type=int, default=1)
    p.add_argument('--only', type=int, default=1, metavar='N', help='a trial: every Nth view')
    p.add_argument('--threads', type=int, default=0, help='0: as many as cores')
    args = p.parse_args()
    if args.passes < 2 or args.passes % 2:
        p.error('--passes: an even number, for the noise is the difference of two halves')
    return args


class Noise:
    """Sums of squares over the pixels that the object fills."""

    def __init__(self):
        self.squares, self.pixels = {}, 0

    def add(self, after, before, cover):
        whole = cover > 0.999
        self.pixels += int(whole.sum())
        pictures = {'I0': behind_polarizer(after, 0), 'I45': behind_polarizer(after, 45), 'half_S0': after[0] / 2,
                    'S1': after[1], 'S2': after[2], 'half_S0_unfiltered': before[0] / 2, 'S1_unfiltered': before[1]}
        for name, values in pictures.items():
            self.squares[name] = self.squares.get(name, 0) + float((values[whole] ** 2).sum())

    def rms(self, scale):
        return {name: round(scale * (total / max(self.pixels, 1)) ** 0.5, 5) for name, total in self.squares.items()}


def render(args, mesh, views):
    """[(view, Stokes image in radiance, coverage)] and the noise of all."""
    from render import scene  # after the options are known to be right: it takes seconds to load
    if args.threads:
        scene.set_threads(args.threads)
    pair, noise, made, begin = scene.scenes(args, mesh), Noise(), [], time.monotonic()
    for index in range(0, len(views), args.only):
        stokes, after, before, cover = scene.render_view(pair, args, views[index], index)
        noise.add(after, before, cover)
        made.append((views[index], stokes.astype(np.float32), cover))
        print(f'{views[index].name}: {time.monotonic() - begin:.0f} s', file=sys.stderr, flush=True)
    return made, noise, scene.renderer()


def brightness_scale(made):
    """What radiance is multiplied by to be a share of full scale, one for the whole set."""
    bright = [np.max([behind_polarizer(stokes, a) for a in ANGLES], 0)[cover > 0.5] for _, stokes, cover in made]
    return 1 / float(np.quantile(np.concatenate(bright), 1 - CLIPPED))


def write_pictures(args, made, scale):
    rng = np.random.default_rng([args.seed, 99])
    for view, stokes, _ in made:
        if args.format == 'mosaic':
            write_png(args.out / 'mosaic' / view.name, raw_frame(stokes * scale, rng))
            continue
        for a in ANGLES:
            light = 65535 * scale * behind_polarizer(stokes, a)
            write_png(args.out / f'I-{a:02d}' / view.name, light.round().clip(0, 65535).astype(np.uint16))


def write_truth(args, mesh, made):
    """Mesh, table, poses and masks; what a real recording would not have lies in truth/."""
    beside = args.out / 'truth' if args.format == 'mosaic' else args.out
    write_mesh(args.out / 'truth/mesh.ply', mesh)
    write_model(beside / 'sparse', [view for view, _, _ in made])
    table = None
    if args.table != 'none':
        from render.scene import table_mesh
        table = table_mesh(mesh.vertices)
        write_mesh(args.out / 'truth/table.ply', table)
    for view, _, cover in made:
        mask = cover > 0.5 if table is None else object_hits(view, mesh, table) != NONE
        write_png(beside / 'masks' / view.name, np.where(mask, 255, 0).astype(np.uint8))


def write_description(args, views, scale, noise, renderer):
    options = {k: v for k, v in vars(args).items() if k not in ('only', 'threads', 'out')}
    description = {**options, 'mesh': args.mesh.name, 'views': len(views), 'distance': float(views[0].translation[2]),
                   'scale': scale, 'renderer': renderer, 'noise_rms_of_full_scale': noise.rms(scale)}
    if args.format == 'mosaic':
        description['sensor'] = {**SENSOR, 'layout': '90 45 / 135 0', 'bits': 12}
    (args.out / 'set.json').write_text(json.dumps(description, indent=1) + '\n')
    print(json.dumps({k: description[k] for k in ('views', 'distance', 'scale', 'noise_rms_of_full_scale')}))


def main():
    args = arguments()
    mesh = unit_object(read_mesh(args.mesh), args.up)
    views = views_around(mesh.vertices, args, np.random.default_rng(args.seed))
    made, noise, renderer = render(args, mesh, views)
    scale = brightness_scale(made)
    write_truth(args, mesh, made)
    write_pictures(args, made, scale)
    write_description(args, [view for view, _, _ in made], scale, noise, renderer)


if __name__ == '__main__':
    main()
