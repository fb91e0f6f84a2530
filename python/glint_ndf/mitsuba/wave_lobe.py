"""Reflection by a wave-pyramid or wave-cp with a channel for each wavelength, for spectral variants."""

import glint_ndf as gn
import numpy as np

from .glint_lobe import GlintLobe, named


def wavelengths_of(path):
    """Wavelengths of the channels, nm; None where the channels are colours, or the asset has no channels."""
    info = gn.info(path)
    if info["properties"].get("channel_meaning") != "spectral":
        return None
    # The library does not hand the wavelengths out. The format stores all arrays contiguous, little-endian and uncompressed.
    place = next(d for d in info["datasets"] if d["path"] == "/wavelengths_um")
    return 1000 * np.fromfile(path, dtype="<f4", count=place["dims"][0], offset=place["offset"]).astype(np.float64)


class SpectralLobe(GlintLobe):
    """As GlintLobe, with a channel for each of `wavelengths` (nm)."""

    def __init__(self, ndf, wavelengths):
        super().__init__(ndf, "distribution")
        self._ndf = ndf
        self.wavelengths, self.channels = wavelengths, len(wavelengths)

    def evaluate(self, uv, footprint, viewed, lit, threads):
        colour, pdf = self._brdf.evaluate(uv, lit, viewed, threads=threads, **named(footprint))
        return self._of_channels(colour, uv, footprint, viewed, lit, threads), pdf

    def sample(self, uv, footprint, viewed, xi, threads):
        lit, colour, pdf = self._brdf.sample(uv, viewed, xi, threads=threads, **named(footprint))
        return lit, self._of_channels(colour, uv, footprint, viewed, lit, threads), pdf

    def _of_channels(self, colour, uv, footprint, viewed, lit, threads):
        """The answer of each channel: a colour is a factor (masking, cosines) times the colour of the density, so the factor is the
        quotient in the brightest of red, green and blue.
        """
        psi = 0.5 * (viewed[..., :2] + lit[..., :2])
        asked = dict(threads=threads, **named(footprint))
        of_density = self._ndf.density_rgb(uv, psi, **asked)
        brightest = np.argmax(colour, axis=-1)[..., None]
        top, bottom = (np.take_along_axis(a, brightest, axis=-1) for a in (colour, of_density))
        factor = np.divide(top, bottom, out=np.zeros_like(top), where=bottom > 0)
        return factor * np.maximum(self._ndf.density_spectrum(uv, psi, **asked), 0)

    def at(self, values, wavelengths):
        """Answers [lanes, channels] at wavelengths [lanes, n] in nm: linear between channels, constant beyond the first and last."""
        known = self.wavelengths
        if len(known) == 1:
            return np.broadcast_to(values, wavelengths.shape)
        low = np.clip(np.searchsorted(known, wavelengths) - 1, 0, len(known) - 2)
        part = np.clip((wavelengths - known[low]) / (known[low + 1] - known[low]), 0, 1)
        return (1 - part) * np.take_along_axis(values, low, -1) + part * np.take_along_axis(values, low + 1, -1)
