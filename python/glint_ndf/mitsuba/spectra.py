"""Colours in linear sRGB as spectra of the variant."""

import drjit as dr
import mitsuba as mi
import numpy as np

#: nm where the blue base hands over to the green one, and the green one to the red one; half width of both hand-overs.
_BLUE_TO_GREEN, _GREEN_TO_RED, _HALF_WIDTH = 495.0, 585.0, 15.0


def spectrum_of(rgb, wavelengths):
    """A spectrum of the variant for three Floats r, g, b >= 0.

    RGB variants: the colour. Spectral variants: a sum of three bases, red, green and blue, that are at most 1 and add up to 1 at
    every wavelength. Their weights are such that the colour of the sum under D65 is the colour given; negative weights, which
    saturated colours would need, are 0. So white is flat, and colours inside the triangle of the bases are kept.
    """
    if not mi.is_spectral:
        return mi.Color3f(*rgb)
    red, green, blue = (dr.maximum(sum(float(row[c]) * rgb[c] for c in range(3)), 0) for row in _weights_of_colours())
    r, g, b = _bases(wavelengths)
    return red * r + green * g + blue * b


def _bases(wavelengths):
    to_green = dr.clip((wavelengths - (_BLUE_TO_GREEN - _HALF_WIDTH)) / (2 * _HALF_WIDTH), 0, 1)
    to_red = dr.clip((wavelengths - (_GREEN_TO_RED - _HALF_WIDTH)) / (2 * _HALF_WIDTH), 0, 1)
    return to_red, to_green - to_red, 1 - to_green


_weights = []


def _weights_of_colours():
    """The 3x3 matrix from linear sRGB to weights of the bases, as rows."""
    if not _weights:
        colours, white = np.zeros((3, 3)), np.zeros(3)
        for nm in np.arange(360.0, 831.0, 2.0):
            xyz = mi.cie1931_xyz(mi.Float(nm)) * mi.cie_d65(mi.Float(nm))
            light = np.array(mi.xyz_to_srgb(mi.Color3f(xyz))).ravel()
            white += light
            colours += np.outer(light, [float(np.array(base).ravel()[0]) for base in _bases(mi.Float(nm))])
        # Relative to the white of D65, so that white keeps its weights of 1 exactly.
        _weights.append(np.linalg.inv(colours / white[:, None]))
    return _weights[0]
