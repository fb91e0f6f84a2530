"""Footprints of shading points, from the ray differentials that a surface interaction holds."""

import warnings

import glint_ndf as gn

#: A footprint narrower than this, in texels, has no extent: its ray had no differentials.
_NO_EXTENT = 1e-6


class Footprints:
    """Makes the footprint of each lane.

    Args:
        width, height: of the map, texels.
        scale: factor of the size that the differentials give.
        sigma: deviation of all footprints, texels, or None: that of the differentials.
        fallback: deviation where the differentials are 0 or NaN, texels.
    """

    def __init__(self, plugin, path, width, height, scale, sigma, fallback):
        self.plugin, self.path = plugin, path
        self.width, self.height = width, height
        self.scale, self.sigma, self.fallback = scale, sigma, fallback
        self._warned = False

    def of(self, dx, dy):
        """Covariances [lanes, 3] (xx, xy, yy in texels^2), or a number: the deviation of all.

        Args:
            dx, dy: [lanes, 2] change of the map's uv from one pixel to the next.
        """
        if self.sigma is not None:
            return self.sigma
        covariance = gn.footprint.from_differentials(self.scale * dx, self.scale * dy, self.width, self.height)
        # Steps of infinite length count as very long ones; only what has no extent at all has no footprint.
        missing = ~(covariance[..., 0] + covariance[..., 2] > _NO_EXTENT**2)
        if missing.any():
            self._warn()
            covariance[missing] = (self.fallback**2, 0, self.fallback**2)
        return covariance

    def _warn(self):
        if self._warned:
            return
        self._warned = True
        warnings.warn(
            f"{self.plugin}: {self.path}: some rays have no usable differentials, so their footprints count as {self.fallback:.3g}"
            " texels. Render with the integrator `glint_path`, or give `sigma`",
            RuntimeWarning,
            stacklevel=2,
        )
