"""The layer of an asset on a surface: reads the asset and its placement, and asks it at surface interactions."""

import drjit as dr
import glint_ndf as gn
import mitsuba as mi
import numpy as np
from glint_ndf.ndf import ENDLESS_KINDS

from .asset_file import AssetFile
from .errors import PluginError
from .exchange import is_jit, lanes_of, spread, take, to_float, to_mask, to_rows, to_vector
from .footprints import Footprints
from .glint_lobe import DisplacedLobe, GlintLobe
from .meshes import UvCheck
from .placement import Placement, into, out_of
from .spectra import spectrum_of
from .wave_lobe import SpectralLobe, wavelengths_of
from .wavefront import require_numbers

_VARIANTS = ("full", "lobes", "single")

_WITH_LEVELS = ("ndf-pyramid", "ndf-cp", "wave-cp", "wave-pyramid")
_WITH_IMAGES = (*_WITH_LEVELS, "wang-cp", "wang-pyramid")
_WITH_NDF = (*_WITH_IMAGES, "slope-moments", "bin-map", "histogram-sat", "tiny-example", "wang-tiles", "normals")

#: Options of an asset, and the kinds that read them.
_KINDS_OF_OPTIONS = {
    "normals": ("ndf-pyramid", "ndf-cp"),
    "sigma_r": ("normals", "slope-moments", "wang-tiles"),
    "alpha": ("bin-map",),
    "surface": ("normals", "wang-tiles"),
    "boundary": ("normals",),
    "footprint_parts": (*_WITH_IMAGES, "slope-moments"),
    "interpolation": _WITH_LEVELS,
    "pixels": _WITH_IMAGES,
    "facets": _WITH_NDF,
    "variant": ("displacement",),
}

#: All options of an asset and of its placement.
LAYER_OPTIONS = (*_KINDS_OF_OPTIONS, "uv_scale", "texels_per_unit", "rotation", "footprint_scale", "sigma")

#: Texels: footprints without differentials are at least as wide as half a texel.
_NARROWEST = 0.5


class GlintLayer:
    """An asset, opened and placed by the options of a plugin."""

    def __init__(self, plugin, options, path):
        self.plugin = plugin
        self.path = resolved(path)
        self._files = [AssetFile(plugin, self.path)]
        self.kind = _opened(plugin, self.path, lambda: gn.load(self.path).kind)
        self._uv_check = UvCheck(plugin, self.path)
        self._threads = 0 if is_jit() else 1
        self._udim_tiles = 0
        self._refuse_options_of_other_kinds(options)
        if self.kind == "displacement":
            self._open_displaced(options)
        else:
            self._open_ndf(options)
        scale, endless = _scale_of(options, self.width, self.height), self.kind in ENDLESS_KINDS or self._udim_tiles > 0
        self.placement = Placement(scale, options.number("rotation", 0.0), endless)
        factor, sigma = options.number("footprint_scale", 1.0, above=0), options.number("sigma", None, above=0)
        self._footprints = Footprints(plugin, self.path, self.width, self.height, factor, sigma, self._fallback)

    def _refuse_options_of_other_kinds(self, options):
        if self.kind not in (*_WITH_NDF, "displacement"):
            return  # refused when it is opened
        for name, kinds in _KINDS_OF_OPTIONS.items():
            if options.given(name) and self.kind not in kinds:
                options.refuse(
                    name, f"is for assets of kind {', '.join(kinds)}, and {self.path} is of kind {self.kind}; leave it out"
                )

    def _open_displaced(self, options):
        displaced = _opened(self.plugin, self.path, lambda: gn.open_displaced(self.path))
        self.width, self.height = displaced.width, displaced.height
        self._fallback = _NARROWEST
        self.lobe = DisplacedLobe(displaced, options.text("variant", "full", _VARIANTS))

    def _open_ndf(self, options):
        given = {
            "normals": options.text("normals"),
            "sigma_r": options.number("sigma_r"),
            "alpha": options.number("alpha"),
            "surface": options.text("surface", None, ("flat", "smooth")),
            "boundary": options.text("boundary", None, ("wrap", "clamp")),
            "footprint_parts": options.integer("footprint_parts", None, low=1),
            "interpolation": options.text("interpolation", None, ("footprint", "trilinear")),
            "pixels": options.text("pixels", None, ("smooth", "constant")),
        }
        given = {name: value for name, value in given.items() if value is not None}
        facets = options.text("facets", "distribution", ("distribution", "beckmann"))
        if "normals" in given:
            given["normals"] = resolved(given["normals"])
            self._files.append(AssetFile(self.plugin, given["normals"]))
        ndf = _opened(self.plugin, self.path, lambda: gn.open(self.path, **given))
        self.width, self.height = ndf.width, ndf.height
        self._udim_tiles = ndf.udim_tiles
        self._fallback = max(ndf.smallest_sigma, _NARROWEST)
        self.lobe = _opened(self.plugin, self.path, lambda: self._lobe_of(ndf, facets))

    def _lobe_of(self, ndf, facets):
        wavelengths = wavelengths_of(self.path) if mi.is_spectral and ndf.kind in ("wave-cp", "wave-pyramid") else None
        return GlintLobe(ndf, facets) if wavelengths is None else SpectralLobe(ndf, wavelengths)

    def check(self, si):
        """Raises an error where the asset cannot be asked: symbolic loops, a replaced file, a mesh without uv."""
        require_numbers(self.plugin)
        for file in self._files:
            file.check()
        self._uv_check.of(si)

    def evaluate(self, si, viewed, lit, active):
        """f without a cosine (a spectrum, as if facets were perfect mirrors), and pdf per unit solid angle of `lit`."""
        self.check(si)
        frame = self.placement.frame(si)
        rows = self._rows(si, into(frame, viewed), into(frame, lit))
        count = len(rows[0])
        lanes = lanes_of(to_mask(active & (viewed.z > 0) & (lit.z > 0), count))
        uv, dx, dy, v, l = take(lanes, *rows)
        if len(uv) == 0:
            return mi.Spectrum(0), mi.Float(0)
        f, pdf = self.lobe.evaluate(uv, self._footprints.of(dx, dy), v, l, self._threads)
        return self._spectrum(spread(lanes, count, f), si), to_float(spread(lanes, count, pdf))

    def sample(self, si, viewed, xi, active):
        """A direction, weight f cosine / pdf (a spectrum, as for `evaluate`) and pdf; pdf 0: nothing was drawn."""
        self.check(si)
        frame = self.placement.frame(si)
        rows = self._rows(si, into(frame, viewed), xi)
        count = len(rows[0])
        lanes = lanes_of(to_mask(active & (viewed.z > 0), count))
        uv, dx, dy, v, random = take(lanes, *rows)
        if len(uv) == 0:
            return mi.Vector3f(0, 0, 1), mi.Spectrum(0), mi.Float(0)
        drawn = self.lobe.sample(uv, self._footprints.of(dx, dy), v, random, self._threads)
        lit, weight, pdf = (spread(lanes, count, a) for a in drawn)
        lit = out_of(frame, to_vector(lit))
        valid = lit.z > 0
        return lit, dr.select(valid, self._spectrum(weight, si), 0), dr.select(valid, to_float(pdf), 0)

    @property
    def slope_variance(self):
        """Of the map; None for assets that do not answer for lobes of light."""
        return self.lobe.slope_variance if self.lobe.channels == 1 else None

    def lit_by_lobe(self, si, viewed, axis, sharpness, active):
        """Radiance towards `viewed` from the light exp(sharpness (w . axis - 1)), by perfect mirrors: a Float."""
        self.check(si)
        frame = self.placement.frame(si)
        rows = self._rows(si, into(frame, viewed), into(frame, axis), mi.Vector1f(sharpness))
        count = len(rows[0])
        lanes = lanes_of(to_mask(active & (viewed.z > 0), count))
        uv, dx, dy, v, a, k = take(lanes, *rows)
        if len(uv) == 0:
            return mi.Float(0)
        radiance = self.lobe.lit_by_lobe(uv, self._footprints.of(dx, dy), v, a, k[:, 0], self._threads)
        return to_float(spread(lanes, count, radiance))

    def _rows(self, si, *vectors):
        place = self.placement
        return to_rows(place.uv(si.uv), place.change(si.duv_dx), place.change(si.duv_dy), *vectors)

    def _spectrum(self, values, si):
        if values.shape[-1] == 1:
            return mi.Spectrum(to_float(values[..., 0]))
        if isinstance(self.lobe, SpectralLobe):
            (wavelengths,) = to_rows(si.wavelengths)
            at = self.lobe.at(values, np.broadcast_to(wavelengths, (len(values), wavelengths.shape[-1])))
            return mi.Spectrum(*(to_float(at[..., c]) for c in range(at.shape[-1])))
        values = np.maximum(values, 0)
        return spectrum_of([to_float(values[..., c]) for c in range(3)], si.wavelengths)


def resolved(path):
    """The file that a path of a scene names: Mitsuba looks in the folder of the scene too."""
    return str(mi.file_resolver().resolve(path))


def _scale_of(options, width, height):
    """Maps per unit of uv, along u and v."""
    scale = options.number("uv_scale", None, above=0)
    texels = options.number("texels_per_unit", None, above=0)
    if scale is not None and texels is not None:
        options.refuse("texels_per_unit", "says the same as 'uv_scale'; give one of them")
    if texels is not None:
        return texels / width, texels / height
    return (1.0, 1.0) if scale is None else (scale, scale)


def _opened(plugin, path, open_it):
    """What `open_it` returns. Errors of the library get the name of the plugin."""
    try:
        return open_it()
    except gn.GlintError as error:
        text = str(error)
        raise PluginError(plugin, text, None if path in text else path) from error
