"""Three scenes by plans of glint-plan: planned, built by glint-farm, measured, and rendered beside brute force."""

import json
import time

import numpy as np

import shapes
from kit import envmap, look_at, point_light, studio
from models import flip

SKY = studio([(-90, 60, 180, 30, 0.8, (0.85, 0.92, 1)), (60, 35, 14, 14, 6, (1, 0.95, 0.85))], floor=0.15, ceiling=0.6)
SUN = {"type": "directional", "angular_diameter_deg": 0.5}
COLUMNS = 1920  # of the whole picture, of which a part is shown
SLOWEST_NS = 5000  # of a density
# name -> what is seen and asked. Distances are metres.
SCENES = {
    "car": {
        "title": "a car, 2 to 20 m away", "map": {"kind": "flakes", "texel_um": 50, "alpha": 0.2, "flake_size": 6, "sigma_r": 0.05}, "material": "Cu",
        "camera": {"nearest": 2, "farthest": 20, "field_of_view_deg": 40}, "light": SUN, "tolerance": 0.3, "exposure": 0.8,
    },
    "ring": {
        "title": "a ring, 8 to 10 cm away", "map": {"kind": "brushed", "texel_um": 4, "alpha": 0.12, "streak": 400, "sigma_r": 0.02}, "material": "Au",
        "camera": {"nearest": 0.08, "farthest": 0.1, "field_of_view_deg": 20}, "light": SUN, "tolerance": 0.3, "exposure": 0.6,
    },
    "counter": {
        "title": "a counter under a sky, 1 to 3 m away", "map": {"kind": "isotropic", "texel_um": 60, "alpha": 0.15, "correlation": 5, "sigma_r": 0.02}, "material": "Al",
        "camera": {"nearest": 1, "farthest": 3, "field_of_view_deg": 40}, "light": {"type": "environment", "band_limit_deg": 20}, "tolerance": 0.3, "exposure": 0.7,
    },
}
PAPER = ("--method", "cp", "--rank", 32)  # of Deng 2022, for flakes


class Planned:
    """A scene with its plan, the asset of the plan, and what both cost."""

    def __init__(self, kit, name):
        self.kit, self.name, self.asks = kit, name, SCENES[name]
        self.map = kit.map(**self.asks["map"])
        self.folder = kit.folder / f"planned-{name}-{self.map.size}"
        self.folder.mkdir(exist_ok=True)
        scene, plan, jobs, farm = (self.folder / f"{file}.json" for file in ("scene", "plan", "jobs", "farm"))
        scene.write_text(json.dumps(self.scene_file(), indent=1) + "\n")
        kit.run("plan", scene, "--maps", kit.folder, "-o", plan, "--jobs", jobs, "--cache", self.folder / "probes", "--force")
        self.plan = json.loads(plan.read_text())["materials"][0]
        kit.run("farm plan", "--from", plan, "-o", farm, "--force")
        kit.run("farm run", farm)
        self.asset = self.folder / json.loads(jobs.read_text())["materials"][0]["asset"]
        self.actual = kit.run("plan", "--check", plan)["materials"][0]["actual"]

    def scene_file(self):
        texels = {"map": self.map.normals.name, "texel_size_um": 1e4 * self.map.texel_cm, "sigma_r": self.map.sigma_r, "tolerance": self.asks["tolerance"]}
        return {"schema": "glint-plan scene 1", "budgets": {"query_ns": SLOWEST_NS}, "camera": self.asks["camera"] | {"columns": COLUMNS}, "lights": [self.asks["light"]], "materials": [texels]}

    def costs_of_the_paper(self):
        """Bytes and seconds of the paper's own setting for any scene. Footprints below its finest level need the normals."""
        start = time.perf_counter()
        pyramid = self.map.made("pyramid", "paper", "--sigma-r", self.map.sigma_r)
        asset = self.map.made("compress", "paper-cp", *PAPER, source=pyramid)
        below = self.plan["question"]["smallest_texels"] < 14  # the finest level of stride 32 has 13.9
        return asset.stat().st_size + (self.map.normals.stat().st_size if below else 0), time.perf_counter() - start

    def bsdf(self, brute_force):
        import glint_ndf

        asset = self.map.normals if brute_force else self.asset
        given = {"sigma_r": self.map.sigma_r} if glint_ndf.load(asset).kind in ("normals", "slope-moments") else {}
        given |= {"normals": str(self.map.normals)} if self.plan["asset"]["takes_normals"] and not brute_force else {}
        return {"type": "glint", "asset": str(asset), "uv_scale": 1 / self.map.cm, "material": self.asks["material"], **given}

    def scene(self, size, spp, brute_force=False):
        """The middle of the picture from near, in centimetres."""
        distance = 100 * self.asks["camera"]["nearest"]
        whole = np.radians(self.asks["camera"]["field_of_view_deg"])
        shown = np.degrees(2 * np.arctan(np.tan(whole / 2) * size[0] / COLUMNS))
        wide = 2 * distance * np.tan(np.radians(shown / 2))
        mesh = ring(wide) if self.name == "ring" else shapes.bent_quad(1.6 * wide, 1.2 * wide, 0.4 * wide)
        top = wide if self.name == "ring" else 0.05 * wide
        towards = np.array([0, -0.8, 0.6])
        camera = look_at(np.array([0, 0, top]) + distance * towards, (0, 0, top), shown, size, spp)
        light = {"sky": envmap(SKY)} if self.asks["light"] is not SUN else {"sun": point_light(distance * np.array([-0.3, 0.3, 0.9]), 1.2 * distance**2), "sky": envmap(SKY, 0.05)}
        return {"type": "scene", "integrator": self.kit.integrator(2), "camera": camera, "mesh": self.kit.mesh(f"planned-{self.name}", mesh) | {"bsdf": self.bsdf(brute_force)}} | light


def ring(wide):
    """A band round the x axis: its middle is as wide as half a picture, and three times as far from the axis."""
    angle = np.linspace(0, 2 * np.pi, 600)
    across = np.linspace(-0.5, 0.5, 60)
    radius = 3 * wide * (1 - 0.1 * (2 * across) ** 4)
    points = np.stack(np.broadcast_arrays(0.9 * wide * across[None, :], radius[None, :] * np.sin(angle)[:, None], wide + radius[None, :] * np.cos(angle)[:, None] - 3 * wide), -1)
    return shapes.Mesh().grid(points)


def draw(gallery):
    size, spp = gallery.scaled((270, 200), 16)
    sheet, notes = {}, {}
    table = ["| scene | plan | seen error: predicted, measured, tolerance | bytes | preparation | paper's setting: bytes | preparation |", "|---|---|---|---|---|---|---|"]
    exact = {}
    for name, asks in SCENES.items():
        planned = Planned(gallery.kit, name)
        title = asks["title"]
        sheet[title] = gallery.render(f"planned, {name}", planned.scene(size, spp), asks["exposure"])
        exact[f"brute force: {name}"] = gallery.render(f"planned, {name}, brute force", planned.scene(size, spp, True), asks["exposure"])
        notes[title] = f"{planned.plan['asset']['method']}, FLIP {flip(exact[f'brute force: {name}'].srgb(), sheet[title].srgb()):.3f}"
        bytes_of_paper, seconds_of_paper = planned.costs_of_the_paper()
        predicted, actual = planned.plan["predicted"], planned.actual
        table.append(f"| {title} | {planned.plan['asset']['name']} | {predicted['seen']:.2f}, {actual['seen']:.2f}, {asks['tolerance']:g} | {actual['bytes'] / 1e6:.2f} MB | "
                     f"{actual['preparation_s']:.1f} s | {bytes_of_paper / 1e6:.1f} MB | {seconds_of_paper:.1f} s |")
    gallery.sheet("planned", sheet | exact, columns=3, notes=notes, title="Three scenes, planned", method="as planned; below by the texels", table=table,
                  alt="Flakes on a car, a brushed ring and an aluminium counter, by plans, and below by brute force: no difference is seen",
                  text="`glint-plan` chose the cheapest asset for each scene, `glint-farm` built it, and `glint-plan --check` measured it. The paper's setting, CP of rank 32 of a whole "
                       "pyramid, is the same for every scene; footprints smaller than its finest level need the normals too, which are counted.")
