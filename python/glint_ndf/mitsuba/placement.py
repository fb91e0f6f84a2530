"""How a map lies on a surface: scale and rotation of uv, and the frame in which half vectors of the map are given."""

import math

import drjit as dr
import mitsuba as mi


class Placement:
    """uv of the map = scale * (uv of the mesh turned by -rotation). So the picture on the surface turns by `rotation`, from dp/du
    towards dp/dv.

    Args:
        scale: maps per unit of uv along u and v.
        rotation_deg: degrees.
        endless: whether whole parts of uv count: the map is a plane that does not repeat.
    """

    def __init__(self, scale, rotation_deg, endless=False):
        self._endless = endless
        angle = math.radians(rotation_deg)
        c, s = math.cos(angle), math.sin(angle)
        self.cosine, self.sine = c, s
        self._rows = ((scale[0] * c, scale[0] * s), (-scale[1] * s, scale[1] * c))

    def change(self, d):
        """Change of the map's uv for a change of the mesh's uv (Vector2f)."""
        (a, b), (c, e) = self._rows
        return mi.Vector2f(a * d.x + b * d.y, c * d.x + e * d.y)

    def uv(self, uv):
        """uv of the map, modulo 1 where it repeats. The product is taken in double precision: far out floats lose texels."""
        wide = dr.float64_array_t(mi.Float)
        x, y = wide(uv.x), wide(uv.y)
        (a, b), (c, e) = self._rows
        placed = (a * x + b * y, c * x + e * y)
        return mi.Point2f(*(mi.Float(t if self._endless else t - dr.floor(t)) for t in placed))

    def frame(self, si):
        """Tangents of the map as vectors of the plane of si.sh_frame: dp/du made orthogonal to n, and the perpendicular on dp/dv's
        side, both turned by the rotation. Where dp/du has no direction, those of si.sh_frame, turned.
        """
        along, across = si.to_local(si.dp_du), si.to_local(si.dp_dv)
        length2 = along.x * along.x + along.y * along.y
        valid = dr.isfinite(length2) & (length2 > 0)
        scale = dr.rsqrt(dr.select(valid, length2, 1))
        x, y = dr.select(valid, along.x * scale, 1), dr.select(valid, along.y * scale, 0)
        # A mirrored texture has dp/dv on the other side.
        side = dr.select(across.y * x - across.x * y < 0, -1, 1)
        s, t = mi.Vector2f(x, y), mi.Vector2f(-y * side, x * side)
        return self.cosine * s + self.sine * t, self.cosine * t - self.sine * s


def into(frame, v):
    """A direction of si.sh_frame in the frame of the map."""
    s, t = frame
    return mi.Vector3f(s.x * v.x + s.y * v.y, t.x * v.x + t.y * v.y, v.z)


def out_of(frame, v):
    """The inverse of `into`."""
    s, t = frame
    return mi.Vector3f(s.x * v.x + t.x * v.y, s.y * v.x + t.y * v.y, v.z)
