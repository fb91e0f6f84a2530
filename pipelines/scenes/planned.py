"""Three scenes from a plan to a picture: glint-plan chooses, glint.mk builds, glint-plan --check measures, and Mitsuba 3 renders.

Normally run by `make planned`. Writes scenes, plans, assets, pictures, and a page PLANS.md with what was saved against the setting of Deng 2022.
Without Mitsuba, `--no-pictures` takes the scenes of data-samples/ and leaves the pictures out.
"""

import argparse
import json
import pathlib
import resource
import shutil
import subprocess
import sys
import textwrap

import numpy as np

ROOT = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "pipelines"))

import kit as kits  # noqa: E402
import pictures  # noqa: E402
import planned_scenes  # noqa: E402
from machine import machine, machine_text  # noqa: E402

SIZE = 2048  # texels of a map along each axis
UNIT_M = 0.01
SPP, DETAIL_SPP = 16, 8  # of a whole picture, and of a detail
WIDTH = 150  # characters of a line of the page
DIFFERS = 7  # exit code of glint-plan where a plan does not hold
PLANNED, PAPER, EXACT = "planned", "as in the paper", "brute force"


def sample_of(scene):
    return ROOT / f"data-samples/plan_{scene.name}.json"


def question(kit, scene):
    """The scene of glint-plan, from the views of Mitsuba's."""
    import mitsuba as mi
    import mitsuba_scene

    views = [mi.load_dict(scene.description(kit, view, {"type": "diffuse"}, 1)) for view in scene.views]
    side_cm = SIZE * scene.texel_um * 1e-4
    glint = {"asset": f"{scene.name}.exr", "uv_scale": 1 / side_cm, "sigma_r": scene.sigma_r}
    asked = mitsuba_scene.plan_scene(views, mi, scene.tolerance, UNIT_M, {}, {scene.shape: glint})
    if scene.sky:  # its band limit is measured, which needs the image
        asked["lights"] = [{"type": "environment", "image": planned_scenes.SKY}]
    budgets = {"budgets": scene.budgets} if scene.budgets else {}
    return rounded({"schema": asked.pop("schema"), "minimise": scene.minimise, **budgets, **asked})


def rounded(value):
    """Numbers of six digits: those of single precision differ between machines."""
    if isinstance(value, dict):
        return {key: rounded(v) for key, v in value.items()}
    if isinstance(value, list):
        return [rounded(v) for v in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value


class Run:
    """One scene: what is asked, its plan, its assets, and what they are like."""

    def __init__(self, scene, folder, programs):
        self.scene, self.folder, self.bin = scene, folder / scene.name, programs
        self.maps = folder / "maps"
        for path in (self.folder, self.maps):
            path.mkdir(parents=True, exist_ok=True)
        self.kit = kits.Kit(programs, folder / "meshes")

    def tool(self, name, *arguments, expected=(0,)):
        """The result of a program. Another exit code than those expected ends this one."""
        done = subprocess.run(
            [str(self.bin / f"glint-{name}"), *map(str, arguments), "--json", "--quiet"], stdout=subprocess.PIPE
        )
        if done.returncode not in expected:
            sys.exit(f"{self.scene.name}: glint-{name} ended with {done.returncode}")
        return json.loads(done.stdout)["result"] if done.stdout else {}

    def make_maps(self):
        image = self.maps / f"{self.scene.name}.exr"
        self.tool("synth", *self.scene.map, "--size", SIZE, "--seed", 7, "-o", image, "--force")
        if self.scene.sky:
            write_radiance(planned_scenes.sky_image(), self.maps / planned_scenes.SKY)

    def plan(self, asked):
        """Plans and builds. @return (plan, seconds of processor time of the plan, and of Make)"""
        path, plan, rules = (self.folder / name for name in ("scene.json", "plan.json", "plan.mk"))
        path.write_text(json.dumps(asked, indent=1) + "\n")
        start = children_seconds()
        made = self.tool("plan", path, "--maps", self.maps, "-o", plan, "--make", rules, "--force")
        planned = children_seconds()
        shutil.rmtree(self.folder / "assets", ignore_errors=True)
        variables = {"GLINT_BIN": self.bin, "GLINT_MK": ROOT / "pipelines/glint.mk", "GLINT_OUT": self.folder / "assets"}
        subprocess.run(["make", "-s", "-f", rules, *(f"{name}={value}" for name, value in variables.items())], check=True)
        self.asset = self.folder / "assets" / made["materials"][0]["file"]
        return json.loads(plan.read_text()), planned - start, children_seconds() - planned

    def check(self):
        return self.tool("plan", "--check", self.folder / "plan.json", "--paper", expected=(0, DIFFERS))["materials"][0]

    def make_paper(self, programs):
        """Builds the setting of the paper, from the image. @return seconds of processor time"""
        start = children_seconds()
        self.normals = self.paper = self.folder / "paper.normals.glint"
        self.tool("ingest", self.maps / f"{self.scene.name}.exr", "-o", self.normals, "--force")
        for program in programs:
            source, name = self.paper, program["tool"].removeprefix("glint-")
            self.paper = self.folder / f"paper.{name}.glint"
            self.tool(name, source, "-o", self.paper, *program["flags"], "--force")
        return children_seconds() - start


def children_seconds():
    """Processor time of the programs that have run, so that a busy machine measures as an idle one does."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def write_radiance(image, path):
    """Writes an image of light [height][width][3] as Radiance has it: one exponent for three numbers of 8 bits."""
    fraction, exponent = np.frexp(image.max(axis=-1, keepdims=True))
    scale = 256 * fraction / np.maximum(image.max(axis=-1, keepdims=True), 1e-30)
    pixels = np.concatenate([image * scale, exponent + 128], -1)
    path.write_bytes(
        f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {image.shape[0]} +X {image.shape[1]}\n".encode()
        + np.clip(pixels, 0, 255).astype(np.uint8).tobytes()
    )


class Renderer:
    """Renders the views of one scene."""

    def __init__(self, run, gallery):
        scene = self.scene = run.scene
        self.gallery, self.kit = gallery, run.kit
        self.files = {PLANNED: run.asset, PAPER: run.paper, EXACT: run.normals}
        self.map = kits.Map(run.kit, scene.name, SIZE, scene.texel_um * 1e-4, scene.sigma_r, run.normals, run.normals)

    def draw(self, view, title, spp=SPP, crop=None):
        bsdf = self.scene.bsdf(self.kit, self.map, self.files[title])
        description = self.scene.description(self.kit, view, bsdf, spp, crop)
        return self.gallery.render(f"{self.scene.name}, {view}, {title}", description, self.scene.exposure)


def render(run, gallery):
    """One sheet. The plan renders all views, and the paper's setting all but the hardest; a detail of that one is by both and by brute force, to
    which FLIP errors relate. Noise is part of them: samples of other assets go other ways, though random numbers are the same.

    @return (file, [{view, setting, seconds, flip}])
    """
    from models import flip

    scene, renderer = run.scene, Renderer(run, gallery)
    *others, hardest = scene.views
    sheet, notes, figures = {}, {}, []

    def show(view, title, picture, pixels, error=None):
        key = f"{view}: {title}"
        sheet[key] = pixels
        notes[key] = f"{picture.seconds:.2g} s" + (f", FLIP {error:.3f}" if error is not None else "")
        figures.append({"view": view, "setting": title, "seconds": picture.seconds, "flip": error})

    for view, title in [(view, title) for view in others for title in (PLANNED, PAPER)] + [(hardest, PLANNED)]:
        picture = renderer.draw(view, title)
        pixels = picture.srgb()
        show(view, title, picture, pictures.framed(pixels, scene.detail) if view == hardest else pixels)
    details = {title: renderer.draw(hardest, title, DETAIL_SPP, scene.detail) for title in (PLANNED, PAPER, EXACT)}
    larger = planned_scenes.SIZE[0] // scene.detail[2]
    for title, picture in details.items():
        error = None if title == EXACT else flip(details[EXACT].srgb(), picture.srgb())
        show("the detail", title, picture, picture.srgb().repeat(larger, 0).repeat(larger, 1), error)
    file = run.folder / "pictures.png"
    pictures.save(pictures.sheet(sheet, 3 if others else 2, notes), file)
    return file, figures


def caption(entry):
    """What is seen on the sheet, with its figures."""
    figures = entry["pictures"]
    details = {f["setting"]: f for f in figures if f["view"] == "the detail"}
    scene = next(make() for make in planned_scenes.SCENES if make().name == entry["name"])
    seconds = lambda f: f"{f['seconds']:.2g} s"
    by = lambda title: f"{seconds(details[title])}, FLIP {details[title]['flip']:.3f}"
    whole = ", ".join(f"{f['view']} {f['setting']} {seconds(f)}" for f in figures if f["view"] != "the detail")
    width, height = scene.detail[2:]
    return (
        f"Seconds of processor time: {whole}, with {SPP} samples a pixel. The detail, {width} x {height} of the {planned_scenes.SIZE[0]} x "
        f"{planned_scenes.SIZE[1]} pixels with {DETAIL_SPP} samples: {PLANNED} {by(PLANNED)}; {PAPER} {by(PAPER)}; {EXACT} "
        f"{seconds(details[EXACT])}."
    )


def size_text(value):
    return f"{value / 1e6:.3g} MB" if value >= 1e6 else f"{value / 1e3:.3g} kB"


def time_text(nanoseconds):
    return f"{nanoseconds / 1e3:.3g} µs" if nanoseconds >= 1e3 else f"{nanoseconds:.3g} ns"


TABLE_HEAD = [
    "| scene | what | error: asked | predicted | actual | file | to prepare | a density |",
    "|---|---|---|---|---|---|---|---|",
]


def rows_of(entry):
    """Rows of the table: the plan, the paper's setting, and how many times less the plan takes."""
    checked, title = entry["check"], entry["title"]
    planned, actual, paper = checked["predicted"], checked["actual"], checked["paper"]
    costs = lambda c, made_s: f"{size_text(c['bytes'])} | {made_s:.2g} s | {time_text(c['query_ns'])}"
    times = lambda theirs, ours: f"{theirs / ours:.2g} x" if theirs < 100 * ours else f"{theirs / ours:.0f} x"
    return [
        f"| {title} | {checked['asset']} | {checked['tolerance']:g} | {planned['seen']:.2g} | {actual['seen']:.2g} | {costs(actual, entry['make_s'])} |",
        f"| | as in the paper | | | {paper['seen']:.2g} | {costs(paper, entry['paper_s'])} |",
        f"| | **saved** | | | | {times(paper['bytes'], actual['bytes'])} | {times(entry['paper_s'], entry['make_s'])} | "
        f"{times(paper['query_ns'], actual['query_ns'])} |",
    ]


HEAD = """# Plans of three scenes

What `glint-plan` saves against the setting of Deng 2022 (images of 256 x 256 pixels every 32 texels, compressed by CP of rank 16).
`make planned PLANNED_FLAGS='--docs docs'` makes this page: maps of 2048 x 2048 texels by `glint-synth`, scenes from those of Mitsuba by
`pipelines/mitsuba_scene.py`, plans by `glint-plan`, assets by `make -f plan.mk`, figures by `glint-plan --check --paper`, and pictures by Mitsuba, unless
`--no-pictures` is given. The scenes are `data-samples/plan_car.json`, `plan_ring.json` and
`plan_cloth.json`; `pipelines/scenes/planned_scenes.py` has them for Mitsuba.

Errors are [seen errors](METHODS.md#seen-error) in the worst size of footprints that the scene asks. The file is all that queries read: with the normals, where
footprints are smaller than the finest level. There texels answer: such a row is nearly exact, and slow. Times to prepare are processor time, from the
image on; that of a density is processor time of one thread, for questions anywhere on the map. FLIP errors are those of a detail, against brute
force. Part of each is the noise of few samples: the ring's is .05 by the paper's setting, too, where the same texels answer as by brute force.

{machine}
"""


def page(entries, folder=""):
    machines = dict.fromkeys(entry["machine"] for entry in entries)
    lines = [HEAD.format(machine="\n".join(machines)), *TABLE_HEAD]
    for entry in entries:
        lines += rows_of(entry)
    for entry in entries:
        lines += ["", f"## {entry['title']}", ""]
        if entry.get("picture"):
            lines += [
                f"![{entry['title']}: by the plan, and a detail by the plan, by the paper's setting and by brute force]({folder}{entry['picture']})",
                "",
                *([textwrap.fill(caption(entry), WIDTH), ""] if "pictures" in entry else []),
            ]
        plan = entry["plan"]["materials"][0]
        asked = plan["question"]
        lines += [
            textwrap.fill(
                f"Footprints of {asked['smallest_texels']:.3g} to {asked['largest_texels']:.3g} texels, the least "
                f"{ {'bytes': 'bytes', 'query_ns': 'time of a density', 'preparation_s': 'time to prepare'}[entry['minimise']] }. "
                + "".join(f"The budget of {name} is {value:.3g}. " for name, value in entry.get("budgets", {}).items())
                + " ".join(plan["reasons"] + ["Left out: " + text[0].lower() + text[1:] for text in plan["left_out"]])
                + f" The plan took {entry['plan_s']:.0f} s of processor time.",
                WIDTH,
            )
        ]
    return "\n".join(lines) + "\n"


def run_scene(scene, arguments, gallery, old):
    """An entry of the record. @param old  the entry of an earlier run, of which --keep keeps a part; or None"""
    run = Run(scene, arguments.out, arguments.bin.resolve())
    kept = arguments.keep if old else None
    entry = old if kept else new_entry(run, arguments, gallery)
    run.asset, run.paper, run.normals = (run.folder / entry["files"][title] for title in (PLANNED, PAPER, EXACT))
    if kept == "plans":
        entry |= {"machine": machine_text(machine()), "check": run.check()}
    print("\n".join([*TABLE_HEAD, *rows_of(entry)]), flush=True)
    if gallery:
        picture, entry["pictures"] = render(run, gallery)
        entry["picture"] = f"{scene.name}/{picture.name}"
        if arguments.docs:
            to_documents(scene, picture, arguments.docs)
    return entry


def new_entry(run, arguments, gallery):
    """Makes the map, the plan and the assets of a scene, and checks the plan."""
    scene, measured_on = run.scene, machine_text(machine())
    run.make_maps()
    asked = question(run.kit, scene) if gallery else json.loads(sample_of(scene).read_text())
    if arguments.docs and gallery:
        sample_of(scene).write_text(json.dumps(asked, indent=1) + "\n")
    plan, plan_s, make_s = run.plan(asked)
    checked = run.check()
    paper_s = run.make_paper(checked["paper"]["programs"])
    files = {PLANNED: run.asset, PAPER: run.paper, EXACT: run.normals}
    return {
        "name": scene.name,
        "title": scene.title,
        "minimise": scene.minimise,
        "budgets": asked["materials"][0].get("budgets", {}) | asked.get("budgets", {}),
        "machine": measured_on,
        "plan": plan,
        "plan_s": plan_s,
        "make_s": make_s,
        "paper_s": paper_s,
        "files": {title: str(file.relative_to(run.folder)) for title, file in files.items()},
        "check": checked,
    }


def to_documents(scene, picture, docs):
    folder = docs / "pictures/plans"
    folder.mkdir(parents=True, exist_ok=True)
    named = picture.with_name(f"{scene.name}.png")
    named.write_bytes(picture.read_bytes())
    for old in folder.glob(f"{scene.name}.*"):
        old.unlink()
    pictures.for_documents(named, folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, default="build/bin", help="folder of the programs")
    parser.add_argument("--out", type=pathlib.Path, default="planned", help="folder to make")
    parser.add_argument(
        "--only",
        action="append",
        choices=[scene().name for scene in planned_scenes.SCENES],
        help="this scene; may be given again",
    )
    parser.add_argument(
        "--keep",
        choices=["plans", "checks"],
        help="of an earlier run in --out: plans and assets, and with `checks` the figures of the table, too",
    )
    parser.add_argument("--no-pictures", action="store_true", help="without Mitsuba: plans, assets and figures alone")
    parser.add_argument(
        "--docs", type=pathlib.Path, help="also write DOCS/PLANS.md; with pictures also DOCS/pictures/plans and data-samples/"
    )
    parser.add_argument("--variant", default="llvm_ad_rgb", help="of Mitsuba")
    arguments = parser.parse_args()
    gallery = None
    if not arguments.no_pictures:
        from gallery import Gallery

        kits.start_mitsuba(arguments.variant)
        gallery = Gallery(None, arguments.out)
    arguments.out.mkdir(parents=True, exist_ok=True)
    record = arguments.out / "planned.json"
    entries = {entry["name"]: entry for entry in (json.loads(record.read_text()) if record.exists() else [])}
    for scene in [make() for make in planned_scenes.SCENES]:
        if arguments.only and scene.name not in arguments.only:
            continue
        entries[scene.name] = run_scene(scene, arguments, gallery, entries.get(scene.name))
        record.write_text(json.dumps(list(entries.values()), indent=1) + "\n")
    (arguments.out / "PLANS.md").write_text(page(entries.values()))
    if arguments.docs:
        for entry in entries.values():
            entry["picture"] = next((path.name for path in (arguments.docs / "pictures/plans").glob(f"{entry['name']}.*")), "")
        (arguments.docs / "PLANS.md").write_text(page(entries.values(), "pictures/plans/"))
    if wrong := [entry["title"] for entry in entries.values() if not entry["check"]["holds"]]:
        sys.exit("these plans do not hold: " + ", ".join(wrong))


if __name__ == "__main__":
    main()
