"""A disc of grooves 1.6 um apart under two lamps: light is a wave, and a grating shows its colours (after the wave optics of Deng 2022)."""

import numpy as np

import shapes
from kit import envmap, look_at, point_light, rgb, studio

TEXEL_UM = 0.2
SIZE = 128
PERIOD_TEXELS = 8
ROOM = studio([(90, 60, 60, 25, 0.25, (1, 1, 1))], floor=0.04, ceiling=0.06)


def asset(kit):
    image = kit.make(
        "grating",
        "synth",
        None,
        "grating",
        "--height",
        "--size",
        SIZE,
        "--texel-size-um",
        TEXEL_UM,
        "--feature-size",
        PERIOD_TEXELS,
        "--depth-um",
        0.12,
        suffix=".exr",
    )
    heights = kit.make(
        "grating", "ingest", image, "--kind", "height", "--to", "heights", "--height-scale-um", 1, "--texel-size-um", TEXEL_UM
    )
    return kit.make("grating.wave", "pyramid", heights, "--optics", "wave", "--coherence-um", 5, "--wavelengths", 24)


def disc(inner, outer, height=0.12):
    return shapes.curve([(outer, 0.02), (outer, height), (inner, height)], 3)


def scene(kit, size=(720, 480), spp=64, crop=None):
    grooves = {"type": "roughconductor", "material": "Al", "alpha": 0.05}
    if not kit.smooth:
        # The grooves of the map run along v, and the disc's run round it, along u.
        grooves = {
            "type": "glint",
            "asset": str(asset(kit)),
            "uv_scale": 1 / (SIZE * TEXEL_UM * 1e-4),
            "rotation": 90.0,
            "material": "Al",
        }
    ring = lambda inner, outer: np.stack([np.linspace(outer, inner, 120), np.full(120, 0.12)], 1)
    plastic = {"type": "roughplastic", "diffuse_reflectance": rgb(0.25), "alpha": 0.08}
    return {
        "type": "scene",
        "integrator": kit.integrator(3),
        "camera": look_at((0, -19, 15), (0, -0.4, 0), 37, size, spp, crop=crop),
        "disc": kit.mesh("disc", shapes.lathe(ring(2.3, 5.8), SIZE * TEXEL_UM * 1e-4, columns=1500)) | {"bsdf": grooves},
        "rim": kit.mesh(
            "disc-rim", shapes.lathe(np.array([(5.99, 0.0), (6.0, 0.06), (5.97, 0.12), (5.8, 0.12)]), 1.0, columns=512)
        )
        | {"bsdf": plastic},
        "hub": kit.mesh("disc-hub", shapes.lathe(ring(0.75, 2.3), 1.0, columns=512)) | {"bsdf": plastic},
        "floor": kit.mesh("backdrop", shapes.backdrop()) | {"bsdf": {"type": "diffuse", "reflectance": rgb(0.06)}},
        "lamp": point_light((-9, 16, 26), 900),
        "lamp2": point_light((14, 10, 20), 350),
        "room": envmap(ROOM),
    }


def draw(gallery):
    picture = gallery.render("diffraction", scene(gallery.kit, *gallery.scaled((640, 420), 64)))
    gallery.save(
        "diffraction",
        picture,
        title="Colours of a grating",
        method="wave optics: pyramid of 24 wavelengths, shown as colours",
        alt="A disc with rainbow bands across it under two lamps",
        text="Grooves lie 1.6 um apart, as those of a compact disc. The colours are no texture: they are the diffraction of a height map of 26 um.",
    )
