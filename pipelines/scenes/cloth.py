"""A cloth over a round table at three distances: its weave is a displacement map, prefiltered to a coarse mesh (Wu 2019, figures 12 and 17)."""

import numpy as np
import PIL.Image

import shapes
from kit import envmap, look_at, point_light, rgb, studio

TEXEL_UM = 15
SIZE = 1024
THREAD_TEXELS = 64
DISTANCE = 70.0
TARGET = (-2.5, -7.0, 7.6)
TOWARDS = (-0.35, -0.80, 0.95)
WIDTHS_CM = (2.0, 8.0, 30.0)
ROOM = studio([(-120, 45, 30, 25, 1.6, (1, 0.97, 0.93)), (20, 35, 15, 30, 1.2, (0.88, 0.94, 1))], floor=0.10, ceiling=0.35)


def cloth(reach=17.0, table=8.0, rows=700, columns=1200):
    """A round cloth over a table of a radius: flat on it, then down in folds. Its uv are those of the cloth before it was laid."""
    s = np.linspace(0.001, reach, rows)[:, None]
    angle = np.linspace(0, 2 * np.pi, columns)
    edge = 1.2  # of the table, rounded
    turn = np.clip((s - table) / edge, 0, 1) * np.pi / 2
    fall = np.maximum(s - table - edge, 0)
    radius = np.minimum(s, table) + edge * 2 / np.pi * np.sin(turn)
    height = 8.2 - edge * 2 / np.pi * (1 - np.cos(turn)) - 0.94 * fall
    folds = 0.5 * (1 - np.cos(np.pi * np.clip((s - table) / (reach - table), 0, 1)))
    wave = np.cos(11 * angle + 0.6 * np.sin(3 * angle)) + 0.3 * np.cos(5 * angle + 1)
    radius = radius + 1.25 * folds * wave + 0.25 * fall
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.broadcast_to(height, radius.shape)], -1)
    uv = np.stack([s * np.cos(angle), s * np.sin(angle)], -1)
    return shapes.Mesh().grid(points, uv, closed=True, flip=True)


def colours(size):
    """A check: threads of two colours along both directions. [size][size][3], sRGB."""
    x = np.arange(size) / size
    stripe = lambda t, at, half: np.abs((t - at + 0.5) % 1 - 0.5) < half
    blue, cream, red = np.array([[0.16, 0.24, 0.42], [0.90, 0.86, 0.76], [0.62, 0.14, 0.12]])
    line = np.where(stripe(x, 0.5, 0.25)[:, None], blue, cream)
    line = np.where(stripe(x, 0.0, 0.03)[:, None], red, line)
    return 0.5 * (line[:, None] + line[None, :])


def asset(kit):
    """The displacement asset and the length of its side."""
    size = SIZE // 4 if kit.quick else SIZE
    image = kit.make(
        "weave",
        "synth",
        None,
        "weave",
        "--height",
        "--size",
        size,
        "--texel-size-um",
        TEXEL_UM,
        "--feature-size",
        THREAD_TEXELS,
        suffix=".exr",
    )
    heights = kit.make(
        "weave", "ingest", image, "--kind", "height", "--to", "heights", "--height-scale-um", 1, "--texel-size-um", TEXEL_UM
    )
    check = kit.folder / f"check.{size}.png"
    PIL.Image.fromarray(np.round(255 * colours(size)).astype(np.uint8)).save(check)
    displaced = kit.make(
        "weave.displaced",
        "displace",
        heights,
        "--factors",
        "8,16,64",
        "--base",
        "diffuse:0.85",
        "--base-color",
        check,
        "--angular",
        11,
    )
    return displaced, size * TEXEL_UM * 1e-4


def scene(kit, width_cm=34.0, size=(480, 360), spp=64):
    if kit.smooth:
        bsdf = {"type": "diffuse", "reflectance": rgb(0.4)}
    else:
        path, side = asset(kit)
        bsdf = {"type": "glint", "asset": str(path), "uv_scale": 1 / side}
    towards = np.array(TOWARDS) / np.linalg.norm(TOWARDS)
    fov = float(2 * np.degrees(np.arctan(0.5 * width_cm / DISTANCE)))
    return {
        "type": "scene",
        "integrator": kit.integrator(4),
        "camera": look_at(np.array(TARGET) + DISTANCE * towards, TARGET, fov, size, spp),
        "cloth": kit.mesh("cloth", cloth()) | {"bsdf": {"type": "twosided", "bsdf": bsdf} if kit.smooth else bsdf},
        "floor": kit.mesh("backdrop", shapes.backdrop()) | {"bsdf": {"type": "diffuse", "reflectance": rgb(0.3)}},
        "lamp": point_light((-45, -30, 55), 9500, (1, 0.95, 0.88)),
        "room": envmap(ROOM),
    }


def draw(gallery):
    size, spp = gallery.scaled((340, 280), 24)
    pixel = lambda width: width / size[0] / (TEXEL_UM * 1e-4)
    sheet = {
        f"{width:g} cm wide: {pixel(width):.2g} texels a pixel": gallery.render(
            f"cloth, {width:g} cm", scene(gallery.kit, width, size, spp)
        )
        for width in WIDTHS_CM
    }
    gallery.sheet(
        "cloth",
        sheet,
        columns=3,
        title="A woven cloth at three distances",
        method="displacement, factors 8, 16 and 64, on a coarse mesh",
        alt="A checked table cloth: threads from near, checks in the middle, folds from afar",
        text="The weave is heights of 1024 x 1024 texels of 15 um. The mesh knows nothing of it: lobes of normals, shadows between the threads and light "
        "that goes from thread to thread are prefiltered, and each pixel takes the level of its footprint.",
    )
