# SPDX-License-Identifier: Apache-2.0
"""Meshes and clouds from PLY (ascii, binary of either byte order; polygons, triangle strips) and OBJ files; PLY out."""
import dataclasses
import pathlib

import numpy as np

KINDS = {'char': 'i1', 'uchar': 'u1', 'short': 'i2', 'ushort': 'u2', 'int': 'i4', 'uint': 'u4', 'float': 'f4',
         'double': 'f8', 'int8': 'i1', 'uint8': 'u1', 'int16': 'i2', 'uint16': 'u2', 'int32': 'i4', 'uint32': 'u4',
         'float32': 'f4', 'float64': 'f8'}


@dataclasses.dataclass
class Mesh:
    """vertices (n, 3) and unit vertex normals (n, 3), float64; triangles (m, 3), int64, anticlockwise from outside."""
    vertices: np.ndarray
    triangles: np.ndarray
    normals: np.ndarray

    def corners(self, which=slice(None)):
        """The three corners of each triangle, three arrays (m, 3)."""
        return [self.vertices[self.triangles[which, k]] for k in range(3)]


def vertex_normals(vertices, triangles):
    """Mean of the normals of the triangles around each vertex, weighted by their areas."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    twice_area = np.cross(b - a, c - a)
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, triangles[:, k], twice_area)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-20)


class _Ascii:
    """The numbers of an ascii PLY's body, in their order."""

    def __init__(self, body):
        self.words, self.at = np.array(body.split(), float), 0

    def take(self, kind, count):
        self.at += count
        return self.words[self.at - count:self.at].astype(kind)

    def columns(self, layout, rows):
        width = sum(n for _, _, n in layout)
        if self.at + rows * width > len(self.words):
            return None
        table = self.words[self.at:self.at + rows * width].reshape(rows, width)
        self.at += rows * width
        ends = np.cumsum([n for _, _, n in layout])
        return {name: table[:, end - n:end].astype(kind) for (name, kind, n), end in zip(layout, ends)}


class _Binary:
    """The same of a binary PLY; `order` is '<' or '>'."""

    def __init__(self, body, order):
        self.body, self.at, self.order = body, 0, order

    def take(self, kind, count):
        values = np.frombuffer(self.body, self.order + kind, count, self.at)
        self.at += values.nbytes
        return values

    def columns(self, layout, rows):
        row = np.dtype([(name, self.order + kind, (n,)) for name, kind, n in layout])
        if self.at + rows * row.itemsize > len(self.body):
            return None
        table = np.frombuffer(self.body, row, rows, self.at)
        self.at += rows * row.itemsize
        return {name: table[name] for name, _, _ in layout}


def _element(source, rows, properties):
    """{property: (rows, k) array, or a list of arrays where rows differ}. Rows are first taken to be as long as row 0."""
    if not rows:
        return {name: np.zeros((0, 3 if counter else 1), kind) for name, kind, counter in properties}
    begin, layout = source.at, []
    for name, kind, counter in properties:
        count = int(source.take(counter, 1)[0]) if counter else 1
        source.take(kind, count)
        layout += [('# ' + name, counter, 1)] * bool(counter) + [(name, kind, count)]
    source.at = begin
    columns = source.columns(layout, rows)
    counters = [v for k, v in (columns or {}).items() if k.startswith('# ')]
    if columns is not None and all((v == v[:1]).all() for v in counters):
        return {k: v for k, v in columns.items() if not k.startswith('# ')}
    source.at, ragged = begin, {name: [] for name, _, _ in properties}
    for _ in range(rows):
        for name, kind, counter in properties:
            ragged[name].append(source.take(kind, int(source.take(counter, 1)[0]) if counter else 1))
    return ragged


def _header(stream, path):
    """The format's name and [(element, rows, [(property, kind, kind of the list's counter or None)])]."""
    if stream.readline().strip() != b'ply':
        raise SystemExit(f'{path}: not a PLY file')
    form, elements = None, []
    for line in iter(stream.readline, b''):
        words = line.decode('latin1').split() or ['comment']
        if words[0] == 'end_header':
            return form, elements
        if words[0] == 'format':
            form = words[1]
        elif words[0] == 'element':
            elements.append((words[1], int(words[2]), []))
        elif words[0] == 'property':
            counter = KINDS[words[2]] if words[1] == 'list' else None
            elements[-1][2].append((words[-1], KINDS[words[-2]], counter))
    raise SystemExit(f'{path}: the header has no end')


def read_ply(path):
    """{element: {property: (rows, k) array or list of arrays}} of everything in the file."""
    with open(path, 'rb') as stream:
        form, elements = _header(stream, path)
        body = stream.read()
    source = _Ascii(body) if form == 'ascii' else _Binary(body, '<' if 'little' in form else '>')
    return {name: _element(source, rows, properties) for name, rows, properties in elements}


def _unrolled(strip):
    """Triangles of a strip; -1 begins another, and every second triangle runs the other way round."""
    triangles = []
    for part in np.split(strip, np.flatnonzero(strip < 0)):
        part = part[part >= 0]
        both = np.stack([part[:-2], part[1:-1], part[2:]], 1)
        both[1::2] = both[1::2, ::-1]
        triangles.append(both)
    return np.concatenate(triangles)


def _triangles(ply, path):
    if not {'face', 'tristrips'} & ply.keys():
        raise SystemExit(f'{path}: holds no triangles')
    if 'tristrips' in ply:
        return np.concatenate([_unrolled(np.asarray(s, np.int64)) for s in ply['tristrips']['vertex_indices']])
    faces = next(v for k, v in ply['face'].items() if k in ('vertex_indices', 'vertex_index'))
    groups = [faces] if isinstance(faces, np.ndarray) else [f[None] for f in faces]
    fans = [g[:, [0, i, i + 1]] for g in groups for i in range(1, g.shape[1] - 1)]
    return np.concatenate(fans).astype(np.int64)


def _read_obj(path):
    """Vertices and triangles of an OBJ file: lines v and f, polygons as fans; all else is left aside."""
    vertices, triangles = [], []
    for words in map(str.split, pathlib.Path(path).read_text().splitlines()):
        if words[:1] == ['v']:
            vertices.append([float(w) for w in words[1:4]])
        elif words[:1] == ['f']:
            index = [int(w.split('/')[0]) for w in words[1:]]
            index = [i - 1 if i > 0 else len(vertices) + i for i in index]
            triangles += [[index[0], index[k], index[k + 1]] for k in range(1, len(index) - 1)]
    return np.array(vertices), np.array(triangles, np.int64)


def read_points(path):
    """Positions (n, 3), float64, of a PLY file's vertices."""
    vertex = read_ply(path)['vertex']
    return np.concatenate([vertex[k] for k in 'xyz'], 1).astype(float)


def read_mesh(path):
    """A Mesh from a PLY or OBJ file. Normals are the file's own (PLY), else those of vertex_normals."""
    if pathlib.Path(path).suffix.lower() == '.obj':
        vertices, triangles = _read_obj(path)
        return Mesh(vertices, triangles, vertex_normals(vertices, triangles))
    ply = read_ply(path)
    columns = lambda names: np.concatenate([ply['vertex'][k] for k in names], 1).astype(float)
    vertices, triangles = columns('xyz'), _triangles(ply, path)
    own = 'nx' in ply['vertex']
    return Mesh(vertices, triangles, columns(('nx', 'ny', 'nz')) if own else vertex_normals(vertices, triangles))


def write_mesh(path, mesh):
    """Binary little-endian PLY: x y z nx ny nz float32, triangles as lists of int32."""
    faces = np.zeros(len(mesh.triangles), [('count', 'u1'), ('index', '<i4', (3,))])
    faces['count'], faces['index'] = 3, mesh.triangles
    properties = ''.join(f'property float {k}\n' for k in ('x', 'y', 'z', 'nx', 'ny', 'nz'))
    header = (f'ply\nformat binary_little_endian 1.0\nelement vertex {len(mesh.vertices)}\n{properties}'
              f'element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n')
    path.parent.mkdir(parents=True, exist_ok=True)
    vertices = np.hstack([mesh.vertices, mesh.normals]).astype('<f4')
    path.write_bytes(header.encode() + vertices.tobytes() + faces.tobytes())
