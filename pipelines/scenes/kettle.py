"""A kettle of brushed steel and a cup beside it, which reflect each other (Deng 2022, figure 10)."""

import numpy as np

import shapes
from kit import envmap, look_at, point_light, rgb, studio

TEXEL_UM = 32
ROOM = studio(
    [(-60, 30, 30, 30, 0.8, (1, 0.97, 0.92)), (140, 25, 12, 40, 1.5, (0.9, 0.95, 1)), (60, 70, 60, 10, 0.8, (1, 1, 1))],
    floor=0.12,
    ceiling=0.38,
)


def body(map_cm):
    profile = shapes.curve(
        [
            (0.01, 0.05),
            (7, 0.0),
            (9.5, 0.25),
            (10.2, 1.4),
            (10.3, 4),
            (9.7, 8),
            (8.5, 12),
            (6.8, 15.2),
            (5.2, 16.6),
            (4.9, 17.0),
        ],
        500,
    )
    return shapes.lathe(profile, map_cm)


def lid(map_cm):
    return shapes.lathe(
        shapes.curve([(5.1, 16.7), (5.15, 17.05), (4.7, 17.5), (3.2, 18.1), (1.5, 18.4), (0.01, 18.5)], 160), map_cm
    )


def knob():
    return shapes.lathe(
        shapes.curve([(0.5, 18.3), (0.55, 18.9), (1.2, 19.3), (1.5, 19.9), (1.2, 20.5), (0.01, 20.7)], 80), 1.0, columns=96
    )


def spout():
    line = shapes.curve([(8.2, 0, 6.6), (11.2, 0, 8.4), (13.2, 0, 11.6), (14.7, 0, 14.4), (16.4, 0, 15.6)], 200)
    t = np.linspace(0, 1, 200)
    radius = 2.6 - 1.75 * t**0.75 + 0.2 * np.clip((t - 0.85) / 0.15, 0, 1) ** 2
    return shapes.tube(line, np.stack([radius, radius], 1), columns=160)


def handle():
    line = shapes.curve(
        [(-7.4, 0, 14.2), (-8.4, 0, 18.0), (-6.4, 0, 23.2), (0, 0, 25.6), (6.4, 0, 23.2), (8.2, 0, 18.4), (7.4, 0, 14.2)], 220
    )
    return shapes.tube(line, (0.95, 0.45), columns=64)


def cup(map_cm):
    profile = shapes.curve(
        [
            (0.01, 0.1),
            (2.6, 0.05),
            (3.3, 0.3),
            (3.7, 2),
            (3.9, 7.6),
            (3.97, 7.9),
            (3.9, 8.08),
            (3.77, 8.08),
            (3.68, 7.9),
            (3.6, 7.3),
            (3.4, 2),
            (2.8, 0.7),
            (0.01, 0.6),
        ],
        1500,
    )
    return shapes.lathe(profile, map_cm, columns=300)


def scene(kit, size=(720, 720), spp=128, max_depth=5, crop=None):
    steel = kit.map("brushed", texel_um=TEXEL_UM, alpha=0.16, streak=600)
    metal = kit.metal(steel, steel.pyramid(), interpolation="trilinear")
    import mitsuba as mi

    def part(name, mesh, bsdf, at=None):
        moved = {"to_world": mi.ScalarTransform4f().translate(list(at))} if at else {}
        return kit.mesh(f"kettle-{name}", mesh) | {"bsdf": bsdf} | moved

    black = {"type": "roughplastic", "diffuse_reflectance": rgb(0.012), "alpha": 0.12}
    return {
        "type": "scene",
        "integrator": kit.integrator(max_depth),
        "camera": look_at((-9, -66, 31), (3.0, 0, 11.6), 30, size, spp, crop=crop),
        "body": part("body", body(steel.cm), metal),
        "lid": part("lid", lid(steel.cm), metal),
        "spout": part("spout", spout(), metal),
        "cup": part("cup", cup(steel.cm), metal, (11.5, -10.0, 0)),
        "knob": part("knob", knob(), black),
        "handle": part("handle", handle(), black),
        "floor": kit.mesh("backdrop", shapes.backdrop()) | {"bsdf": {"type": "diffuse", "reflectance": rgb(0.32, 0.31, 0.30)}},
        "key": point_light((-42, -52, 62), 9000, (1, 0.95, 0.88)),
        "rim": point_light((60, -30, 45), 5000, (0.88, 0.94, 1)),
        "room": envmap(ROOM, 1.0),
    }


def draw(gallery):
    size, spp = gallery.scaled((500, 500), 40)
    picture = gallery.render("kettle", scene(gallery.kit, size, spp), exposure=1.2)
    gallery.save(
        "kettle",
        picture,
        title="A kettle and a cup of brushed steel",
        method="pyramid, trilinear; paths of up to 5 segments",
        alt="A kettle and a cup of brushed metal on a grey table, with streaked highlights",
        text="Kettle, spout and cup reflect each other. Streaks run round the axis, in a map of 2048 x 2048 texels of 32 um, so highlights are drawn out along the "
        "body and break into glints.",
    )
