# SPDX-License-Identifier: Apache-2.0
"""Points on a surface, and distances to it."""
import numpy as np

NEAREST = 8
POINTS_AT_A_TIME = 100000


def sample(mesh, count, rng):
    """`count` points (n, 3) uniform by area, the triangle of each, and the mesh's area."""
    a, b, c = mesh.corners()
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    triangle = np.searchsorted(np.cumsum(area), rng.random(count) * area.sum()).clip(max=len(area) - 1)
    u, v = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]  # Osada et al. 2002, eq. (1)
    a, b, c = mesh.corners(triangle)
    return (1 - u) * a + u * (1 - v) * b + u * v * c, triangle, area.sum()


def face_normals(mesh, triangle):
    """Unit normals of triangles, anticlockwise from outside; 0 of those without an area."""
    a, b, c = mesh.corners(triangle)
    normal = np.cross(b - a, c - a)
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)


def to_segment(points, a, b):
    """Distance of each point to its segment from a to b."""
    along = b - a
    t = ((points - a) * along).sum(1) / np.maximum((along * along).sum(1), 1e-300)
    return np.linalg.norm(points - a - t.clip(0, 1)[:, None] * along, axis=1)


def to_triangle(points, a, b, c):
    """Distance of each point to its triangle: to the plane where its foot lies inside, else to the nearest edge."""
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    edges = ((a, b), (b, c), (c, a))
    inside = np.all([(np.cross(q - p, points - p) * normal).sum(1) >= 0 for p, q in edges], 0) & (length > 0)
    plane = np.abs(((points - a) * normal).sum(1)) / np.maximum(length, 1e-300)
    return np.where(inside, plane, np.min([to_segment(points, p, q) for p, q in edges], 0))


def to_surface(points, mesh, *anchors):
    """Distance of points (n, 3) to the nearest of the triangles that hold their nearest anchors: never less than that to the
    mesh, and nearly always equal. anchors: (k-d tree of points on the mesh, their triangles); samples find large triangles,
    centroids small ones."""
    distance = np.full(len(points), np.inf)
    for begin in range(0, len(points), POINTS_AT_A_TIME):
        part = slice(begin, begin + POINTS_AT_A_TIME)
        for tree, triangle in anchors:
            near = triangle[tree.query(points[part], min(NEAREST, tree.n))[1].reshape(len(points[part]), -1)]
            for k in range(near.shape[1]):
                distance[part] = np.minimum(distance[part], to_triangle(points[part], *mesh.corners(near[:, k])))
    return distance
