"""The BSDF `glint`: any asset as a reflecting surface, alone or as flakes between a clear coat and a base."""

import glint_ndf as gn
import mitsuba as mi
from glint_ndf import material

from .coat import Coat
from .conductor import Conductor
from .errors import PluginError
from .layer import LAYER_OPTIONS, GlintLayer, resolved
from .layers import Layers
from .options import Options

NAME = "glint"


def make_class():
    """The class of the plugin, for the current variant."""

    class Glint(mi.BSDF):
        """See docs/MITSUBA.md for the parameters."""

        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            _merge_description(props)
            options = Options(NAME, props)
            self.layers = _read_layers(options, props)
            options.finish()
            self.m_components = self.layers.components()
            self.m_flags = 0
            for component in self.m_components:
                self.m_flags |= component

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.layers.evaluate(ctx, si, wo, active)

        def eval(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active=True):
            return self.eval_pdf(ctx, si, wo, active)[1]

        def sample(self, ctx, si, sample1, sample2, active=True):
            return self.layers.sample(ctx, si, sample1, sample2, active)

        def traverse(self, callback):
            self.layers.traverse(callback)

        def to_string(self):
            return f"Glint[asset = {self.layers.facets.path}]"

    return Glint


#: Parameters that exclude each other. What a scene gives drops the others of its group from the description.
_EXCLUSIVE = (
    (("uv_scale",), ("texels_per_unit",)),
    (("material",), ("eta", "k")),
    (("coat_uv_scale",), ("coat_texels_per_unit",)),
)

#: Parameters of the coat's own asset.
_OF_COAT_ASSET = ("coat_asset", *("coat_" + name for name in LAYER_OPTIONS))


def _merge_description(props):
    """Replaces the parameter `description` by the parameters that the file says. Parameters of the scene have precedence."""
    if "description" not in props:
        return
    path = props["description"]
    if not isinstance(path, str):
        raise PluginError(NAME, f"parameter 'description' must be a text, the path of a material description, and is {path!r}")
    try:
        described = material.load(resolved(path))
    except gn.GlintError as error:
        raise PluginError(NAME, str(error)) from error
    del props["description"]
    dropped = {"type"}
    for group in _EXCLUSIVE:
        for members in group:
            if any(name in props for name in members):
                dropped.update(name for others in group if others is not members for name in others)
    # A coat has a roughness, or an asset, which may have a roughness of its own.
    if "coat_asset" in props and "coat_asset" not in described:
        dropped.add("coat_alpha")
    elif "coat_asset" not in props and "coat_alpha" in props and not _takes_alpha(described.get("coat_asset")):
        dropped.update(_OF_COAT_ASSET)
    for name, value in described.items():
        if name not in props and name not in dropped:
            props[name] = _property(value)


def _takes_alpha(path):
    """Whether `coat_alpha` is the roughness of an asset of the coat, and not that of a coat without an asset."""
    try:
        return path is not None and gn.load(path).kind == "bin-map"
    except gn.GlintError:
        return False  # no asset; the error says so when it is opened


def _property(value):
    """A value of a dictionary for mi.load_dict as Mitsuba hands it to plugins."""
    if not isinstance(value, dict):
        return value
    return mi.ScalarColor3f(value["value"]) if value["type"] == "rgb" else mi.load_dict(value)


def _read_layers(options, props):
    path = options.text("asset")
    if path is None:
        raise PluginError(NAME, "the parameter 'asset' is missing; give the path of a .glint asset")
    facets = GlintLayer(NAME, options, path)
    given = options.any_of(Conductor.parameters)
    if facets.kind == "displacement" and given:
        options.refuse(given[0], "does not apply to assets of kind displacement, which hold their own base")
    conductor = None if facets.kind == "displacement" else Conductor(props)
    base, transparency = options.object("base", mi.BSDF, "a BSDF"), options.texture("transparency")
    if base is None and transparency is not None:
        options.refuse("base", "is missing: the BSDF that shows through, by 'transparency'")
    if base is not None and transparency is None:
        options.refuse("transparency", "is missing: the share of the 'base' that shows between the facets, 0 to 1 or a texture")
    return Layers(facets, conductor, _read_coat(options), base, transparency)


def _read_coat(options):
    eta = options.number("coat", None, low=1.0, high=4.0)
    path, of_asset = options.text("coat_asset"), options.under("coat_")
    if path is None:
        layer, alpha = None, options.number("coat_alpha", None, low=0.0, high=1.0)
        for name in LAYER_OPTIONS:
            if name != "alpha" and of_asset.given(name):
                of_asset.refuse(name, "needs 'coat_asset', an asset of the coat's own normals")
    else:
        # `coat_alpha` is then the roughness of an asset of kind bin-map.
        layer, alpha = GlintLayer(NAME, of_asset, path), None
    if eta is None and (alpha is not None or layer is not None):
        options.refuse("coat", "is missing: the index of refraction of the coat, such as 1.5")
    return None if eta is None or eta == 1 else Coat(eta, alpha or 0.0, layer)
