"""Reflection by the facets of an asset, as mirrors: numpy in, numpy out. Fresnel's share is the caller's."""

import numpy as np


class GlintLobe:
    """The lobe of an asset that answers an NDF.

    Directions are rows of unit vectors in the frame of the map. `viewed` points to the viewer (Mitsuba's si.wi), `lit` is the
    other direction (Mitsuba's wo). Footprints are a deviation in texels, or covariances [lanes, 3].
    """

    def __init__(self, ndf, facets):
        self._brdf = ndf.brdf(fresnel="mirror", facets=facets)
        self.channels = 3 if ndf.channels > 1 else 1
        _, (xx, _, yy) = ndf.slopes()
        #: Mean variance of the slopes along u and v: how broad the surface reflects from afar.
        self.slope_variance = 0.5 * (xx + yy) + ndf.sigma_r**2

    def evaluate(self, uv, footprint, viewed, lit, threads):
        """f [lanes, channels] in 1/sr, without a cosine, and pdf [lanes] per unit solid angle."""
        f, pdf = self._brdf.evaluate(uv, lit, viewed, threads=threads, **named(footprint))
        return f[..., : self.channels], pdf

    def sample(self, uv, footprint, viewed, xi, threads):
        """Direction [lanes, 3], weight [lanes, channels] = f cosine / pdf, and pdf [lanes]."""
        lit, weight, pdf = self._brdf.sample(uv, viewed, xi, threads=threads, **named(footprint))
        return lit, weight[..., : self.channels], pdf

    def lit_by_lobe(self, uv, footprint, viewed, axis, sharpness, threads):
        """Radiance [lanes] towards the viewer from one lobe of light a lane, exp(sharpness (w . axis - 1)) from direction w."""
        ones = np.ones((len(uv), 1, 3), dtype=np.float32)
        lobe = axis[:, None, :], sharpness[:, None], ones
        return self._brdf.lobes(uv, viewed, *lobe, threads=threads, **named(footprint))[..., 0]


class DisplacedLobe:
    """The lobe of an asset of kind displacement, with the colour of its base, on the coarse mesh. Members as in GlintLobe."""

    channels = 3
    slope_variance = None

    def __init__(self, displaced, variant):
        self._displaced, self._variant = displaced, variant

    def evaluate(self, uv, footprint, viewed, lit, threads):
        level = self._level(footprint)
        reflected, pdf = self._displaced.evaluate(level, uv, lit, viewed, variant=self._variant, threads=threads)
        cosine = np.maximum(lit[..., 2:3], 1e-6)
        return reflected / cosine, pdf

    def sample(self, uv, footprint, viewed, xi, threads):
        return self._displaced.sample(self._level(footprint), uv, viewed, xi, variant=self._variant, threads=threads)

    def _level(self, footprint):
        if np.ndim(footprint) == 0:
            return self._displaced.level(footprint)
        return self._displaced.level(np.sqrt(0.5 * (footprint[..., 0] + footprint[..., 2])))


def named(footprint):
    return {"sigma": footprint} if np.ndim(footprint) == 0 else {"covariance": footprint}
