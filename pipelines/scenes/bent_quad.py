"""A sheet that rises behind, under one small light: the picture in which papers compare their maps (Deng 2022, figures 18 and 20)."""

import shapes
from kit import envmap, look_at, point_light, rgb, studio

# name -> (glint-synth's kind and options, title)
MAPS = {
    "isotropic": ({"kind": "isotropic", "alpha": 0.18, "correlation": 6, "sigma_r": 0.01}, "isotropic noise"),
    "flakes": ({"kind": "flakes", "alpha": 0.25, "flake_size": 8}, "flakes"),
    "brushed": ({"kind": "brushed", "alpha": 0.35, "streak": 80, "sigma_r": 0.01}, "brushed metal"),
    "scratches": ({"kind": "scratches", "density": 1.5, "feature_size": 4, "slope": 0.35, "sigma_r": 0.01}, "scratches"),
}
TEXEL_UM = 10
EXPOSURES = {"brushed": 0.25}
LIGHT = (-1.5, 5.5, 20.0)
ROOM = studio([(-90, 70, 180, 22, 0.09, (0.9, 0.95, 1))], floor=0.06, ceiling=0.06)


def scene(kit, name="flakes", size=(480, 360), spp=64, asset=None, crop=None, fov=36.0):
    """@param asset  how the map is prepared: Map -> path, by default a pyramid"""
    of = kit.map(**MAPS[name][0], texel_um=TEXEL_UM)
    return sheet(kit, of, asset(of) if asset else of.pyramid(), size, spp, crop, fov)


def sheet(kit, of, asset, size, spp, crop=None, fov=36.0):
    """The sheet with an asset on it; of: the map that is as wide as the asset's uv."""
    quad = kit.mesh("bent_quad", shapes.bent_quad())
    return {
        "type": "scene",
        "integrator": kit.integrator(2),
        "camera": look_at((0, -27, 19), (0, 0.3, 0.6), fov, size, spp, crop=crop),
        "quad": quad | {"bsdf": kit.metal(of, asset)},
        "light": point_light(LIGHT, 90),
        "room": envmap(ROOM),
    }


def draw(gallery):
    pictures = {}
    for name, (_, title) in MAPS.items():
        pictures[title] = gallery.render(
            f"bent quad, {title}", scene(gallery.kit, name, *gallery.scaled((400, 290), 16)), exposure=EXPOSURES.get(name, 1.0)
        )
    gallery.sheet(
        "bent-quad",
        pictures,
        columns=2,
        title="A bent sheet under one small light",
        alt="A bent sheet, four times: isotropic noise, flakes, brushed metal and scratches under a lamp",
        text="Four maps of 2048 x 2048 texels of 10 um, each repeated ten times along the sheet.",
        method="pyramid",
    )
