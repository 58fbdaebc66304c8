# SPDX-License-Identifier: Apache-2.0
"""Takes Monte Carlo noise out of a rendering by what is known without noise: normals, positions and albedo.

First-order regression (Bitterli et al. 2016, "Nonlinearly weighted first-order regression for denoising Monte Carlo
renderings"): a pixel becomes the value at its centre of a weighted least-squares fit over its window, linear in the offset,
the normal and the albedo. Neighbours on another surface, across a step or with another normal weigh nothing. The result is
linear in the picture, so the half difference of two renderings, filtered alike, is the noise that remains.
"""
import numpy as np

NORMAL_SPREAD = 0.08  # differences of unit normals beyond three of it weigh nothing
STEP_PX = 3.0         # nor do points farther off the tangent plane than this many pixels
RIDGE = 0.002         # share of the weights, for windows that are flat or untextured
LEAST_WEIGHT = 3.0    # with less, there is hardly a neighbour: the pixel stays as rendered
PIXELS_AT_A_TIME = 200000


class Features:
    """Of each pixel, without noise: normal (h, w, 3), position (h, w, 3) in the world, albedo (h, w), and which pixels one
    surface fills (h, w)."""

    def __init__(self, normal, position, albedo, whole):
        self.normal, self.position, self.albedo, self.whole = normal, position, albedo, whole

    def pair(self, here, there, pixel_size):
        """Weights (n) of the pixels `there` in the fits of the pixels `here` (flat indices), and differences of normals
        and albedo (n, 4). pixel_size: of a pixel on the surface, in the world's unit."""
        flat = lambda values: values.reshape(-1, values.shape[2])
        normal, position = flat(self.normal), flat(self.position)
        turn = normal[there] - normal[here]
        off_plane = ((position[there] - position[here]) * (normal[there] + normal[here])).sum(1) / 2
        q = (turn ** 2).sum(1) / (3 * NORMAL_SPREAD) ** 2 + (off_plane / (STEP_PX * pixel_size)) ** 2
        weight = np.where(self.whole.ravel()[there] & (q < 1), (1 - q) ** 2, 0)
        albedo = self.albedo.ravel()[there] - self.albedo.ravel()[here]
        return weight, np.column_stack([turn / NORMAL_SPREAD, 10 * albedo])


def neighbours(here, shape, radius):
    """For each offset in the window: (dx, dy, which of `here` have that neighbour, its flat index)."""
    row, column = np.divmod(here, shape[1])
    for dy, dx in np.ndindex(2 * radius + 1, 2 * radius + 1):
        y, x = row + dy - radius, column + dx - radius
        there = np.flatnonzero((y >= 0) & (y < shape[0]) & (x >= 0) & (x < shape[1]))
        yield dx - radius, dy - radius, there, (y * shape[1] + x)[there]


def fit(picture, features, here, radius, pixel_size):
    """Values (n, channels) of the fits at the pixels `here`."""
    channels = picture.reshape(-1, picture.shape[2])
    normal_matrix, right = np.zeros((len(here), 7, 7)), np.zeros((len(here), 7, channels.shape[1]))
    for dx, dy, which, there in neighbours(here, picture.shape, radius):
        weight, differences = features.pair(here[which], there, pixel_size)
        which, there, differences, weight = (v[weight > 0] for v in (which, there, differences, weight))
        offset = np.broadcast_to([1, dx / radius, dy / radius], (len(which), 3))
        regressors = np.hstack([offset, differences])
        weighted = regressors * weight[:, None]
        normal_matrix[which] += weighted[:, :, None] * regressors[:, None, :]
        right[which] += weighted[:, :, None] * channels[there][:, None, :]
    total = normal_matrix[:, 0, 0].copy()
    diagonal = np.arange(1, 7)
    normal_matrix[:, diagonal, diagonal] += RIDGE * total[:, None] + 1e-6
    enough = total >= LEAST_WEIGHT
    values = channels[here].copy()
    values[enough] = np.linalg.solve(normal_matrix[enough], right[enough])[:, 0]
    return values


def denoise(picture, features, radius, pixel_size):
    """The picture (h, w, channels), float64, all channels filtered alike; pixels that no one surface fills stay."""
    result = picture.reshape(-1, picture.shape[2]).copy()
    whole = np.flatnonzero(features.whole)
    for begin in range(0, len(whole), PIXELS_AT_A_TIME):
        here = whole[begin:begin + PIXELS_AT_A_TIME]
        result[here] = fit(picture, features, here, radius, pixel_size)
    return result.reshape(picture.shape)
