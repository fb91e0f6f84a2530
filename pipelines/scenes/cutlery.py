"""Used cutlery with scratches on a slate, under a room with windows (Gamboa 2018, figure 13)."""

import numpy as np

import shapes
from kit import envmap, look_at, point_light, rgb, studio

TEXEL_UM = 7
ROOM = studio(
    [
        (80, 42, 11, 20, 0.9, (1, 1, 1.05)),
        (108, 42, 11, 20, 0.9, (1, 1, 1.05)),
        (150, 35, 11, 22, 0.9, (1, 1, 1.05)),
        (-40, 60, 25, 12, 2.0, (1, 0.85, 0.65)),
        (20, 12, 50, 8, 0.8, (0.9, 0.95, 1)),
    ],
    floor=0.10,
    ceiling=0.30,
)
SHEET = lambda t: 0.17 + 0 * t


def by_knots(*rows):
    c = shapes.curve(rows, 2000)  # t grows along it, because knots are far apart in t
    return lambda t: np.interp(t, c[:, 0], c[:, 1])


def rounded(width, head, tail):
    """A width that ends in half ellipses, whose lengths are shares of the whole."""
    arc = lambda x: np.sqrt(1 - np.clip(x, 0, 1) ** 2)
    return lambda t: np.maximum(width(t) * arc((head - t) / head) * arc((t - 1 + tail) / tail), 0.02)


def spoon():
    width = by_knots(
        (0, 1.95), (0.1, 2.0), (0.2, 1.95), (0.28, 1.35), (0.34, 0.55), (0.42, 0.36), (0.7, 0.5), (0.9, 0.85), (1, 0.95)
    )
    rise = by_knots((0, 1.05), (0.13, 0.9), (0.3, 1.0), (0.4, 1.35), (0.6, 1.45), (0.85, 0.7), (1, 0.35))
    bowl = by_knots((0, 0.0), (0.03, 0.25), (0.14, 0.75), (0.26, 0.5), (0.34, 0.05), (0.4, -0.06), (0.9, -0.08), (1, -0.02))
    return shapes.blade(19.0, rounded(width, 0.16, 0.045), rise, bowl, SHEET)


def knife():
    width = by_knots((0, 0.85), (0.1, 0.9), (0.35, 0.98), (0.5, 0.9), (0.545, 0.5), (0.6, 0.55), (0.8, 0.75), (1, 0.86))
    sheet = by_knots((0, 0.06), (0.5, 0.16), (0.56, 0.5), (0.8, 0.6), (1, 0.5))
    return shapes.blade(22.0, rounded(width, 0.09, 0.035), lambda t: 0.35 + 0 * t, lambda t: 0 * t, sheet)


def fork():
    width = by_knots((0, 1.15), (0.06, 1.22), (0.13, 1.1), (0.2, 0.55), (0.27, 0.36), (0.6, 0.46), (0.87, 0.85), (1, 0.95))
    rise = by_knots((0, 0.50), (0.1, 0.55), (0.22, 1.25), (0.5, 1.4), (0.8, 0.7), (1, 0.35))
    bowl = by_knots((0, 0.1), (0.12, 0.16), (0.25, -0.05), (1, -0.04))
    mesh = shapes.blade(14.2, rounded(width, 0.012, 0.06), rise, bowl, SHEET, start=4.8)
    tine = by_knots((0, 0.1), (0.1, 0.14), (0.9, 0.2), (1, 0.2))
    tine_rise = by_knots((0, 1.05), (0.3, 0.66), (0.7, 0.46), (1, 0.50))
    for at in (-0.98, -0.327, 0.327, 0.98):
        shapes.blade(
            5.0,
            rounded(tine, 0.04, 0.01),
            lambda t: tine_rise(t) - 0.02 * abs(at),
            lambda t: 0 * t,
            SHEET,
            rows=200,
            columns=64,
            mesh=mesh,
            offset=at,
        )
    return mesh


def scene(kit, size=(960, 640), spp=128, crop=None):
    import mitsuba as mi

    of = kit.map("scratches", texel_um=TEXEL_UM, density=2, feature_size=4, slope=0.3, sigma_r=0.008)
    metal = kit.metal(of, of.pyramid(), material="Ag")
    t = mi.ScalarTransform4f

    def piece(name, mesh, at, turn):
        return kit.mesh(name, mesh) | {"bsdf": metal, "to_world": t().translate(list(at)) @ t().rotate([0, 0, 1], turn)}

    return {
        "type": "scene",
        "integrator": kit.integrator(4),
        "camera": look_at((-1, -25, 22), (-3.6, 0.9, 0.3), 23, size, spp, crop=crop),
        "spoon": piece("spoon", spoon(), (-8.9, 2.0, 0), -4),
        "fork": piece("fork", fork(), (-9.0, -3.0, 0), 4),
        "knife": piece("knife", knife(), (-10.6, 6.0, 0), -2),
        "table": {
            "type": "rectangle",
            "to_world": t().scale(120),
            "bsdf": {"type": "roughplastic", "diffuse_reflectance": rgb(0.05, 0.054, 0.062), "alpha": 0.4},
        },
        "lamp": point_light((-14, 30, 40), 2600, (1, 0.93, 0.82)),
        "room": envmap(ROOM, 1.0),
    }


def draw(gallery):
    size, spp = gallery.scaled((600, 400), 24)
    picture = gallery.render("cutlery", scene(gallery.kit, size, spp), exposure=1.3)
    gallery.save(
        "cutlery",
        picture,
        title="Scratched cutlery",
        method="pyramid; paths of up to 4 segments",
        alt="A knife, a spoon and a fork on slate, full of fine scratches",
        text="Used cutlery in a room with three windows and a lamp. Scratches are 28 um wide, in a map of 2048 x 2048 texels of 7 um. They show where they mirror "
        "the lamp or a window, and nowhere else.",
    )
