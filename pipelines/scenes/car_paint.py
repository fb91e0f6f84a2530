"""A bonnet in metallic paint: a clear coat, flakes, and a coloured base (Atanasov 2021, section 6)."""

import numpy as np

import shapes
from kit import envmap, look_at, point_light, rgb, studio

TEXEL_UM = 8
ROOM = studio([(90, 46, 75, 1.2, 9.0, (1, 1, 1)), (90, 40, 75, 0.8, 7.0, (1, 1, 1)), (180, 25, 20, 20, 0.7, (1, 0.93, 0.85)), (0, 25, 20, 20, 0.6, (0.85, 0.92, 1))], floor=0.03, ceiling=0.10)


def panel():
    """A bonnet and, beyond a gap, the wing beside it: x to the right, y to the back."""
    x = np.linspace(-24, 24, 900)
    y = np.linspace(-16, 30, 700)[:, None]
    ridge = lambda at, width: 1 / (1 + np.exp(-(x - at) / width))
    crease = 9 + 0.16 * y
    z = -0.0035 * (x + 6) ** 2 - 0.006 * (y - 12) ** 2 + 1.5 * (1 - ridge(crease, 0.55))
    gap = 16.5 + 0.08 * y
    z = z - 0.9 * np.exp(-(((x - gap) / 0.16) ** 4)) - 0.25 * np.exp(-(((x - gap) / 0.5) ** 2)) - 0.02 * np.maximum(x - gap, 0) ** 2
    points = np.stack(np.broadcast_arrays(x, y, z), -1)
    return shapes.Mesh().grid(points)


def paint(kit, of, asset):
    """Flakes over 25 % of a deep red base, all under a clear coat."""
    base = {"type": "diffuse", "reflectance": rgb(0.22, 0.008, 0.006)}
    if kit.smooth:
        return {"type": "blendbsdf", "weight": 0.25, "base": base, "flakes": kit.metal(of, asset)}
    return kit.metal(of, asset, material="Cu", coat=1.5, coat_alpha=0.01, base=base, transparency=0.75)


def scene(kit, size=(960, 640), spp=96, crop=None):
    of = kit.map("flakes", texel_um=TEXEL_UM, alpha=0.13, flake_size=5)
    return {
        "type": "scene",
        "integrator": kit.integrator(4),
        "camera": look_at((-4, -30, 17), (1.5, 1.0, 0), 34, size, spp, crop=crop),
        "panel": kit.mesh("panel", panel()) | {"bsdf": paint(kit, of, of.pyramid())},
        "sun": point_light((-25, 40, 60), 3500, (1, 0.96, 0.9)),
        "room": envmap(ROOM, 1.0),
    }


def draw(gallery):
    picture = gallery.render("car paint", scene(gallery.kit, *gallery.scaled((960, 640), 96)), exposure=1.0)
    gallery.save("car-paint", picture, title="Metallic paint", method="pyramid", text="")
