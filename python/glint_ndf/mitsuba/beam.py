"""The width of a path, as a Gaussian beam: from the pixel to the first hit by ray differentials, then by cones that widen with
distance, with the roughness of what they hit and with its curvature (Deng 2022, section 5.3).
"""

import drjit as dr
import glint_ndf as gn
import mitsuba as mi

#: Radians per axis: the deviation of a hemisphere that is seen evenly by projected area, as in glint/query/ray_footprint.h.
_HEMISPHERE = 0.75

#: Deviation of the pixel filter, in steps of the differentials. Steps of a cone are made so that a BSDF finds the cone's deviation.
_FILTER = gn.footprint.PIXEL_FILTER_SIGMA

_LEAST = 1e-12


class Beam:
    """Offsets across a ray and angles to it, of the light that one sample of a pixel stands for: their variances, and their
    covariance. Rays from one point have a covariance, so their width grows as the distance; what a rough surface adds has none.

    Args:
        width2: scene units^2.
        tilt: covariance, scene units times radians.
        spread2: radians^2.
    """

    DRJIT_STRUCT = {"width2": None, "tilt": None, "spread2": None}

    def __init__(self, width2=0.0, tilt=0.0, spread2=0.0):
        self.width2, self.tilt, self.spread2 = width2, tilt, spread2


def of_pixel(ray):
    """The beam of a camera ray, by the larger of its two differentials."""
    if not ray.has_differentials:
        return Beam(mi.Float(0), mi.Float(0), mi.Float(0))
    width = _FILTER * dr.maximum(dr.norm(ray.o_x - ray.o), dr.norm(ray.o_y - ray.o))
    spread = _FILTER * dr.maximum(dr.norm(ray.d_x - ray.d), dr.norm(ray.d_y - ray.d))
    return Beam(width * width, width * spread, spread * spread)


def propagated(beam, distance):
    """The beam at a distance: an offset grows by the angle times the distance."""
    tilt = beam.tilt + distance * beam.spread2
    return Beam(beam.width2 + distance * (beam.tilt + tilt), tilt, beam.spread2)


def write_partials(beam, ray, si):
    """Sets the uv differentials of a hit to those of the beam."""
    s, t = mi.coordinate_system(ray.d)
    step = dr.sqrt(dr.maximum(beam.width2, 0)) / _FILTER
    across = mi.RayDifferential3f(ray)
    across.o_x, across.o_y = si.p + step * s - ray.d, si.p + step * t - ray.d
    across.d_x, across.d_y = ray.d, ray.d
    across.has_differentials = True
    si.compute_uv_partials(across)


def bounced(beam, si, lit, pdf, mirrored):
    """The beam after a bounce towards `lit` (in the shading frame), which was drawn with the density `pdf`.

    Samples of a Gaussian lobe of deviation s have the median density 1 / (4 pi s^2). So a lobe widens the beam by
    1 / sqrt(4 pi pdf), at most to a hemisphere: highlights keep glints sharp, diffuse surfaces do not. Mirrors add nothing.

    A mirror of curvature k turns the normal by k and the direction by 2 k per unit of offset, outwards if it is convex. The mean
    curvature stands for both axes. Light that passes through keeps its angles.
    """
    turn = dr.select(si.wi.z * lit.z > 0, 2 * _curvature(si), 0)
    tilt = beam.tilt + turn * beam.width2
    of_lobe = dr.select(mirrored, 0, dr.rcp(dr.maximum(4 * dr.pi * pdf, 1 / _HEMISPHERE**2)))
    spread2 = beam.spread2 + turn * (beam.tilt + tilt) + of_lobe
    return Beam(beam.width2, tilt, dr.clip(spread2, 0, _HEMISPHERE**2))


def _curvature(si):
    """Mean curvature towards the side that is seen, 1 / scene units: above 0 where the surface bulges. 0 where it is unknown."""
    along = [
        dr.dot(dn, dp) / dr.maximum(dr.squared_norm(dp), _LEAST) for dn, dp in ((si.dn_du, si.dp_du), (si.dn_dv, si.dp_dv))
    ]
    mean = dr.select(si.wi.z > 0, 0.5, -0.5) * (along[0] + along[1])
    return dr.select(dr.isfinite(mean), mean, 0)
