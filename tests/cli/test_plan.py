"""glint-plan: the cheapest method for every map of a scene; plans hold; errors name the field of the scene."""

import contextlib
import json
import math
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time

import jsonschema
import pytest
from conftest import BIN, run_all

ROOT = pathlib.Path(__file__).parents[2]
SCHEMAS = ROOT / "docs/json/files"
SAMPLE = ROOT / "data-samples/plan_scene.json"
PLANNED = [ROOT / f"data-samples/plan_{name}.json" for name in ("car", "ring", "cloth")]  # of pipelines/scenes/planned.py
POINT = [{"type": "point"}]
SKY = [{"type": "environment", "band_limit_deg": 40}]
# The question that most tests ask of noise and of brushed metal, so that it is measured once. Bias decides which tolerances moments meet.
ROUGH = {"smallest": 6, "largest": 6, "sigma_r": 0.1}
MOMENTS_HOLD, MOMENTS_ARE_BIASED = 1.8, 0.5


def material(name="flakes.png", smallest=8, largest=16, tolerance=0.3, **more):
    return {"map": name, "footprints": {"smallest_texels": smallest, "largest_texels": largest}, "tolerance": tolerance, **more}


def scene(*materials, lights=POINT, **more):
    return {"schema": "glint-plan scene 1", "lights": lights, "materials": list(materials), **more}


def check_schema(document, name):
    schema = json.loads((SCHEMAS / f"{name}.schema.json").read_text())
    jsonschema.Draft202012Validator(schema).validate(document)


# kind, size, name, seed
MAPS = [
    ("flakes", 128, "flakes", 3),
    ("isotropic", 128, "noise", 4),
    ("brushed", 128, "brushed", 5),
    ("isotropic", 64, "noise64", 4),
    ("brushed", 64, "brushed64", 5),
]
# Flakes under a light that shows each of them.
SHARP = scene(material("flakes.png", 2, 2, 0.1, sigma_r=0.01))


@pytest.fixture(scope="session")
def shared(tmp_path_factory):
    """A folder with small maps, in which measurements of maps are kept: tests that ask the same question share them."""
    folder = tmp_path_factory.mktemp("shared")
    for kind, size, name, seed in MAPS:
        subprocess.run(
            [BIN / "glint-synth", kind, "--size", str(size), "-o", folder / f"{name}.png", "--seed", str(seed)],
            check=True,
            capture_output=True,
        )
    return folder


@pytest.fixture
def plan(glint, shared):
    """plan(scene, *arguments) -> (process, plan or None), in a folder with small maps."""
    for image in shared.glob("*.png"):
        shutil.copy(image, glint.folder)

    def run(document, *arguments):
        (glint.folder / "scene.json").write_text(json.dumps(document))
        output = glint.folder / "plan.json"
        output.unlink(missing_ok=True)
        cache = [] if "--cache" in arguments else ["--cache", shared / "probes"]
        process = glint("plan", "scene.json", "-o", "plan.json", *cache, *arguments)
        return process, json.loads(output.read_text()) if output.exists() else None

    return run


def test_different_questions_have_different_methods(plan):
    wide = material("noise64.png", tolerance=MOMENTS_HOLD, **ROUGH)
    process, point = plan(SHARP)
    assert process.returncode == 0, process.stderr
    process, sky = plan(scene(wide, lights=SKY))
    assert process.returncode == 0, process.stderr
    methods = point["materials"][0]["asset"]["method"], sky["materials"][0]["asset"]["method"]
    assert methods[0] in {"brute force", "bin map"}, "flakes of two texels under a point light are asked exactly"
    assert methods[1] == "moments", "rough noise under a sky is one lobe"
    for sample in SAMPLE, *PLANNED:
        check_schema(json.loads(sample.read_text()), "scene")
    for document in point, sky:
        check_schema(document, "plan")
        check_schema(document["scene"], "scene")
        assert document["materials"][0]["reasons"]


def test_moments_are_refused_where_their_bias_is_too_large(plan):
    process, made = plan(scene(material("noise64.png", tolerance=MOMENTS_ARE_BIASED, **ROUGH), lights=SKY))
    assert process.returncode == 0, process.stderr
    planned = made["materials"][0]
    assert planned["asset"]["method"] != "moments"
    (objection,) = [reason for reason in planned["reasons"] if reason.startswith("moments")]
    bias = float(re.search(r"would be cheaper, but its bias is ([0-9.]+)\.$", objection).group(1))
    assert MOMENTS_ARE_BIASED / 3 < bias < MOMENTS_ARE_BIASED, "the seen error alone would do"
    assert planned["predicted"]["bias"] <= MOMENTS_ARE_BIASED / 3


def test_order_of_harmonics_is_the_smaller_band_limit(plan):
    _, sky = plan(scene(material("noise64.png", tolerance=MOMENTS_HOLD, **ROUGH), lights=SKY))
    assert sky["materials"][0]["question"]["sh_order"] == 360 / SKY[0]["band_limit_deg"], "that of the light"
    _, sharp = plan(SHARP)
    question = sharp["materials"][0]["question"]
    weight = lambda band: math.exp(-((band * question["sigma_r"]) ** 2) / 2)
    assert (
        weight(question["sh_order"]) <= 0.01 < weight(question["sh_order"] - 1)
    ), "that of the facets, whose lobe weighs finer bands by a hundredth"


def test_plan_holds_and_is_checked(plan, glint):
    document = scene(
        material("noise64.png", tolerance=MOMENTS_ARE_BIASED, **ROUGH),
        material("brushed64.png", tolerance=MOMENTS_ARE_BIASED, **ROUGH),
        lights=SKY,
    )
    process, made = plan(document)
    assert process.returncode == 0, process.stderr
    process = glint("plan", "--check", "plan.json", "--json")
    assert process.returncode == 0, process.stdout + process.stderr
    for checked, planned in zip(json.loads(process.stdout)["result"]["materials"], made["materials"]):
        assert checked["holds"] and checked["asset"] == planned["asset"]["name"]
        assert 0 <= checked["actual"]["bias"] <= checked["actual"]["seen"] <= MOMENTS_ARE_BIASED
        # A map this small is its own probe: bytes are those of the probe but for the flags in the record.
        assert checked["actual"]["bytes"] == pytest.approx(planned["predicted"]["bytes"], rel=0.02)
    assert list(glint.folder.glob("*.assets*")) == []


@pytest.mark.parametrize(
    "tolerance, text", [(0.001, "The tolerance of 0.001"), (MOMENTS_ARE_BIASED, "may be bias, is NOT met")]
)
def test_a_plan_that_does_not_hold_ends_with_7(plan, glint, tolerance, text):
    _, made = plan(scene(material("noise64.png", tolerance=MOMENTS_HOLD, **ROUGH), lights=SKY))
    assert made["materials"][0]["asset"]["method"] == "moments"
    made["scene"]["materials"][0]["tolerance"] = tolerance
    (glint.folder / "plan.json").write_text(json.dumps(made))
    process = glint("plan", "--check", "plan.json")
    assert process.returncode == 7
    assert "NOT met" in process.stdout and text in process.stdout


def test_another_map_than_the_planned_one_is_refused(plan, glint):
    plan(scene(material("noise64.png", tolerance=MOMENTS_HOLD, **ROUGH), lights=SKY))
    run_all(glint, "synth isotropic --size 64 -o noise64.png --seed 9")
    process = glint("plan", "--check", "plan.json")
    assert process.returncode == 7
    assert "is not the map that was planned" in process.stderr


def test_rules_build_exactly_the_plan(plan, glint):
    noise = scene(material("noise64.png", tolerance=MOMENTS_HOLD, **ROUGH), lights=SKY)
    process, made = plan(noise, "--make", "plan.mk", "--json")
    assert process.returncode == 0, process.stderr
    assert json.loads(process.stdout)["result"]["materials"][0]["file"] == "noise64.moments.glint"
    make = ["make", "-s", "-f", "plan.mk", f"GLINT_BIN={BIN}", f"GLINT_MK={ROOT}/pipelines/glint.mk"]
    built = subprocess.run(make, cwd=glint.folder, capture_output=True, text=True)
    assert built.returncode == 0, built.stderr
    asset = made["materials"][0]["asset"]
    assert asset["method"] == "moments"
    assert (glint.folder / "assets/noise64.moments.glint").stat().st_size == pytest.approx(
        made["materials"][0]["predicted"]["bytes"], rel=0.02
    )
    info = json.loads(glint("info", "assets/noise64.moments.glint", "--json").stdout)
    assert str(info["result"]["properties"]["finest_level"]) == asset["flags"][asset["flags"].index("--finest") + 1]


def test_jobs_build_exactly_the_plan(plan, glint):
    (glint.folder / "farm").mkdir()
    document = scene(material("noise64.png", tolerance=MOMENTS_ARE_BIASED, **ROUGH), lights=SKY)
    for file, image in ("jobs.json", "noise64.png"), ("farm/jobs.json", "../noise64.png"):
        process, made = plan(document, "--jobs", file)
        assert process.returncode == 0, process.stderr
        jobs = json.loads((glint.folder / file).read_text())
        check_schema(jobs, "jobs")
        assert jobs["jobs"][0]["inputs"] == [image], "files are those that the folder of the jobs sees"
    shutil.copytree(glint.folder / "farm", glint.folder / "other/farm")
    shutil.copy(glint.folder / "noise64.png", glint.folder / "other")
    folder = glint.folder / "other/farm"
    (folder / "assets").mkdir()
    done, files = set(), {"../noise64.png"}
    for job in jobs["jobs"]:
        assert set(job["after"]) <= done and set(job["inputs"]) <= files, "a job comes after those that it needs"
        subprocess.run([BIN / job["command"][0], *job["command"][1:]], cwd=folder, check=True, capture_output=True)
        done.add(job["id"])
        files |= set(job["outputs"])
    size = (folder / jobs["materials"][0]["asset"]).stat().st_size
    assert size == pytest.approx(made["materials"][0]["predicted"]["bytes"], rel=0.02)


def write_sky(path, sun, rows=32):
    """A Radiance picture of light that fades from the zenith down, with or without a pixel of sun."""
    pixels = b""
    for row in range(rows):
        value = 1 + math.cos(math.pi * (row + 0.5) / rows)
        for column in range(2 * rows):
            mantissa, exponent = math.frexp(1000.0 if sun and (row, column) == (4, 9) else value)
            pixels += bytes([int(256 * mantissa)] * 3 + [128 + exponent])
    path.write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {rows} +X {2 * rows}\n".encode() + pixels)


def test_band_limits_of_environments_are_measured(plan, glint):
    write_sky(glint.folder / "soft.hdr", sun=False)
    write_sky(glint.folder / "sun.hdr", sun=True)
    texts = []
    for name in "soft.hdr", "sun.hdr":
        document = scene(material(), lights=[{"type": "environment", "image": name}])
        check_schema(document, "scene")
        (glint.folder / "scene.json").write_text(json.dumps(document))
        process = glint("plan", "scene.json", "--explain")
        assert process.returncode == 0, process.stderr
        texts.append(process.stdout)
    degrees = float(re.search(r"Errors are seen under an environment that changes over ([0-9.]+) degrees", texts[0]).group(1))
    assert degrees > 40, "a sky that fades from the zenith to the ground has a few bands"
    assert "Errors are seen under an environment with sharp lights" in texts[1]


def test_measurements_are_kept(plan, glint, shared):
    document = scene(material("noise64.png", tolerance=MOMENTS_HOLD, **ROUGH), lights=SKY)
    _, first = plan(document)
    name = first["materials"][0]["map"]["hash"] + ".probe.json"
    values = json.loads((shared / "probes" / name).read_text())
    (glint.folder / "probes").mkdir()
    (glint.folder / "probes" / name).write_text(
        json.dumps({key: 0.25 if key.endswith(": seen") else value for key, value in values.items()})
    )
    _, second = plan(document, "--cache", "probes")
    assert second["materials"][0]["predicted"]["seen"] == 0.25, "the kept measurement is used"


@pytest.fixture
def start(glint, shared, monkeypatch):
    """start() -> (process, its folder of assets), a plan that is under way, in a session of its own."""
    scratch = glint.folder / "scratch"
    scratch.mkdir()
    monkeypatch.setenv("TMPDIR", str(scratch))
    shutil.copy(shared / "flakes.png", glint.folder)
    (glint.folder / "scene.json").write_text(json.dumps(SHARP))
    processes = []

    def run():
        command = [BIN / "glint-plan", "scene.json", "--quiet"]
        processes.append(subprocess.Popen(command, cwd=glint.folder, start_new_session=True, stdout=subprocess.DEVNULL))
        folder = scratch / f"glint-plan.assets-{processes[-1].pid}"
        while not list(folder.glob("*.glint")):
            assert processes[-1].poll() is None, "it ended before it was looked at"
            time.sleep(0.002)
        return processes[-1], folder

    yield run
    for process in processes:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_removes_the_assets(start, number):
    process, folder = start()
    process.send_signal(number)
    assert process.wait() == -number
    assert not folder.exists()


def test_assets_of_killed_plans_go_with_the_next_plan_and_those_of_living_ones_stay(start, glint):
    living, kept = start()
    os.killpg(living.pid, signal.SIGSTOP)
    killed, left = start()
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    others = kept.with_name("glint-plan.assets-1")
    others.mkdir()
    (others / "0123abcd-notes.glint").touch()
    assert left.exists()
    assert glint("plan", "scene.json", "--explain").returncode == 0
    assert not left.exists() and kept.exists() and list(others.iterdir()), "only what is surely a dead plan's is removed"
    os.killpg(living.pid, signal.SIGKILL)
    living.wait()
    # Programs that the plan ran hold its lock until they have ended, too.
    for _ in range(20):
        assert glint("plan", "scene.json", "--explain").returncode == 0
        if not kept.exists():
            break
    assert list(kept.parent.iterdir()) == [others]


def test_explanation_is_in_words(plan, glint):
    camera = {"nearest": 2, "farthest": 4, "field_of_view_deg": 40, "columns": 1000}
    (glint.folder / "scene.json").write_text(
        json.dumps(scene({"map": "noise.png", "texel_size_um": 100, "tolerance": 0.2}, camera=camera))
    )
    process = glint("plan", "scene.json", "--explain")
    assert process.returncode == 0, process.stderr
    # 0.5 * 2 * 2 m * tan(20 deg) / 1000 / 100 um
    assert "footprints of 7.28 to 14.6 texels from the camera" in process.stdout
    assert "a point light, which is sharp" in process.stdout


CAMERA = {"nearest": 2, "farthest": 4, "field_of_view_deg": 40, "columns": 1000}


@pytest.mark.parametrize(
    "document, field",
    [
        (scene(material(tolerance=0)), "materials[0].tolerance"),
        (scene(material(tolerance="small")), "materials[0].tolerance"),
        (scene({"map": "flakes.png", "tolerance": 0.1}), "materials[0].footprints"),
        (scene({"map": "flakes.png", "tolerance": 0.1}, camera=CAMERA), "materials[0].texel_size_um"),
        (scene({"map": "flakes.png", "tolerance": 0.1, "texel_size_um": 1e6}, camera=CAMERA), "materials[0].texel_size_um"),
        (scene({"map": "flakes.png", "tolerance": 0.1, "uv_size": 128}, camera=CAMERA), "materials[0].uv_size"),
        (scene(material(), material("missing.png")), "materials[1].map"),
        (scene(material(), material()), "materials[1]"),
        (scene(material(tolerence=0.1)), "materials[0].tolerence"),
        (scene(material(smallest=9, largest=8)), "materials[0].footprints.largest_texels"),
        (scene(material(), lights=[]), "lights"),
        (scene(material(), lights=[{"type": "environment"}]), "lights[0].band_limit_deg"),
        (scene(material(), lights=[{"type": "environment", "image": "missing.exr"}]), "lights[0].image"),
        (scene(material(), lights=[{"type": "environment", "image": "flakes.png"}]), "lights[0].image"),
        (
            scene(material(), lights=[{"type": "environment", "image": "sky.exr", "band_limit_deg": 5}]),
            "lights[0].band_limit_deg",
        ),
        (scene(material(), camera=CAMERA | {"farthest": 1}), "camera.farthest"),
        (scene(material(budgets={"bytes": -1})), "materials[0].budgets.bytes"),
        (scene(material(), minimise="beauty"), "minimise"),
        (scene(material({"file": "flakes.png", "height_scale": 2})), "materials[0].map.height_scale"),
        (scene(), "materials"),
    ],
)
def test_errors_name_the_field(plan, document, field):
    process, made = plan(document)
    assert process.returncode in (2, 3), process.stderr
    assert f"{field}: " in process.stderr and len(process.stderr.splitlines()) == 1
    assert made is None


def test_impossible_plan_names_the_budget_and_the_way_out(plan):
    for budget, most in ("bytes", 100), ("query_ns", 0.01), ("preparation_s", 1e-6):
        process, made = plan(
            scene(material("noise64.png", tolerance=MOMENTS_HOLD, budgets={budget: most}, **ROUGH), lights=SKY)
        )
        assert process.returncode == 4 and made is None
        assert f"materials[0].budgets.{budget}" in process.stderr
        assert f"allow {budget} of" in process.stderr


def test_what_is_over_a_budget_is_not_blamed_for_its_bias(plan):
    noise = scene(material("noise64.png", tolerance=MOMENTS_ARE_BIASED, **ROUGH), lights=SKY)
    least = plan(noise)[1]["materials"][0]
    quickest = plan(noise | {"minimise": "query_ns"})[1]["materials"][0]["asset"]["method"]
    assert least["asset"]["method"] != quickest
    process, made = plan(noise | {"minimise": "query_ns", "budgets": {"bytes": 1.01 * least["predicted"]["bytes"]}})
    assert process.returncode == 0, process.stderr
    (reason,) = [reason for reason in made["materials"][0]["reasons"] if reason.startswith(quickest)]
    assert "would be over a budget" in reason and "bias" not in reason


def test_impossible_total_names_the_sum(plan):
    noise, brushed = (material(name, tolerance=MOMENTS_HOLD, **ROUGH) for name in ("noise64.png", "brushed64.png"))
    process, alone = plan(scene(noise, lights=SKY))
    most = alone["total"]["bytes"] * 1.5
    process, made = plan(scene(noise, brushed, lights=SKY, budgets={"bytes": most}))
    assert process.returncode == 4 and made is None
    assert "budgets" in process.stderr and "together" in process.stderr


@pytest.mark.parametrize(
    "arguments, text",
    [
        ([], "there is nothing to plan"),
        (["scene.json", "--check", "scene.json"], "exclude"),
        (["scene.json", "--sweep"], "--sweep"),
        (["scene.json", "--paper"], "--paper"),
        (["--check", "scene.json"], "is not known here"),
    ],
)
def test_wrong_use_is_refused(glint, arguments, text):
    (glint.folder / "scene.json").write_text(json.dumps(scene(material())))
    process = glint("plan", *arguments)
    assert process.returncode in (1, 3)
    assert text in process.stderr


def test_the_sample_scene_has_a_plan_that_holds(glint):
    process = glint("plan", SAMPLE, "-o", "plan.json", "--make", "plan.mk")
    assert process.returncode == 0, process.stderr
    process = glint("plan", "--check", "plan.json")
    assert process.returncode == 0, process.stdout + process.stderr
