"""Fresnel reflectance of a conductor, with the materials and textures of Mitsuba's own `roughconductor`."""

import mitsuba as mi

_PARAMETERS = ("material", "eta", "k", "specular_reflectance")


class Conductor:
    """Reflectance of facets, a spectrum of the variant. Textures are those that `roughconductor` makes of the same parameters."""

    parameters = _PARAMETERS

    def __init__(self, props):
        given = {name: _for_dictionary(props[name]) for name in _PARAMETERS if name in props}
        if not given.keys() & {"material", "eta", "k"}:
            given["material"] = "none"
        model = mi.load_dict({"type": "roughconductor", **given})
        textures = _textures_of(model)
        self.eta, self.k = textures["eta"], textures["k"]
        self.scale = textures.get("specular_reflectance")
        self._mirror = given.get("material") == "none"

    def reflectance(self, si, cosine, active):
        """Share of light that a facet reflects. `cosine`: between a direction and the normal of the facet."""
        if self._mirror:
            value = mi.Spectrum(1.0)
        else:
            eta, k = self.eta.eval(si, active), self.k.eval(si, active)
            value = mi.Spectrum(*(mi.fresnel_conductor(cosine, mi.Complex2f(eta[c], k[c])) for c in range(len(eta))))
        return value if self.scale is None else value * self.scale.eval(si, active)

    def traverse(self, callback):
        callback.put("eta", self.eta, mi.ParamFlags.Differentiable)
        callback.put("k", self.k, mi.ParamFlags.Differentiable)
        if self.scale is not None:
            callback.put("specular_reflectance", self.scale, mi.ParamFlags.Differentiable)


def _for_dictionary(value):
    """A parameter as `mi.load_dict` takes it: colours of a scene reach plugins as three numbers."""
    return {"type": "rgb", "value": list(value)} if isinstance(value, mi.ScalarColor3f) else value


def _textures_of(plugin):
    class Collector(mi.TraversalCallback):
        def __init__(self):
            super().__init__()
            self.found = {}

        def put(self, name, value, flags):
            self.found[name] = value

    collector = Collector()
    plugin.traverse(collector)
    return collector.found
