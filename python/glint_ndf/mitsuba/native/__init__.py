"""The BSDF `glint_native`: the facets of an asset as conductors, compiled against the headers that Mitsuba's wheel holds.

import glint_ndf.mitsuba.native
glint_ndf.mitsuba.native.load()                    # compiles once, in a few seconds
bsdf = mi.load_dict({"type": "glint_native", "asset": "flakes.pyramid.glint", "material": "Al"})
"""

from .build import compiled_plugin, load

__all__ = ["compiled_plugin", "load"]
