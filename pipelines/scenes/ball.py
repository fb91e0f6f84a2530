"""A ball of flakes on a table, seen from near to far by a camera that zooms and stays where it is."""

import shapes
from kit import envmap, look_at, point_light, rgb, studio

import numpy as np

TEXEL_UM = 10
RADIUS = 5.0
DISTANCE = 60.0  # from the camera to the point it looks at
ROOM = studio([(-110, 40, 25, 20, 2.2, (1, 1, 1)), (20, 30, 12, 30, 1.6, (0.85, 0.92, 1))], floor=0.05, ceiling=0.2)
LIGHTS = (((-32, -46, 48), 7500, (1, 0.97, 0.92)), ((45, -30, 30), 2200, (0.85, 0.92, 1)))
MAP = {"kind": "flakes", "alpha": 0.25, "flake_size": 6}


def direction():
    """From the camera's target to the camera."""
    w = np.array([-0.12, -0.93, 0.36])
    return w / np.linalg.norm(w)


def target():
    """A point of the ball where it glints: half way between the camera and the key light."""
    light = np.array(LIGHTS[0][0]) - [0, 0, RADIUS]
    half = direction() + light / np.linalg.norm(light)
    return np.array([0, 0, RADIUS]) + RADIUS * half / np.linalg.norm(half)


def field_of_view(width_cm):
    return float(2 * np.degrees(np.arctan(0.5 * width_cm / DISTANCE)))


def camera(width_cm, size, spp):
    """Sees a width of the scene at its target."""
    return look_at(target() + DISTANCE * direction(), target(), field_of_view(width_cm), size, spp)


def ball():
    """A ball made of a grid: its uv are centimetres along a meridian and, at the equator, along a parallel."""
    angle = np.linspace(-np.pi / 2, np.pi / 2, 500)
    return np.stack([np.maximum(RADIUS * np.cos(angle), 0), RADIUS + RADIUS * np.sin(angle)], 1)


def scene(kit, width_cm=14.0, size=(320, 320), spp=32, asset=None, bsdf=None, max_depth=3):
    """@param asset  how the map is prepared: Map -> path, by default a pyramid
    @param bsdf   instead of the BSDF glint: Map -> dictionary
    """
    of = kit.map(**MAP, texel_um=TEXEL_UM)
    skin = bsdf(of) if bsdf else kit.metal(of, asset(of) if asset else of.pyramid(), material="Cu")
    return {
        "type": "scene",
        "integrator": kit.integrator(max_depth),
        "camera": camera(width_cm, size, spp),
        "ball": kit.mesh("ball", shapes.lathe(ball(), of.cm, columns=900)) | {"bsdf": skin},
        "floor": kit.mesh("backdrop", shapes.backdrop()) | {"bsdf": {"type": "diffuse", "reflectance": rgb(0.22)}},
        "room": envmap(ROOM, 0.8),
    } | {f"light{k}": point_light(*light) for k, light in enumerate(LIGHTS)}
