"""How a map lies on a surface: scale and rotation of uv, and the frame in which half vectors of the map are given."""

import math

import drjit as dr
import mitsuba as mi


class Placement:
    """uv of the map = scale * (uv of the mesh turned by -rotation). So the picture on the surface turns by `rotation`, from dp/du
    towards dp/dv.

    @param scale  maps per unit of uv along u and v
    @param rotation_deg  degrees
    """

    def __init__(self, scale, rotation_deg):
        angle = math.radians(rotation_deg)
        c, s = math.cos(angle), math.sin(angle)
        self.cosine, self.sine = c, s
        self._rows = ((scale[0] * c, scale[0] * s), (-scale[1] * s, scale[1] * c))

    def change(self, d):
        """Change of the map's uv for a change of the mesh's uv (Vector2f)."""
        (a, b), (c, e) = self._rows
        return mi.Vector2f(a * d.x + b * d.y, c * d.x + e * d.y)

    def uv(self, uv):
        """uv of the map, modulo 1. The product is taken in double precision: far out floats lose texels."""
        wide = dr.float64_array_t(mi.Float)
        x, y = wide(uv.x), wide(uv.y)
        (a, b), (c, e) = self._rows
        return mi.Point2f(*(mi.Float(t - dr.floor(t)) for t in (a * x + b * y, c * x + e * y)))

    def frame(self, si):
        """Tangents of the map in the coordinates of si.sh_frame: dp/du made orthogonal to n, and the perpendicular on dp/dv's
        side, both turned by the rotation. Where dp/du has no direction, the tangents of si.sh_frame.
        """
        n = si.sh_frame.n
        along = si.dp_du - n * dr.dot(n, si.dp_du)
        length2 = dr.squared_norm(along)
        valid = dr.isfinite(length2) & (length2 > 0)
        s = dr.select(valid, along * dr.rsqrt(dr.select(valid, length2, 1)), si.sh_frame.s)
        t = dr.cross(n, s)
        # A mirrored texture has dp/dv on the other side.
        t = dr.select(dr.dot(t, si.dp_dv) < 0, -t, t)
        s, t = si.to_local(s), si.to_local(t)
        return self.cosine * s + self.sine * t, self.cosine * t - self.sine * s


def into(frame, v):
    """A direction of si.sh_frame in the frame of the map."""
    s, t = frame
    return mi.Vector3f(s.x * v.x + s.y * v.y, t.x * v.x + t.y * v.y, v.z)


def out_of(frame, v):
    """The inverse of `into`."""
    s, t = frame
    return mi.Vector3f(s.x * v.x + t.x * v.y, s.y * v.x + t.y * v.y, v.z)
