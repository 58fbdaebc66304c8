# SPDX-License-Identifier: Apache-2.0
"""Stokes images (3, height, width) in the convention of docs/conventions.md, and the sensor that sees them."""
import numpy as np

ANGLES = (0, 45, 90, 135)
CELL = ((90, 45), (135, 0))  # polarizers of a 2x2 cell, rows; Sony's layout
# A sensor of 12 bits: electrons of a full pixel, read noise in electrons, counts (DN) of no light and an electron.
SENSOR = {'full_well_e': 10500, 'read_noise_e': 2.5, 'black_dn': 60, 'dn_per_e': (4000 - 60) / 10500, 'max_dn': 4095}


def behind_polarizer(stokes, degrees):
    """Light that passes a polarizer at `degrees`: (S0 + S1 cos 2a + S2 sin 2a) / 2."""
    double = 2 * np.radians(degrees)
    return (stokes[0] + stokes[1] * np.cos(double) + stokes[2] * np.sin(double)) / 2


def of_angles(pictures):
    """Stokes image of {angle in degrees: picture}."""
    i0, i45, i90, i135 = (np.asarray(pictures[a], float) for a in ANGLES)
    return np.stack([(i0 + i45 + i90 + i135) / 2, i0 - i90, i45 - i135])


def to_lens_frame(stokes, rays):
    """From Mitsuba's reference direction to that of a lens. stokes: (3, h, w); rays: (h, w, 3), z = 1, camera's frame.

    Mitsuba's `stokes` integrator refers to cross(ray, up), in our axes (1, 0, -x); a lens carries the picture's x axis to
    the ray by the shortest rotation. Both are perpendicular to the ray; they are equal on the optical axis.
    """
    ray = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    x = ray[..., :1]
    lens = np.array([1.0, 0, 0]) - x / (1 + ray[..., 2:]) * (ray + [0, 0, 1])
    theirs = np.stack([rays[..., 2], 0 * rays[..., 1], -rays[..., 0]], -1)
    theirs /= np.linalg.norm(theirs, axis=-1, keepdims=True)
    turn = 2 * np.arctan2((lens * np.cross(ray, theirs)).sum(-1), (lens * theirs).sum(-1))
    s0, s1, s2 = stokes
    return np.stack([s0, s1 * np.cos(turn) - s2 * np.sin(turn), s2 * np.cos(turn) + s1 * np.sin(turn)])


def raw_frame(stokes, rng):
    """Counts (uint16) of the sensor behind its polarizers; a fully open pixel in light of 1 is full. Shot and read noise."""
    light = np.empty(stokes[0].shape)
    for i, j in np.ndindex(2, 2):
        light[i::2, j::2] = behind_polarizer(stokes[:, i::2, j::2], CELL[i][j])
    electrons = rng.poisson(light.clip(0) * SENSOR['full_well_e']) + rng.normal(0, SENSOR['read_noise_e'], light.shape)
    counts = SENSOR['black_dn'] + SENSOR['dn_per_e'] * electrons.clip(max=SENSOR['full_well_e'])
    return counts.round().clip(0, SENSOR['max_dn']).astype(np.uint16)


def of_raw_frame(counts):
    """Stokes image of half the size, light in full wells: each 2x2 cell is a pixel."""
    full = SENSOR['full_well_e'] * SENSOR['dn_per_e']
    cells = {CELL[i][j]: (counts[i::2, j::2] - float(SENSOR['black_dn'])) / full for i, j in np.ndindex(2, 2)}
    return of_angles(cells)
