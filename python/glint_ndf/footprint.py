"""Footprints from what a renderer knows. See also ``glint/query/ray_footprint.h``."""

from __future__ import annotations

import math

import numpy as np

from . import _glint
from ._arrays import Batch, members

#: Deviation of the usual Gaussian pixel filter, pixels.
PIXEL_FILTER_SIGMA = 0.5


def sample_filter_sigma(samples: int) -> float:
    """Deviation of the pixel filter for one of several jittered samples of a pixel, pixels."""
    return PIXEL_FILTER_SIGMA / math.sqrt(max(1, samples))


def from_differentials(duv_dx, duv_dy, width: int, height: int, filter_sigma: float = PIXEL_FILTER_SIGMA) -> np.ndarray:
    """Covariance of the Gaussian footprint of a pixel, from ray differentials.

    Args:
        duv_dx, duv_dy: [..., 2] change of uv from one pixel to the next along x and y. NaN counts as 0.
        width, height: of the map, texels.
        filter_sigma: deviation of the pixel filter, pixels. With several jittered samples of a pixel give
            `sample_filter_sigma(samples)`.

    Returns:
        [..., 3] float32 covariance xx, xy, yy in texels^2, for the argument `covariance` of queries.
    """
    dx, dy = members(duv_dx, 2, "duv_dx"), members(duv_dy, 2, "duv_dy")
    batch = Batch(dx, dy)
    out = batch.answers(3)
    _glint.from_differentials(batch.rows(dx), batch.rows(dy), int(width), int(height), float(filter_sigma), out)
    return batch.shaped(out)


def from_cone(width, direction, texels_per_unit) -> np.ndarray:
    """Covariance of the footprint of a Gaussian beam on a surface, for bounces without ray differentials (Deng 2022, section 5.3).

    Args:
        width: [...] deviation across the ray, scene units.
        direction: [..., 3] unit vectors of the tangent frame towards the origin of the ray. Footprints are stretched along it.
        texels_per_unit: [...] texels in a scene unit.

    Returns:
        [..., 3] float32 covariance xx, xy, yy in texels^2.
    """
    widths, directions = members(width, 1, "width"), members(direction, 3, "direction")
    texels = members(texels_per_unit, 1, "texels_per_unit")
    batch = Batch(widths, directions, texels)
    out = batch.answers(3)
    _glint.from_cone(batch.rows(widths), batch.rows(directions), batch.rows(texels), out)
    return batch.shaped(out)


def half_vector_spread(
    wi, wo, dn_dx, dn_dy, dwo_dx=(0, 0, 0), dwo_dy=(0, 0, 0), filter_sigma: float = PIXEL_FILTER_SIGMA
) -> np.ndarray:
    """Half widths of the box of half vectors that a pixel sees where the surface's own normal turns under it.

    Args:
        wi, wo: [..., 3] unit vectors of the tangent frame, towards the light and the eye.
        dn_dx, dn_dy: [..., 3] change of the surface's unit normal, without the map, from one pixel to the next along x and y, in the
            tangent frame.
        dwo_dx, dwo_dy: [..., 3] change of wo.
        filter_sigma: deviation of the pixel filter, pixels.

    Returns:
        [..., 2] float32, for the argument `spread` of queries; 0 where directions are below the horizon.
    """
    vectors = [
        members(v, 3, name)
        for v, name in ((wi, "wi"), (wo, "wo"), (dn_dx, "dn_dx"), (dn_dy, "dn_dy"), (dwo_dx, "dwo_dx"), (dwo_dy, "dwo_dy"))
    ]
    batch = Batch(*vectors)
    out = batch.answers(2)
    _glint.spread_of(*(batch.rows(v) for v in vectors), float(filter_sigma), out)
    return batch.shaped(out)


def bounced_spread(spread, slope_sigma) -> np.ndarray:
    """Spread of a beam, radians, after facets whose slopes deviate by `slope_sigma` have reflected it: at most 0.75."""
    spreads, slopes = members(spread, 1, "spread"), members(slope_sigma, 1, "slope_sigma")
    batch = Batch(spreads, slopes)
    out = batch.answers()
    _glint.bounced(batch.rows(spreads), batch.rows(slopes), out)
    return batch.shaped(out)
