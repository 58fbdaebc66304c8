# SPDX-License-Identifier: Apache-2.0
"""The object's frame and the cameras around it: the object fits a sphere of radius 1 around the origin, y is up."""
import numpy as np

from files.meshes import Mesh, vertex_normals
from files.model import View

SPHERE_STEPS = 3000


def unit_object(mesh, up):
    """The mesh without unused vertices, `up` ('y' or 'z') turned to y, in the unit sphere, with smooth normals."""
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    vertices = mesh.vertices[used]
    if up == 'z':
        vertices = vertices @ np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    centre = vertices.mean(0)  # of the smallest enclosing sphere (Badoiu and Clarkson 2003)
    for step in range(2, SPHERE_STEPS + 1):
        farthest = ((vertices - centre) ** 2).sum(1).argmax()
        centre += (vertices[farthest] - centre) / step
    vertices = vertices - centre
    vertices /= np.linalg.norm(vertices, axis=1).max()
    triangles = triangles.reshape(-1, 3)
    return Mesh(vertices, triangles, vertex_normals(vertices, triangles))


def look_at_origin(elevation, azimuth, roll):
    """Rotation camera from world of a camera that looks at the origin; angles in radians, azimuth from +z toward +x."""
    forward = -np.array([np.cos(elevation) * np.sin(azimuth), np.sin(elevation), np.cos(elevation) * np.cos(azimuth)])
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    level = np.stack([right, np.cross(forward, right), forward])
    turn = np.array([[np.cos(roll), np.sin(roll), 0], [-np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    return turn @ level


def rings_of(text):
    """[(elevation in degrees, views)] of `-5:12,20:12`."""
    return [(float(e), int(n)) for e, n in (ring.split(':') for ring in text.split(','))]


def rotations(rings, jitter, rng):
    """A rotation a view; rings are turned against each other, and `jitter` degrees (uniform) added to every angle."""
    result = []
    for k, (elevation, count) in enumerate(rings):
        for i in range(count):
            e, a, roll = rng.uniform(-jitter, jitter, 3)
            azimuth = 360 * (i + k / 3) / count
            result.append(look_at_origin(*np.radians([elevation + e, azimuth + a, roll])))
    return result


def least_distance(vertices, turns, half):
    """The least distance from the origin at which all vertices are in all pictures; `half`: (x, y) of a picture's corner
    at z = 1. A vertex c in the camera's axes is in the picture if |c_xy| <= half (c_z + distance)."""
    turned = (vertices @ turn.T for turn in turns)
    return max((np.abs(c[:, :2]) / half - c[:, 2:]).max() for c in turned)


def views_around(vertices, args, rng):
    """Views from --rings, all from the one distance at which the object reaches --fill of the half picture in its widest."""
    focal = args.width / 2 / np.tan(np.radians(args.fov / 2))
    size = np.array([args.width, args.height], float)
    turns = rotations(rings_of(args.rings), args.jitter, rng)
    distance = least_distance(vertices, turns, size / 2 / focal * args.fill)
    focal, back = np.array([focal, focal]), np.array([0, 0, distance])
    return [View(f'{i:03d}.png', args.width, args.height, focal, size / 2, turn, back) for i, turn in enumerate(turns)]
