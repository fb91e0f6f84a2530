"""Meshes of the gallery, computed here: lengths are centimetres, and so are texture coordinates, measured along the surface.

Tangents of a mesh are constant on a triangle, so meshes are finer than the curvature alone asks for.
"""

import numpy as np


def curve(points, count):
    """A smooth curve through points [n][d], as `count` points at equal distances along it.

    Centripetal Catmull-Rom: it makes no loops where points lie close together.
    """
    p = np.asarray(points, float)
    p = np.vstack([2 * p[0] - p[1], p, 2 * p[-1] - p[-2]])
    step = np.sqrt(np.linalg.norm(np.diff(p, axis=0), axis=1))[:, None]
    slope = np.diff(p, axis=0) / step
    tangent = slope[:-1] - (p[2:] - p[:-2]) / (step[:-1] + step[1:]) + slope[1:]
    parts = len(p) - 3
    x = np.linspace(0, parts, 64 * parts + 1)
    i = np.minimum(x.astype(int), parts - 1)
    t = (x - i)[:, None]
    a, b, m, n = p[i + 1], p[i + 2], tangent[i] * step[i + 1], tangent[i + 1] * step[i + 1]
    dense = a + t * m + t**2 * (3 * (b - a) - 2 * m - n) + t**3 * (2 * (a - b) + m + n)
    along = arc_length(dense)
    return np.stack([np.interp(np.linspace(0, along[-1], count), along, column) for column in dense.T], axis=1)


def arc_length(points, axis=0):
    """Length of the polyline up to each of its points, along an axis of [..., 3]."""
    steps = np.linalg.norm(np.diff(points, axis=axis), axis=-1)
    zero = np.zeros_like(np.take(steps, [0], axis=axis))
    return np.concatenate([zero, np.cumsum(steps, axis=axis)], axis=axis)


def unit(v):
    return v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12)


class Mesh:
    """Triangles of one or more grids of points."""

    def __init__(self):
        self.points, self.normals, self.uvs, self.faces, self.count = [], [], [], [], 0

    def grid(self, points, uv=None, closed=False, flip=False):
        """Adds a grid [rows][columns][3]: u runs along the columns, v along the rows, and the normal is du x dv.

        @param uv      [rows][columns][2], by default the lengths along the middle row and along the middle column
        @param closed  the last column is the first one again
        @param flip    the normal is dv x du
        """
        points = np.asarray(points, float)
        rows, columns = points.shape[:2]
        if uv is None:
            u, v = arc_length(points[rows // 2]), arc_length(points[:, columns // 2])
            uv = np.stack(np.broadcast_arrays(u[None, :], v[:, None]), axis=-1)
        du = np.gradient(points, axis=1)
        if closed:
            du[:, 0] = du[:, -1] = points[:, 1] - points[:, -2]
        dv = np.gradient(points, axis=0)
        normals = np.cross(du, dv) * (-1 if flip else 1)
        # At a pole all columns meet: the normal of the next row is near.
        for row, neighbour in ((0, 1), (rows - 1, rows - 2)):
            if np.ptp(points[row], axis=0).max() < 1e-9:
                normals[row] = unit(normals[neighbour]).mean(axis=0)
        index = self.count + np.arange(rows * columns).reshape(rows, columns)
        a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
        faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)
        self.points.append(points.reshape(-1, 3))
        self.normals.append(unit(normals).reshape(-1, 3))
        self.uvs.append(np.asarray(uv, float).reshape(-1, 2))
        self.faces.append(faces[:, ::-1] if flip else faces)
        self.count += rows * columns
        return self

    def write(self, path):
        """As a binary PLY file."""
        vertices = np.hstack([np.vstack(self.points), np.vstack(self.normals), np.vstack(self.uvs)]).astype("<f4")
        faces = np.vstack(self.faces)
        table = np.empty(len(faces), [("n", "u1"), ("i", "<i4", 3)])
        table["n"], table["i"] = 3, faces
        names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "nx", "ny", "nz", "u", "v"))
        header = (
            f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{names}"
            f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
        )
        path.write_bytes(header.encode() + vertices.tobytes() + table.tobytes())
        return path


def lathe(profile, map_cm, columns=384, mesh=None):
    """A profile [rows] of (radius, height) turned round the z axis, from the bottom up.

    u runs round the axis, over a whole number of maps, so that the map has no seam.
    """
    profile = np.asarray(profile, float)
    angle = np.linspace(0, 2 * np.pi, columns)
    points = np.stack(
        [profile[:, :1] * np.cos(angle), profile[:, :1] * np.sin(angle), np.repeat(profile[:, 1:], columns, 1)], -1
    )
    round_cm = max(1, round(2 * np.pi * np.quantile(profile[:, 0], 0.75) / map_cm)) * map_cm
    uv = np.stack(np.broadcast_arrays(angle / (2 * np.pi) * round_cm, arc_length(profile)[:, None]), -1)
    return (mesh or Mesh()).grid(points, uv, closed=True)


def tube(centres, radii, columns=64, mesh=None, up=(0, 1, 0)):
    """A tube of elliptic sections along a curve [rows][3]; radii [rows][2] across `up` and along it.

    v runs along the tube.
    """
    centres = np.asarray(centres, float)
    radii = np.broadcast_to(np.asarray(radii, float), (len(centres), 2))
    tangent = unit(np.gradient(centres, axis=0))
    side = unit(np.cross(tangent, np.broadcast_to(np.asarray(up, float), tangent.shape)))
    top = np.cross(side, tangent)
    angle = np.linspace(0, 2 * np.pi, columns)
    points = (
        centres[:, None]
        + side[:, None] * (radii[:, :1] * np.cos(angle))[..., None]
        + top[:, None] * (radii[:, 1:] * np.sin(angle))[..., None]
    )
    # The section turns from side to top, against du x dv out of the tube.
    return (mesh or Mesh()).grid(points, closed=True, flip=bool(np.sum(np.cross(side, top) * tangent) < 0))


def blade(length, width, rise, bowl, thickness, rows=500, columns=160, mesh=None, start=0.0, offset=0.0):
    """A closed shell along x, as cutlery is made of: all arguments after the length are functions of t in 0..1, in centimetres.

    @param width      half of the width
    @param rise       height of the middle
    @param bowl       depth of the middle below the edges
    @param thickness  of the sheet
    """
    # Rows are denser at the ends, where the outline is round.
    t = 0.5 - 0.5 * np.cos(np.linspace(0, np.pi, rows))
    angle = np.linspace(0, 2 * np.pi, columns)
    w, z, depth, thick = (np.broadcast_to(np.asarray(f(t), float), t.shape)[:, None] for f in (width, rise, bowl, thickness))
    across, out = np.sign(np.cos(angle)) * np.abs(np.cos(angle)) ** 0.8, np.sin(angle)
    y = w * across
    height = z - depth * (1 - across**2) + 0.5 * thick * out * np.minimum(1, w / np.maximum(thick, 1e-9))
    points = np.stack([np.broadcast_to(start + length * t[:, None], y.shape), y + offset, height], -1)
    uv = np.stack([np.broadcast_to(points[..., 1] + np.where(out < 0, 50.0, 0), y.shape), points[..., 0]], -1)
    return (mesh or Mesh()).grid(points, uv, closed=True)


def bent_quad(width=20.0, depth=14.0, bend=5.0, rows=400, columns=400):
    """A sheet that rises behind, as the quad that papers show maps on: x to the right, y to the back, z up."""
    y = np.linspace(-depth / 2, depth / 2, rows)
    z = bend * np.maximum(0, (y + 0.5 * depth) / depth) ** 2.4
    x = np.linspace(-width / 2, width / 2, columns)
    points = np.stack(np.broadcast_arrays(x, y[:, None], z[:, None]), -1)
    return Mesh().grid(points)


def backdrop(half=120.0, radius=40.0, height=120.0, front=120.0):
    """A floor that bends into a wall behind, without an edge."""
    angle = np.linspace(-np.pi / 2, 0, 48)
    profile = np.vstack(
        [[-front, 0], np.stack([half - radius + radius * np.cos(angle), radius + radius * np.sin(angle)], 1), [half, height]]
    )
    x = np.linspace(-4 * half, 4 * half, 8)
    points = np.stack(np.broadcast_arrays(x, profile[:, :1], profile[:, 1:]), -1)
    return Mesh().grid(points)
