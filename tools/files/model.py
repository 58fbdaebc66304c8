# SPDX-License-Identifier: Apache-2.0
"""Cameras and poses as COLMAP's text models (cameras.txt, images.txt). Camera axes x right, y down, z forward; pixel
coordinates are continuous, the centre of the top-left pixel is (0.5, 0.5)."""
import dataclasses
import pathlib

import numpy as np


@dataclasses.dataclass
class View:
    """A pinhole picture. focal, centre: (x, y) in pixels; x_camera = rotation x_world + translation."""
    name: str
    width: int
    height: int
    focal: np.ndarray
    centre: np.ndarray
    rotation: np.ndarray
    translation: np.ndarray

    def position(self):
        """The camera's centre in the world's frame."""
        return -self.rotation.T @ self.translation

    def to_camera(self, points):
        return points @ self.rotation.T + self.translation

    def to_pixels(self, in_camera):
        """Pixel coordinates (n, 2) of points in the camera's frame."""
        with np.errstate(divide='ignore', invalid='ignore'):
            return in_camera[:, :2] / in_camera[:, 2:] * self.focal + self.centre

    def rays(self, pixels):
        """Directions in the camera's frame with z = 1 through pixel coordinates (..., 2)."""
        xy = (pixels - self.centre) / self.focal
        return np.concatenate([xy, np.ones_like(xy[..., :1])], -1)

    def resized(self, width, height):
        """The same view in another number of pixels."""
        scale = np.array([width / self.width, height / self.height])
        return dataclasses.replace(self, width=width, height=height, focal=self.focal * scale, centre=self.centre * scale)

    def pixel_grid(self, offset=0.5):
        """(height, width, 2) coordinates of all pixels' centres: column + offset, row + offset."""
        return np.stack(np.meshgrid(np.arange(self.width) + offset, np.arange(self.height) + offset), -1)


def rotation_of(quaternion):
    """The rotation matrix of a quaternion (w, x, y, z)."""
    w, x, y, z = np.asarray(quaternion, float) / np.linalg.norm(quaternion)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def quaternion_of(rotation):
    """The quaternion (w, x, y, z), w >= 0: the eigenvector of the largest eigenvalue of Bar-Itzhack's matrix (2000)."""
    r, trace = rotation, np.trace(rotation)
    k = np.empty((4, 4))
    k[0, 0] = trace
    k[0, 1:] = k[1:, 0] = r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]
    k[1:, 1:] = r + r.T - trace * np.eye(3)
    q = np.linalg.eigh(k)[1][:, 3]
    return q if q[0] >= 0 else -q


def _lines(path):
    return [line.split() for line in path.read_text().splitlines() if not line.startswith('#')]


def _intrinsics(words, path):
    """Width, height, focal lengths and principal point of a line of cameras.txt."""
    values = [float(w) for w in words[4:]]
    if words[1] == 'SIMPLE_PINHOLE':
        values.insert(0, values[0])
    elif words[1] != 'PINHOLE':
        raise SystemExit(f'{path}: a camera of model {words[1]}; these tools take PINHOLE: undistort first')
    return int(words[2]), int(words[3]), np.array(values[:2]), np.array(values[2:4])


def read_model(folder):
    """All views of a text model, in the order of their names."""
    folder = pathlib.Path(folder)
    cameras = {w[0]: _intrinsics(w, folder) for w in _lines(folder / 'cameras.txt') if w}
    images = [w for w in _lines(folder / 'images.txt')][::2]  # every second line holds an image's points
    views = [View(w[9], *cameras[w[8]], rotation_of(np.array(w[1:5], float)), np.array(w[5:8], float))
             for w in images if len(w) == 10]
    return sorted(views, key=lambda view: view.name)


def write_model(folder, views):
    """A text model without points, one PINHOLE camera for all views."""
    folder.mkdir(parents=True, exist_ok=True)
    first = views[0]
    numbers = lambda values, digits: ' '.join(f'{v:.{digits}g}' for v in values)
    (folder / 'cameras.txt').write_text(
        '# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy\n'
        f'1 PINHOLE {first.width} {first.height} {numbers([*first.focal, *first.centre], 12)}\n')
    (folder / 'images.txt').write_text('# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n' + ''.join(
        f'{i} {numbers([*quaternion_of(v.rotation), *v.translation], 12)} 1 {v.name}\n\n' for i, v in enumerate(views, 1)))
    (folder / 'points3D.txt').write_text('')
