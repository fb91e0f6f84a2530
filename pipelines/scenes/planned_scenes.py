"""The scenes of planned.py: a car's bonnet from 20 m to 2 m, a ring in close-up, a silk cloth under a sky. Lengths are centimetres.

Each is a description of Mitsuba for every view. What glint-plan is asked follows from it, by pipelines/mitsuba_scene.py.
"""

import dataclasses
from typing import Callable

import numpy as np

import car_paint
import cloth
import shapes
from kit import envmap, look_at, point_light, rgb, studio

SIZE = (320, 240)  # of a picture, pixels
SKY = "sky.hdr"  # image of the cloth's light, beside the maps


@dataclasses.dataclass
class PlannedScene:
    """One scene, and what its plan may cost."""

    name: str
    title: str
    shape: str  # id of the shape with the map
    map: list  # arguments of glint-synth
    texel_um: float
    sigma_r: float
    tolerance: float
    minimise: str
    views: dict  # title -> camera: (origin, target, degrees across); the last is the hardest
    detail: (
        tuple  # of the hardest view, for brute force: (left, top, width, height), pixels; SIZE is a whole number of them wide
    )
    surroundings: Callable  # kit -> dictionary of all but camera and BSDF
    bsdf: Callable  # (kit, map, asset) -> dictionary
    budgets: dict = dataclasses.field(default_factory=dict)  # as a scene of glint-plan has them
    exposure: float = 1.0
    sky: bool = False  # whether SKY is the only light

    def description(self, kit, view, bsdf, spp, crop=None):
        """The dictionary of Mitsuba. @param crop  a part of the film, whose pixels are those of the whole"""
        parts = self.surroundings(kit)
        parts[self.shape] = parts[self.shape] | {"bsdf": bsdf}
        origin, target, degrees = self.views[view]
        return {
            "type": "scene",
            "integrator": kit.integrator(2),
            "camera": look_at(origin, target, degrees, SIZE, spp, crop=crop),
            **parts,
        }


def along(target, direction, distance):
    """A point at a distance from a target."""
    return np.asarray(target, float) + distance * np.asarray(direction, float) / np.linalg.norm(direction)


CAR = 3.0  # the gallery's bonnet is as wide as 48 cm
CAR_TARGET = CAR * np.array([2.0, -3.0, 0.5])
CAR_EYE = (-0.28, -0.85, 0.46)
CAR_REACH = 56.0  # of the bonnet from the target towards the eye


def car():
    mesh = car_paint.panel()
    mesh.points, mesh.uvs = [CAR * p for p in mesh.points], [CAR * uv for uv in mesh.uvs]
    paint = lambda kit, of, asset: kit.metal(
        of,
        asset,
        material="Cu",
        coat=1.5,
        coat_alpha=0.007,
        base={"type": "diffuse", "reflectance": rgb(0.45, 0.012, 0.010)},
        transparency=0.8,
    )
    surroundings = lambda kit: {
        "bonnet": kit.mesh("planned-bonnet", mesh),
        "sun": {"type": "directional", "direction": [-0.15, -0.55, -0.82], "irradiance": rgb(2.2, 2.1, 1.95)},
        "sky": envmap(car_paint.ROOM),
    }
    views = {f"{metres} m": (along(CAR_TARGET, CAR_EYE, 100 * metres + CAR_REACH), CAR_TARGET, 5.2) for metres in (20, 2)}
    return PlannedScene(
        "car",
        "A car from 20 m to 2 m",
        "bonnet",
        ["flakes", "--alpha", 0.16, "--flake-size", 5],
        20,
        0.02,
        0.3,
        "bytes",
        views,
        (128, 96, 64, 48),
        surroundings,
        paint,
    )


def ring_band(radius=0.95, thickness=0.10, half_width=0.27):
    """A band with a domed outside: its section is an ellipse that is a little square."""
    t = np.linspace(-np.pi, np.pi, 260)
    square = lambda x: np.sign(x) * np.abs(x) ** 0.75
    return np.stack([radius + thickness * square(np.cos(t)), half_width * (1 + square(np.sin(t)))], 1)


def ring():
    texel_um, size = 5, 2048
    band = lambda kit: kit.mesh("planned-ring", shapes.lathe(ring_band(), size * texel_um * 1e-4, columns=1200))
    room = studio(
        [(100, 50, 25, 14, 2.0, (1, 1, 1)), (-60, 35, 18, 25, 1.2, (1, 0.95, 0.9)), (200, 30, 14, 30, 1.0, (0.9, 0.95, 1))],
        floor=0.04,
        ceiling=0.15,
    )
    surroundings = lambda kit: {
        "ring": band(kit),
        "table": {
            "type": "rectangle",
            "to_world": scaled(60),
            "bsdf": {"type": "diffuse", "reflectance": rgb(0.06, 0.065, 0.075)},
        },
        "lamp": point_light((-9, 14, 22), 350, (1, 0.97, 0.92)),
        "room": envmap(room),
    }
    gold = lambda kit, of, asset: kit.metal(of, asset, material="Au")
    target = (0.0, -0.15, 0.25)
    views = {"close-up": (along(target, (-0.25, -0.75, 0.62), 14), target, 10)}
    return PlannedScene(
        "ring",
        "A ring in close-up",
        "ring",
        ["scratches", "--density", 2, "--feature-size", 4, "--slope", 0.3],
        texel_um,
        0.02,
        0.2,
        "query_ns",
        views,
        (70, 132, 64, 48),
        surroundings,
        gold,
        budgets={"bytes": 60e6},
    )


def scaled(factor):
    import mitsuba as mi

    return mi.ScalarTransform4f().scale(factor)


def sky_image():
    """An even sky with a bright, wide cloud in front of the sun, and a dark ground."""
    return studio([(120, 50, 45, 25, 0.8, (1, 0.97, 0.92))], floor=0.12, ceiling=0.45, width=256)


def silk():
    surroundings = lambda kit: {
        "cloth": kit.mesh("planned-cloth", cloth.cloth()),
        "floor": kit.mesh("backdrop", shapes.backdrop()) | {"bsdf": {"type": "diffuse", "reflectance": rgb(0.3)}},
        "sky": envmap(sky_image()),
    }
    thread = lambda kit, of, asset: kit.metal(
        of,
        asset,
        material="none",
        specular_reflectance=rgb(0.55, 0.16, 0.20),
        base={"type": "diffuse", "reflectance": rgb(0.30, 0.03, 0.05)},
        transparency=0.4,
    )
    views = {"a cloth": (along(cloth.TARGET, cloth.TOWARDS, cloth.DISTANCE), cloth.TARGET, 26)}
    return PlannedScene(
        "cloth",
        "Silk under a sky",
        "cloth",
        ["silk", "--feature-size", 16],
        15,
        0.05,
        0.2,
        "bytes",
        views,
        (150, 70, 32, 24),
        surroundings,
        thread,
        exposure=1.5,
        sky=True,
    )


SCENES = (car, ring, silk)
