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


class Beam:
    """@param width   deviation across the ray at its origin, scene units
    @param spread  deviation of its directions, radians
    """

    DRJIT_STRUCT = {"width": None, "spread": None}

    def __init__(self, width=0.0, spread=0.0):
        self.width, self.spread = width, spread


def of_pixel(ray):
    """The beam of a camera ray, by the larger of its two differentials."""
    if not ray.has_differentials:
        return Beam(mi.Float(0), mi.Float(0))
    larger = lambda a, b: dr.maximum(dr.norm(a), dr.norm(b))  # noqa: E731
    return Beam(
        _FILTER * larger(ray.o_x - ray.o, ray.o_y - ray.o),
        _FILTER * larger(ray.d_x - ray.d, ray.d_y - ray.d),
    )


def propagated(beam, distance):
    """The beam at a distance: variances from width and from spread add."""
    widening = beam.spread * distance
    return Beam(dr.sqrt(beam.width * beam.width + widening * widening), beam.spread)


def write_partials(beam, ray, si):
    """Sets the uv differentials of a hit to those of the beam."""
    s, t = mi.coordinate_system(ray.d)
    step = beam.width / _FILTER
    across = mi.RayDifferential3f(ray)
    across.o_x, across.o_y = si.p + step * s - ray.d, si.p + step * t - ray.d
    across.d_x, across.d_y = ray.d, ray.d
    across.has_differentials = True
    si.compute_uv_partials(across)


def bounced(beam, si, pdf, mirrored):
    """The beam after a bounce.

    A lobe that is a Gaussian of deviation s has the density 1 / (2 pi s^2) at its centre. So a direction of density `pdf` widens
    the beam by 1 / sqrt(2 pi pdf), at most to a hemisphere: highlights keep glints sharp, diffuse surfaces do not. Mirrors add
    nothing. A curved surface turns the normal by dn across the footprint, and directions by 2 dn.
    """
    of_lobe = dr.select(mirrored, 0, dr.rsqrt(dr.maximum(dr.two_pi * pdf, 1e-6)))
    turned = [si.dn_du * d.x + si.dn_dv * d.y for d in (si.duv_dx, si.duv_dy)]
    of_curvature = 2 * _FILTER * dr.maximum(dr.norm(turned[0]), dr.norm(turned[1]))
    of_curvature = dr.select(dr.isfinite(of_curvature), of_curvature, 0)
    spread = dr.sqrt(beam.spread * beam.spread + of_lobe * of_lobe + of_curvature * of_curvature)
    return Beam(beam.width, dr.minimum(spread, _HEMISPHERE))
