# SPDX-License-Identifier: Apache-2.0
"""What a view sees of a mesh, exactly and in double precision, by numpy alone: rays from the camera against the triangles
whose bounding boxes in the picture they pass through."""
import numpy as np

PAIRS_AT_A_TIME = 2000000
CELLS_A_POINT = 4
NONE = -1


def expand(begin, count):
    """All of begin[k], begin[k] + 1 ... begin[k] + count[k] - 1, and which k each belongs to."""
    owner = np.repeat(np.arange(len(begin)), count)
    place = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    return np.repeat(begin, count) + place, owner


def boxes(view, corners):
    """First and last column and row, (m, 2) each, of each triangle's picture; empty (last < first) if there is none."""
    size = np.array([view.width, view.height])
    pixels = np.stack([view.to_pixels(c) for c in corners])
    in_front = np.stack([c[:, 2] > 0 for c in corners])
    low, high = pixels.min(0) - 1e-6, pixels.max(0) + 1e-6
    cut = in_front.any(0) & ~in_front.all(0)  # a triangle through the camera's plane may be anywhere
    low[cut], high[cut] = 0, size
    low[~in_front.any(0)], high[~in_front.any(0)] = 0, -1
    return np.floor(np.clip(low, 0, size)).astype(int), np.floor(np.clip(high, -1, size - 1)).astype(int)


def row_pieces(low, high, width):
    """(triangle, first cell, one past the last cell) of each row of each box; cells are numbered row by row."""
    rows = np.where((high >= low).all(1), high[:, 1] - low[:, 1] + 1, 0)
    row, triangle = expand(low[:, 1], rows)
    return triangle, row * width + low[triangle, 0], row * width + high[triangle, 0] + 1


def dot(a, b):
    return np.einsum('ij,ij->i', a, b)


class Planes:
    """Triangles, given by their corners in the camera's frame (three arrays (m, 3)), as rays from the origin meet them."""

    def __init__(self, corners):
        a, b, c = corners
        self.sides = [np.cross(p, q) for p, q in ((b, c), (c, a), (a, b))]  # normals of planes through origin and edges
        self.normal = np.cross(b - a, c - a)
        self.offset = dot(a, self.normal)

    def weights(self, rays, which):
        """Barycentric weights (3, n), not divided by their sum, of where rays (n, 3) meet the planes of triangles."""
        return np.stack([dot(rays, side[which]) for side in self.sides])

    def hits(self, rays, which):
        """z of the points where rays meet their triangles; inf if they do not. Two triangles get the same bits for their
        common edge but for the sign, so no ray slips between them."""
        w = self.weights(rays, which)
        inside = (w >= 0).all(0) | (w <= 0).all(0)
        with np.errstate(divide='ignore', invalid='ignore'):
            z = self.offset[which] / dot(rays, self.normal[which])
        return np.where(inside & (z > 0), z, np.inf)


def chunks(count):
    """(begin, end) of runs of pieces that together hold about PAIRS_AT_A_TIME pairs."""
    total = np.cumsum(count)
    ends = np.searchsorted(total, np.arange(1, count.sum() // PAIRS_AT_A_TIME + 2) * PAIRS_AT_A_TIME, 'right')
    return zip([0, *ends[:-1]], ends)


def queries_by_cell(view, pixels):
    """Indices of those pixels (n, 2) that lie in the picture, cell by cell, and where in them each cell begins."""
    cell = np.floor(pixels).astype(int)
    inside = np.flatnonzero(((cell >= 0) & (cell < [view.width, view.height])).all(1))
    number = cell[inside] @ [1, view.width]
    order = np.argsort(number, kind='stable')
    return inside[order], np.searchsorted(number[order], np.arange(view.width * view.height + 1))


def first_hits(view, mesh, pixels):
    """z-depth of the first hit of the ray through each of `pixels` (n, 2), inf if there is none, and its triangle or NONE.

    Pixels outside of the picture hit nothing. Ties go to the triangle that comes first.
    """
    corners = [view.to_camera(c) for c in mesh.corners()]
    planes, rays = Planes(corners), view.rays(pixels)
    order, start = queries_by_cell(view, pixels)
    triangle, first, last = row_pieces(*boxes(view, corners), view.width)
    begin, count = start[first], start[last] - start[first]
    depth, hit = np.full(len(pixels), np.inf), np.full(len(pixels), NONE)
    for k, end in chunks(count):
        place, piece = expand(begin[k:end], count[k:end])
        query, candidate = order[place], triangle[k:end][piece]
        keep_nearest(depth, hit, query, planes.hits(rays[query], candidate), candidate)
    return depth, hit


def keep_nearest(depth, hit, query, z, candidate):
    """Puts the nearest z of each query and its triangle into depth and hit, where it is nearer than what is there."""
    near = np.flatnonzero(z < depth[query])
    near = near[np.lexsort((candidate[near], z[near], query[near]))]
    near = near[np.r_[True, query[near][1:] != query[near][:-1]][:len(near)]]
    depth[query[near]], hit[query[near]] = z[near], candidate[near]


def true_maps(view, mesh, offset=0.5):
    """z-depth (height, width), 0 where the ray through the pixel's centre hits nothing, and the triangle hit or NONE.

    offset: the place of a pixel's centre, 0.5 in COLMAP's models (docs/conventions.md).
    """
    depth, hit = first_hits(view, mesh, view.pixel_grid(offset).reshape(-1, 2))
    return np.where(hit == NONE, 0, depth).reshape(view.height, view.width), hit.reshape(view.height, view.width)


def object_hits(view, mesh, table=None):
    """The triangle of the mesh that each pixel's centre sees, or NONE (height, width); `table` may hide it."""
    depth, hit = true_maps(view, mesh)
    if table is None:
        return hit
    before, other = true_maps(view, table)
    return np.where((other != NONE) & (before < depth), NONE, hit)


def true_normals(view, mesh, hit, offset=0.5):
    """Interpolated unit vertex normals (height, width, 3) in the camera's frame, turned to face it; 0 where hit is NONE."""
    seen = hit != NONE
    rays = view.rays(view.pixel_grid(offset))[seen]
    weights = Planes([view.to_camera(c) for c in mesh.corners(hit[seen])]).weights(rays, slice(None))
    total = weights.sum(0)
    at_corners = mesh.normals[mesh.triangles[hit[seen]]]
    normal = np.einsum('kn,nkj->nj', weights / np.where(total == 0, 1, total), at_corners) @ view.rotation.T
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    normal[dot(normal, rays) > 0] *= -1
    normals = np.zeros((*hit.shape, 3))
    normals[seen] = normal
    return normals


def visible(view, mesh, points, normals, lift):
    """Which points of the surface the view sees: in the picture, from the front, nothing between.

    lift: how far a point is moved along its normal before the mesh may hide it, in the world's unit.
    """
    in_camera = view.to_camera(points)
    pixels = view.to_pixels(in_camera)
    inside = (in_camera[:, 2] > 0) & (pixels >= 0).all(1) & (pixels < [view.width, view.height]).all(1)
    index = np.flatnonzero(inside & (dot(view.position() - points, normals) > 0))
    lifted = view.to_camera(points[index] + lift * normals[index])
    finer = max(1, round((CELLS_A_POINT * len(points) / (view.width * view.height)) ** 0.5))
    fine = view.resized(view.width * finer, view.height * finer)  # cells with few points each
    near, _ = first_hits(fine, mesh, fine.to_pixels(lifted))
    seen = np.zeros(len(points), bool)
    seen[index[near >= lifted[:, 2]]] = True
    return seen
