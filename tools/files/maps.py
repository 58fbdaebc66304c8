# SPDX-License-Identifier: Apache-2.0
"""COLMAP's depth and normal maps (NAME.bin): `width&height&channels&`, then float32 planes, little-endian."""
import pathlib

import numpy as np


def read_map(path):
    """(height, width), or (height, width, 3) of a normal map."""
    width, height, channels, body = pathlib.Path(path).read_bytes().split(b'&', 3)
    planes = np.frombuffer(body, '<f4').reshape(int(channels), int(height), int(width))
    return planes[0] if len(planes) == 1 else np.moveaxis(planes, 0, -1)


def write_map(path, values):
    """The reverse of read_map."""
    planes = np.atleast_3d(np.asarray(values, '<f4')).transpose(2, 0, 1)
    path = pathlib.Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(b'%d&%d&%d&' % (planes.shape[2], planes.shape[1], planes.shape[0]) + planes.tobytes())
