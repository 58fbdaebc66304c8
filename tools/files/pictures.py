# SPDX-License-Identifier: Apache-2.0
"""Grey pictures of 8 or 16 bits, by Pillow."""
import pathlib

import numpy as np
from PIL import Image


def read_grey(path):
    """(height, width) sample values as they are in the file; of several channels the greatest."""
    samples = np.asarray(Image.open(path))
    return samples if samples.ndim == 2 else samples.max(2)


def write_png(path, samples):
    """samples: uint8 or uint16, (height, width)."""
    path.parent.mkdir(parents=True, exist_ok=True)
    Image.fromarray(samples).save(path, compress_level=9)


def read_mask(folder, name, width, height):
    """Which pixels of the view `name` a mask in `folder` keeps; (height, width), by the nearest pixel at other sizes."""
    tried = [pathlib.Path(folder) / n for n in (f'{name}.png', f'{pathlib.Path(name).stem}.png', name)]
    path = next((p for p in tried if p.exists()), None)
    if path is None:
        raise SystemExit(f'{folder}: no mask for the view {name}')
    mask = read_grey(path)
    rows, columns = (np.arange(n) * size // n for n, size in zip((height, width), mask.shape))
    return mask[np.ix_(rows, columns)] > 0
