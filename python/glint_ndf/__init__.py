"""Prefiltered normal distributions for glints, scratches, brushed metal and cloth.

Build an asset, open it, ask it::

    import glint_ndf as gn

    flakes = gn.synth("flakes", 1024)
    ndf = gn.pyramid(flakes).open(normals=flakes)
    density = ndf.density(uv=[0.3, 0.7], h=[0.1, -0.05], sigma=40)

In Mitsuba 3, ``import glint_ndf.mitsuba`` registers a BSDF and an integrator.
"""

from . import _glint, footprint
from .assets import Asset, Finding, Validation, info, load, save, validate
from .build import bin_map, compress, displace, histogram, ingest, moments, pyramid, synth, wave_pyramid
from .displaced import Displaced, open_displaced
from .errors import ArgumentError, FailedError, FileError, GlintError, InvalidInputError, UnsupportedError
from .ndf import Brdf, Ndf, open

__version__ = _glint.version()

__all__ = [
    "ArgumentError",
    "Asset",
    "Brdf",
    "Displaced",
    "FailedError",
    "FileError",
    "Finding",
    "GlintError",
    "InvalidInputError",
    "Ndf",
    "UnsupportedError",
    "Validation",
    "bin_map",
    "compress",
    "displace",
    "footprint",
    "histogram",
    "info",
    "ingest",
    "load",
    "moments",
    "open",
    "open_displaced",
    "pyramid",
    "save",
    "synth",
    "validate",
    "wave_pyramid",
]
