"""Mitsuba 3 plugins of glint: the BSDF `glint` and the integrator `glint_path`. See docs/MITSUBA.md.

import mitsuba as mi
import glint_ndf.mitsuba
mi.set_variant("llvm_ad_rgb")
scene = mi.load_dict({... "bsdf": {"type": "glint", "asset": "flakes.pyramid.glint", "material": "Al"} ...})
image = glint_ndf.mitsuba.render(scene, spp=16)
"""

from . import llvm as _llvm

_llvm.prepare()

try:
    import mitsuba as _  # noqa: F401
except ImportError as _error:
    raise ImportError(f"glint_ndf.mitsuba needs Mitsuba 3.9 or newer: pip install mitsuba ({_error})") from _error

from .errors import PluginError  # noqa: E402
from .lobes import Lobes, fit_lobes  # noqa: E402
from .registration import register, watch_variants as _watch_variants  # noqa: E402
from .wavefront import render, wavefront  # noqa: E402

_watch_variants()
register()

__all__ = ["Lobes", "PluginError", "fit_lobes", "register", "render", "wavefront"]
