"""A bonnet in metallic paint: a clear coat, flakes, and a coloured base (Atanasov 2021, section 6)."""

import numpy as np

import shapes
from kit import envmap, look_at, point_light, rgb, studio

TEXEL_UM = 8
ROOM = studio(
    [(90, 40, 70, 9, 0.4, (1, 1, 1)), (180, 25, 20, 20, 0.5, (1, 0.93, 0.85)), (0, 25, 20, 20, 0.5, (0.85, 0.92, 1))],
    floor=0.03,
    ceiling=0.10,
)


def panel():
    """A bonnet and, beyond a gap, the wing beside it: x to the right, y to the back."""
    x = np.linspace(-24, 24, 900)
    y = np.linspace(-16, 30, 700)[:, None]
    ridge = lambda at, width: 1 / (1 + np.exp(-(x - at) / width))
    crease = 9 + 0.16 * y
    z = -0.0035 * (x + 6) ** 2 - 0.006 * (y - 12) ** 2 + 1.5 * (1 - ridge(crease, 0.55))
    gap = 16.5 + 0.08 * y
    z = (
        z
        - 0.9 * np.exp(-(((x - gap) / 0.16) ** 4))
        - 0.25 * np.exp(-(((x - gap) / 0.5) ** 2))
        - 0.02 * np.maximum(x - gap, 0) ** 2
    )
    points = np.stack(np.broadcast_arrays(x, y, z), -1)
    return shapes.Mesh().grid(points)


def paint(kit, of, asset):
    """Flakes over 20 % of a deep red base, all under a clear coat."""
    base = {"type": "diffuse", "reflectance": rgb(0.45, 0.012, 0.010)}
    if kit.smooth:
        return {"type": "blendbsdf", "weight": 0.2, "base": base, "flakes": kit.metal(of, asset)}
    return kit.metal(
        of, asset, material="Cu", interpolation="trilinear", coat=1.5, coat_alpha=0.007, base=base, transparency=0.8
    )


def scene(kit, size=(960, 640), spp=96, crop=None):
    of = kit.map("flakes", texel_um=TEXEL_UM, alpha=0.16, flake_size=9, sigma_r=0.01)
    return {
        "type": "scene",
        "integrator": kit.integrator(4),
        "camera": look_at((-4, -30, 17), (6.0, 1.5, 0), 23, size, spp, crop=crop),
        "panel": kit.mesh("panel", panel()) | {"bsdf": paint(kit, of, of.pyramid())},
        "sun": point_light((16, 42, 54), 5000, (1, 0.96, 0.9)),
        "room": envmap(ROOM, 1.0),
    }


def draw(gallery):
    size, spp = gallery.scaled((640, 430), 40)
    picture = gallery.render("car paint", scene(gallery.kit, size, spp), exposure=1.0)
    inset = None
    if not gallery.kit.quick:
        inset = gallery.detail("car paint", lambda *how: scene(gallery.kit, *how), size, spp, (150, 150, 100, 70), 2, 1.0)
    gallery.save(
        "car-paint",
        picture,
        inset,
        (1, 1),
        title="Metallic paint",
        method="pyramid, trilinear, between a clear coat and a diffuse base",
        alt="A bonnet in red metallic paint under a lamp and a soft light; the inset shows single flakes",
        text="Copper flakes cover a fifth of a red base, under a clear coat of index 1.5: layers of one BSDF. A flake is 72 um wide. "
        "Its colour and its sparkle are those of the flakes below each pixel.",
    )
