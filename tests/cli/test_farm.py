"""glint-farm: what it plans, makes, skips and tells, and what it does when programs, disks and clocks fail."""

import errno
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time

import jsonschema
import pytest
from conftest import BIN

ROOT = pathlib.Path(__file__).parents[2]
SCHEMAS = ROOT / "docs/json/files"
PYRAMID = "pyramid --resolution 64 --sigma-r 0.02 --stride 16"
KILLED = 128 + signal.SIGKILL
# Long enough for a program of a small map on a busy machine.
PATIENCE_S = 60


def check_schema(document, name):
    jsonschema.Draft202012Validator(json.loads((SCHEMAS / f"{name}.schema.json").read_text())).validate(document)


@pytest.fixture(scope="module")
def maps(tmp_path_factory):
    """Three maps of 64^2, and one of 512^2, whose programs take a while."""
    folder = tmp_path_factory.mktemp("maps")
    for name, kind, size in (("a", "flakes", 64), ("b", "isotropic", 64), ("c", "brushed", 64), ("large", "flakes", 512)):
        subprocess.run([BIN / "glint-synth", kind, "--size", str(size), "-o", folder / f"{name}.png"], check=True)
    return folder


@pytest.fixture
def farm(glint, maps):
    """farm("run", ...) runs a command in a folder with a.png, b.png and c.png in `maps`."""
    (glint.folder / "maps").mkdir()
    for name in "abc":
        shutil.copy(maps / f"{name}.png", glint.folder / "maps")

    def run(*arguments):
        return glint("farm", *arguments)

    run.folder = glint.folder
    return run


def result(process, code=0):
    assert process.returncode == code, process.stderr
    return json.loads(process.stdout)["result"]


def plan(farm, *makes, source=("maps",), code=0):
    process = farm("plan", *source, "-o", "farm.json", *(word for make in makes for word in ("--make", make)), "--json")
    return result(process, code)


def manifest(farm):
    return json.loads((farm.folder / "farm.json").read_text())


def log(farm, name="farm.json.log"):
    return [json.loads(line) for line in (farm.folder / name).read_text().splitlines()]


def run(farm, *arguments, code=0):
    return result(farm("run", "farm.json", "--json", *arguments), code)


def contents(folder):
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.suffix == ".glint"
    }


def leftovers(folder):
    return [path for path in folder.rglob("*.tmp")]


def damage(path):
    """Changes one byte in the middle of a file, in place."""
    with open(path, "r+b") as file:
        file.seek(path.stat().st_size // 2)
        byte = file.read(1)
        file.seek(-1, os.SEEK_CUR)
        file.write(bytes([byte[0] ^ 1]))


# Plans.


def test_a_plan_has_every_asset_once_and_what_it_is_made_of(farm):
    assert plan(farm, PYRAMID, "cp", "sat --bins 6x20") == {
        "maps": 3,
        "hashed_maps": 3,
        "entries": 12,
        "duplicates": 0,
        "done": 0,
    }
    document = manifest(farm)
    check_schema(document, "farm-manifest")
    by_output = {entry["output"]: entry for entry in document["entries"]}
    assert set(by_output) == {f"assets/{name}{kind}.glint" for name in "abc" for kind in ("", ".pyramid", ".cp", ".sat")}
    compressed = by_output["assets/a.cp.glint"]
    assert compressed["command"] == [
        "glint-compress",
        "assets/a.pyramid.glint",
        "-o",
        "assets/a.cp.glint",
        "--method",
        "cp",
        "--rank",
        "16",
    ]
    assert compressed["after"] == [by_output["assets/a.pyramid.glint"]["key"]]
    assert by_output["assets/a.glint"]["inputs"] == ["maps/a.png"]


def test_hashes_are_kept_and_a_changed_map_is_read_again(farm):
    plan(farm, "normals")
    keys = {entry["output"]: entry["key"] for entry in manifest(farm)["entries"]}
    assert plan(farm, "normals")["hashed_maps"] == 0
    shutil.copy(farm.folder / "maps/b.png", farm.folder / "maps/a.png")
    assert plan(farm, "normals") == {"maps": 3, "hashed_maps": 1, "entries": 2, "duplicates": 1, "done": 0}
    assert {entry["key"] for entry in manifest(farm)["entries"]} == {keys["assets/b.glint"], keys["assets/c.glint"]}


def test_keys_change_with_flags_and_not_with_names(farm):
    def keys(*makes):
        plan(farm, *makes)
        return [entry["key"] for entry in manifest(farm)["entries"]]

    first = keys("normals", PYRAMID)
    assert not set(first) & set(keys("normals --convention directx", PYRAMID)), "what it is made of counts"
    other = keys(PYRAMID + " --precision float")
    assert set(first) & set(other) == set(keys("normals"))
    for name in "abc":
        (farm.folder / f"maps/{name}.png").rename(farm.folder / f"maps/other_{name}.png")
    assert keys("normals", PYRAMID) == first


def test_duplicates_are_made_once_and_have_all_their_names(farm):
    (farm.folder / "maps/more").mkdir()
    shutil.copy(farm.folder / "maps/a.png", farm.folder / "maps/more/twin.png")
    assert plan(farm, PYRAMID)["duplicates"] == 2
    assert run(farm)["made"] == 6
    for kind in ("", ".pyramid"):
        one, two = farm.folder / f"assets/a{kind}.glint", farm.folder / f"assets/more/twin{kind}.glint"
        assert one.samefile(two)
    (farm.folder / "assets/more/twin.glint").unlink()
    assert run(farm)["unchanged"] == 1, "a name that is lost comes back without work"
    assert (farm.folder / "assets/more/twin.glint").exists()


def test_flags_and_names_are_those_of_the_rules_for_make(farm):
    """The commands of a plan are those that glint.mk would run."""
    kinds = ["pyramid", "cp", "tucker", "pca", "binmap", "sat", "moments", "tiny", "wang", "heights", "wave", "wavecp", "displaced"]
    plan(farm, *kinds)
    makefile = f"GLINT_MAPS := maps\nGLINT_OUT := assets\ninclude {ROOT}/pipelines/glint.mk\nall: {' '.join(f'assets/a.{kind}.glint' for kind in kinds)}\n"
    (farm.folder / "Makefile").write_text(makefile)
    dry = subprocess.run(["make", "-n", "all"], cwd=farm.folder, capture_output=True, text=True, check=True).stdout.replace(
        "\\\n", ""
    )
    words = lambda line: {word for word in line.replace("'", "").split() if word != "--quiet"} - {"--depfile"}
    rules = [
        {word for word in words(line) if not word.endswith(".glint.d")}
        for line in dry.splitlines()
        if line.startswith("glint-")
    ]
    planned = [set(entry["command"]) for entry in manifest(farm)["entries"] if entry["output"].startswith("assets/a.")]
    key = lambda words: sorted(words)
    assert sorted(planned, key=key) == sorted(rules, key=key)


def test_a_plan_of_glint_plan_and_its_jobs_are_the_same_entries(farm):
    scene = {
        "schema": "glint-plan scene 1",
        "lights": [{"type": "environment", "band_limit_deg": 60}],
        "materials": [
            {"map": "a.png", "footprints": {"smallest_texels": 4, "largest_texels": 4}, "sigma_r": 0.1, "tolerance": 9}
        ],
    }
    (farm.folder / "maps/scene.json").write_text(json.dumps(scene))
    command = [BIN / "glint-plan", "maps/scene.json", "-o", "plans.json", "--jobs", "jobs.json"]
    subprocess.run(command, cwd=farm.folder, check=True)
    plan(farm, source=("--from", "plans.json"))
    first = manifest(farm)["entries"]
    plan(farm, source=("--from", "jobs.json"))
    assert manifest(farm)["entries"] == first
    assert run(farm)["failed"] == 0
    asset = json.loads((farm.folder / "jobs.json").read_text())["materials"][0]["asset"]
    assert subprocess.run([BIN / "glint-validate", farm.folder / asset]).returncode == 0
    (farm.folder / "elsewhere").mkdir()
    moved = farm("plan", "--from", "plans.json", "-o", "elsewhere/farm.json")
    assert moved.returncode == 0, moved.stderr
    assert json.loads((farm.folder / "elsewhere/farm.json").read_text())["maps"][0]["file"] == "../maps/a.png"


def test_percent_stands_for_the_map_and_files_in_flags_are_inputs(farm):
    (farm.folder / "colours").mkdir()
    for name in "abc":
        shutil.copy(farm.folder / f"maps/{name}.png", farm.folder / f"colours/{name}.png")
    makes = ["heights", "displaced --base-color colours/%.png --factor 16"]
    plan(farm, *makes)
    entry = next(entry for entry in manifest(farm)["entries"] if entry["output"] == "assets/a.displaced.glint")
    assert entry["inputs"] == ["assets/a.heights.glint", "colours/a.png"]
    shutil.copy(farm.folder / "colours/b.png", farm.folder / "colours/a.png")
    plan(farm, *makes)
    changed = next(other for other in manifest(farm)["entries"] if other["output"] == "assets/a.displaced.glint")
    assert changed["key"] != entry["key"]


def test_pyramids_in_shards_are_those_of_one_run(farm):
    makes = (f"{PYRAMID} --keep-normals i16", "cp --rank 4")
    plan(farm, *makes)
    run(farm)
    whole = contents(farm.folder / "assets")
    shutil.rmtree(farm.folder / "assets")
    assert plan(farm, *makes, source=("maps", "--map-shards", "3"))["entries"] == 3 * (1 + 3 + 1 + 1)
    check_schema(manifest(farm), "farm-manifest")
    assert run(farm, "--jobs", "2")["entries"] == 18
    parts = contents(farm.folder / "assets")
    assert {name: parts[name] for name in whole} == whole
    assert sorted(set(parts) - set(whole))[:3] == [f"a.pyramid.{i}of3.glint" for i in (1, 2, 3)]
    (farm.folder / "assets/b.pyramid.2of3.glint").unlink()
    (farm.folder / "assets/b.pyramid.glint").unlink()
    run(farm)
    assert contents(farm.folder / "assets") == parts


@pytest.mark.parametrize(
    "words, told",
    [
        (["plan", "-o", "m.json"], "nothing to plan"),
        (["plan", "maps", "-o", "m.json"], "--make pyramid"),
        (["plan", "maps", "-o", "m.json", "--make", "pyramyd"], "did you mean pyramid?"),
        (["plan", "maps", "-o", "m.json", "--make", "cp", "--make", "cp --rank 4"], "in one --make"),
        (["plan", "maps", "--from", "maps/a.png", "-o", "m.json"], "exclude each other"),
        (["plan", "--from", "maps/a.png", "-o", "m.json", "--make", "cp"], "leave out --make"),
        (["plan", "--from", "maps/a.png", "-o", "m.json", "--map-shards", "2"], "leave out --make"),
        (["plan", "maps", "-o", "m.json", "--make", "cp", "--map-shards", "2000"], "--map-shards"),
        (["plan", "--from", "maps/a.png", "-o", "m.json"], "glint-plan SCENE"),
        (["plan", ".", "-o", "maps/a.png", "--make", "cp"], "--force"),
        (["run", "maps/a.png"], "glint-farm plan"),
        (["run", "none.json"], "No such file"),
        (["status", "none.json"], "No such file"),
        ([], "give plan, run or status"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_mistakes_are_told_with_what_to_do(farm, words, told):
    process = farm(*words)
    assert process.returncode in (1, 2, 3)
    assert told in process.stderr and process.stderr.count("\n") == 1
    assert not (farm.folder / "m.json").exists()


def test_a_folder_without_images_and_twins_are_errors(farm):
    (farm.folder / "empty").mkdir()
    process = farm("plan", "empty", "-o", "m.json", "--make", "cp")
    assert process.returncode == 2 and "holds no image" in process.stderr
    shutil.copy(farm.folder / "maps/a.png", farm.folder / "maps/a.tif")
    process = farm("plan", "maps", "-o", "m.json", "--make", "cp")
    assert process.returncode == 1 and "a.png" in process.stderr and "a.tif" in process.stderr


@pytest.mark.parametrize(
    "change, told",
    [
        (lambda m: m["entries"][0]["command"].__setitem__(0, "../../bin/sh"), "runs no program of glint"),
        (lambda m: m["entries"][0]["after"].append(m["entries"][0]["key"]), "does not come before it"),
        (lambda m: m["entries"].append(m["entries"][0]), "two entries have the key"),
        (lambda m: m["entries"][0].pop("links"), "lacks a part"),
        (lambda m: m.__setitem__("generator", "glint-farm 0.0.1"), "planned for version 0.0.1"),
    ],
)
def test_a_manifest_that_was_changed_is_refused(farm, change, told):
    plan(farm, "normals")
    document = manifest(farm)
    change(document)
    (farm.folder / "farm.json").write_text(json.dumps(document))
    process = farm("run", "farm.json")
    assert process.returncode in (3, 5) and told in process.stderr
    assert not (farm.folder / "assets").exists()


def test_only_options_that_take_files_name_files(farm):
    """A number is a number, also where a file has its name."""
    for name in ("16", "0x0", "colour.png"):
        shutil.copy(farm.folder / "maps/a.png", farm.folder / name)
    plan(farm, "cp --rank 16", "displaced --base-color=colour.png --factor 16", "moments --roughness .5")
    by_output = {entry["output"]: entry for entry in manifest(farm)["entries"]}
    assert by_output["assets/a.cp.glint"]["inputs"] == ["assets/a.pyramid.glint"]
    assert by_output["assets/a.cp.glint"]["command"][-2:] == ["--rank", "16"]
    assert by_output["assets/a.moments.glint"]["inputs"] == ["assets/a.glint"]
    displaced = by_output["assets/a.displaced.glint"]
    assert displaced["inputs"] == ["assets/a.heights.glint", "colour.png"]
    assert displaced["command"][-4:] == ["--base-color", "colour.png", "--factor", "16"]
    plan(farm, "moments --roughness=colour.png")
    assert next(entry for entry in manifest(farm)["entries"] if "moments" in entry["output"])["inputs"] == [
        "assets/a.glint",
        "colour.png",
    ]


@pytest.mark.parametrize(
    "flags, told",
    [
        *(
            (flag, flag.split()[0].split("=")[0])
            for flag in (
                "--threads 2",
                "--progress json",
                "--json",
                "--quiet",
                "-q",
                "-v",
                "--max-memory=1G",
                "--depfile d",
                "--textures .",
                "-o x.glint",
                "--output=x.glint",
                "-fq",
                "--help",
            )
        ),
        ("--roughness none.png", "none.png"),
        ("--config", "the file of --config is missing"),
    ],
)
def test_flags_that_the_farm_cannot_have_are_refused(farm, flags, told):
    process = farm("plan", "maps", "-o", "m.json", "--make", f"moments {flags}")
    assert process.returncode in (1, 2) and told in process.stderr and process.stderr.count("\n") == 1
    assert "internal" not in process.stderr and not (farm.folder / "m.json").exists()


@pytest.mark.parametrize("name", [b"\xff.png", b"a\nb.png", b"\xff/a.png"])
def test_names_that_manifests_cannot_hold_are_refused(farm, name):
    path = os.path.join(os.fsencode(farm.folder / "maps"), name)
    os.makedirs(os.path.dirname(path), exist_ok=True)
    shutil.copy(farm.folder / "maps/a.png", os.fsdecode(path))
    process = farm("plan", "maps", "-o", "m.json", "--make", "normals")
    assert process.returncode == 2 and "is not UTF-8, or holds a control character" in process.stderr
    assert not (farm.folder / "m.json").exists()


def test_a_map_may_have_the_name_of_an_option(farm):
    shutil.copy(farm.folder / "maps/a.png", farm.folder / "--json.png")
    shutil.rmtree(farm.folder / "maps")
    plan(farm, "sat", source=(".", "--assets", "."))
    assert {entry["output"] for entry in manifest(farm)["entries"]} == {"./--json.glint", "./--json.sat.glint"}
    assert run(farm)["made"] == 2


DEEP = "[" * 200_000 + "]" * 200_000


def test_deep_json_is_no_manifest_and_no_plan(farm):
    for name in ("farm.json", "jobs.json"):
        (farm.folder / name).write_text('{"schema": ' + DEEP + "}")
    for words in (("run", "farm.json"), ("status", "farm.json"), ("plan", "--from", "jobs.json", "-o", "m.json")):
        assert farm(*words).returncode == 3


def test_lines_of_another_form_are_left_out(farm):
    plan(farm, "normals")
    run(farm)
    key = manifest(farm)["entries"][0]["key"]
    lines = [DEEP, '{"key": ' + DEEP + "}", "null"]
    lines += [
        json.dumps({"key": key, "output": "assets/a.glint", **odd})
        for odd in (
            {"status": 5},
            {"wall_s": "long"},
            {"peak_bytes": None},
            {"status": "failed", "error": 5},
            {"status": "failed", "error": {"rule": 5}},
            {"files": 5},
            {"files": [{"file": "assets/a.glint", "size_bytes": 1, "mtime_ns": 1, "inode": 1}, {}]},
        )
    ]
    for name in ("farm.json.log", "farm.json.hashes"):
        with open(farm.folder / name, "a") as file:
            file.writelines(line + "\n" for line in lines)
    assert result(farm("status", "farm.json", "--json"))["done"] == 3
    assert run(farm)["known"] == 3
    assert plan(farm, "normals")["hashed_maps"] == 0


@pytest.mark.parametrize(
    "change, told",
    [
        (lambda entry, other: entry["command"].extend(["--convention", "directx"]), "was changed by hand"),
        (lambda entry, other: entry["inputs"].clear(), "was changed by hand"),
        (lambda entry, other: entry.__setitem__("output", "other.glint"), "was changed by hand"),
        (lambda entry, other: entry.__setitem__("output", other["output"]), "two entries make"),
        (lambda entry, other: entry["links"].append(other["output"]), "two entries make"),
    ],
)
def test_an_entry_that_was_changed_by_hand_is_refused(farm, change, told):
    plan(farm, "normals")
    document = manifest(farm)
    change(document["entries"][0], document["entries"][1])
    (farm.folder / "farm.json").write_text(json.dumps(document))
    for command in ("run", "status"):
        process = farm(command, "farm.json")
        assert process.returncode == 3 and told in process.stderr


# Runs.


def test_a_run_makes_what_the_programs_make_and_a_second_finds_it(farm):
    plan(farm, PYRAMID)
    first = run(farm, "--log", "run.jsonl")
    assert (first["made"], first["failed"], first["known"]) == (6, 0, 0)
    assert first["peak_bytes"] > 1 << 20 and first["cpu_s"] > 0
    subprocess.run([BIN / "glint-ingest", "maps/a.png", "-o", "alone.glint"], cwd=farm.folder, check=True)
    assert (farm.folder / "alone.glint").read_bytes() == (farm.folder / "assets/a.glint").read_bytes()
    before = contents(farm.folder / "assets")
    stamps = {path: path.stat().st_mtime_ns for path in (farm.folder / "assets").glob("*.glint")}
    assert run(farm, "--log", "run.jsonl")["known"] == 6
    assert stamps == {path: path.stat().st_mtime_ns for path in stamps}
    assert contents(farm.folder / "assets") == before
    assert plan(farm, PYRAMID)["done"] == 6
    lines = log(farm, "run.jsonl")
    for line in lines + log(farm):
        check_schema(line, "farm-log")
    assert [line["status"] for line in lines] == ["made"] * 6 + ["known"] * 6
    assert farm("run", "farm.json").stdout == ""


def test_the_number_of_programs_at_once_does_not_show_in_the_assets(farm):
    plan(farm, PYRAMID, "cp")
    run(farm, "--jobs", 3)
    first = contents(farm.folder / "assets")
    shutil.rmtree(farm.folder / "assets")
    run(farm)
    assert contents(farm.folder / "assets") == first and len(first) == 9


def test_assets_that_others_made_are_found_without_work(farm):
    """No records: programs look at the assets."""
    plan(farm, PYRAMID)
    run(farm)
    (farm.folder / "farm.json.log").unlink()
    assert run(farm)["unchanged"] == 6
    assert run(farm)["known"] == 6


def test_shards_are_the_whole_and_do_not_overlap(farm):
    plan(farm, PYRAMID)
    for index in (1, 2):
        run(farm, "--shard", f"{index}/2", "--log", f"{index}.jsonl")
    outputs = [{line["output"] for line in log(farm, f"{index}.jsonl")} for index in (1, 2)]
    assert not outputs[0] & outputs[1] and len(outputs[0] | outputs[1]) == 6
    assert run(farm)["known"] == 6
    assert run(farm, "--shard", "9/9")["entries"] == 0
    for wrong in ("0/2", "3/2", "1", "1/2x", "-1/2", "1/0", "1/4294967297", "1/", "/2", "1/2/3", "1.0/2"):
        assert farm("run", "farm.json", "--shard", wrong).returncode == 1


def test_status_counts_and_gives_reasons(farm):
    plan(farm, PYRAMID)
    (farm.folder / "maps/b.png").write_text("no image")
    plan(farm, PYRAMID)
    status = lambda: result(farm("status", "farm.json", "--json"))
    assert status()["to_make"] == 6
    made = run(farm, code=4)
    assert (made["made"], made["failed"], made["not_made"]) == (4, 1, 1)
    now = status()
    assert (now["done"], now["failed"], now["not_made"], now["to_make"]) == (4, 1, 1, 0)
    assert now["failures"][0]["output"] == "assets/b.glint" and now["failures"][0]["rule"].startswith("image.")
    assert now["bytes"] == sum(len(data) for data in contents(farm.folder / "assets").values())
    assert "4 of 6 assets are done; 1 failed" in farm("status", "farm.json").stdout
    (farm.folder / "assets/a.glint").write_bytes(b"")
    assert status()["changed"] == 1


def test_the_log_is_another_file_than_the_records(farm):
    plan(farm, "normals")
    process = farm("run", "farm.json", "--log", "farm.json.log")
    assert process.returncode == 1 and "name another file" in process.stderr
    (farm.folder / "mine.txt").write_text("mine")
    process = farm("run", "farm.json", "--log", "mine.txt")
    assert process.returncode == 1 and "--force" in process.stderr
    assert (farm.folder / "mine.txt").read_text() == "mine"


# Faults.


def test_a_missing_map_is_told_and_the_others_are_made(farm):
    plan(farm, PYRAMID)
    (farm.folder / "maps/b.png").unlink()
    process = farm("run", "farm.json", "--retries", 1)
    assert process.returncode == 4
    assert "maps/b.png: No such file" in process.stderr
    failed = [line for line in log(farm) if line["status"] == "failed"]
    assert [(line["error"]["rule"], line["tries"]) for line in failed] == [("input.exists", 2)]
    assert len(contents(farm.folder / "assets")) == 4


def test_a_map_that_changed_since_the_plan_is_not_made(farm):
    plan(farm, "normals")
    run(farm)
    shutil.copy(farm.folder / "maps/b.png", farm.folder / "maps/a.png")
    process = farm("run", "farm.json")
    assert process.returncode == 4 and "run glint-farm plan again" in process.stderr
    assert result(farm("status", "farm.json", "--json"))["failures"][0]["rule"] == "farm.map_changed"
    plan(farm, "normals")
    assert run(farm)["failed"] == 0
    assert (farm.folder / "assets/a.glint").samefile(farm.folder / "assets/b.glint")


def test_a_map_that_is_no_longer_the_twin_of_another_is_told(farm):
    shutil.copy(farm.folder / "maps/a.png", farm.folder / "maps/b.png")
    assert plan(farm, "normals")["duplicates"] == 1
    run(farm)
    shutil.copy(farm.folder / "maps/c.png", farm.folder / "maps/b.png")
    process = farm("run", "farm.json")
    assert process.returncode == 4 and "maps/b.png" in process.stderr and "run glint-farm plan again" in process.stderr
    error = next(line["error"] for line in log(farm) if line["status"] == "failed")
    assert (error["rule"], error["path"]) == ("farm.map_changed", "maps/b.png"), "the one that has changed, not the first"


def test_a_damaged_asset_is_made_again(farm):
    plan(farm, PYRAMID)
    run(farm)
    good = contents(farm.folder / "assets")
    damage(farm.folder / "assets/a.pyramid.glint")
    assert run(farm)["made"] == 1
    assert contents(farm.folder / "assets") == good


@pytest.mark.parametrize("progress", [("--progress", "json"), ("-v",)])
def test_progress_goes_on_after_warnings(farm, progress):
    for path in (farm.folder / "maps").iterdir():
        path.unlink()
    for number in range(40):
        (farm.folder / f"maps/{number}.png").write_text(f"no image {number}")
    plan(farm, "normals")
    process = farm("run", "farm.json", "--retries", 0, "--jobs", 2, *progress)
    assert process.returncode == 4, process.stderr
    assert process.stderr.count("was not made") == 40
    if "json" in progress:
        seen = [json.loads(line)["progress"]["done"] for line in process.stderr.splitlines() if line.startswith("{")]
        assert seen[-1] == 40 and seen == sorted(seen)


def test_a_map_that_is_overwritten_in_place_is_seen(farm):
    """Size, time and inode stay."""
    plan(farm, "normals")
    run(farm)
    path = farm.folder / "maps/a.png"
    stamp = path.stat()
    damage(path)
    os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert path.stat().st_ino == stamp.st_ino and path.stat().st_size == stamp.st_size
    assert result(farm("status", "farm.json", "--json"))["changed"] == 1
    assert run(farm, code=4)["failed"] == 1
    assert plan(farm, "normals")["done"] == 2


def test_a_map_that_cannot_be_read_is_the_fault_of_its_entry_alone(farm):
    plan(farm, "normals")
    run(farm)
    (farm.folder / "maps/b.png").unlink()
    (farm.folder / "maps/b.png").symlink_to("/proc/self/mem")
    status = lambda: result(farm("status", "farm.json", "--json"))
    assert (status()["done"], status()["changed"]) == (2, 1)
    made = run(farm, "--retries", 0, code=4)
    assert (made["known"], made["failed"]) == (2, 1) and "maps/b.png" in made["failures"][0]["message"]
    assert (status()["done"], status()["failed"]) == (2, 1)


def test_what_trust_leaves_alone_is_not_recorded(farm):
    plan(farm, "normals")
    run(farm)
    (farm.folder / "farm.json.log").unlink()
    path = farm.folder / "assets/a.glint"
    good = path.read_bytes()
    damage(path)
    assert run(farm, "--trust", "--log", "run.jsonl")["unchanged"] == 3
    assert len(log(farm, "run.jsonl")) == 3
    trusted = run(farm)
    assert (trusted["made"], trusted["unchanged"]) == (1, 2)
    assert path.read_bytes() == good


def test_a_duplicate_takes_no_name_of_another_file(farm):
    shutil.copy(farm.folder / "maps/a.png", farm.folder / "maps/b.png")
    plan(farm, "normals")
    (farm.folder / "assets").mkdir()
    (farm.folder / "assets/b.glint").write_text("mine")
    process = farm("run", "farm.json", "--retries", 0)
    assert process.returncode == 4 and "assets/b.glint" in process.stderr and "not a file of the kind" in process.stderr
    assert (farm.folder / "assets/b.glint").read_text() == "mine"
    (farm.folder / "assets/b.glint").unlink()
    assert run(farm)["failed"] == 0


def test_a_finished_asset_may_be_read_only(farm):
    plan(farm, "normals", "sat")
    run(farm)
    for path in (farm.folder / "assets").glob("*.glint"):
        path.chmod(0o444)
    assert run(farm, "--check")["unchanged"] == 6
    plan(farm, "normals", "sat --bins 6x20")
    process = farm("run", "farm.json", "--retries", 0)
    assert process.returncode == 4 and process.stderr.count("read-only") == 3, "other assets do not take their place"


def test_a_damage_that_stamps_do_not_show_is_found_by_check(farm):
    plan(farm, PYRAMID)
    run(farm)
    path = farm.folder / "assets/a.pyramid.glint"
    good, stamp = path.read_bytes(), path.stat()
    damage(path)
    os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert run(farm)["known"] == 6
    checked = run(farm, "--check")
    assert (checked["made"], checked["unchanged"]) == (1, 5)
    assert path.read_bytes() == good


def test_a_clock_that_jumps_makes_nothing_again(farm):
    plan(farm, PYRAMID)
    run(farm)
    far = 4e9
    for path in [*(farm.folder / "maps").iterdir(), *(farm.folder / "assets").glob("*.glint")]:
        os.utime(path, (far, far))
        far = -far / 2
    checked = run(farm)
    assert (checked["unchanged"], checked["made"]) == (6, 0)
    assert run(farm)["known"] == 6


def test_a_wrong_flag_is_not_tried_twice(farm):
    plan(farm, "normals", "sat --bins 0x0")
    assert run(farm, code=4)["failed"] == 3
    assert {line["tries"] for line in log(farm) if line["status"] == "failed"} == {1}


def test_a_full_disk_is_told_and_the_run_goes_on_when_there_is_room(farm):
    """Writes through links to a small disk; needs root to mount one."""
    disk = farm.folder / "assets"
    disk.mkdir()
    if (
        os.getuid() != 0
        or subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "none", disk], capture_output=True).returncode != 0
    ):
        pytest.skip("needs to mount a small disk")
    try:
        plan(farm, PYRAMID)
        process = farm("run", "farm.json", "--retries", 0)
        assert process.returncode == 4 and os.strerror(errno.ENOSPC) in process.stderr
        assert not leftovers(disk)
        subprocess.run(["mount", "-o", "remount,size=64m", disk], check=True)
        assert run(farm)["failed"] == 0 and len(contents(disk)) == 6
    finally:
        subprocess.run(["umount", disk], check=True)


def test_a_duplicate_on_another_disk_is_a_copy(farm):
    """Needs root to mount a disk."""
    disk = farm.folder / "assets/more"
    disk.mkdir(parents=True)
    (farm.folder / "maps/more").mkdir()
    shutil.copy(farm.folder / "maps/a.png", farm.folder / "maps/more/twin.png")
    if (
        os.getuid() != 0
        or subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64m", "none", disk], capture_output=True).returncode != 0
    ):
        pytest.skip("needs to mount a disk")
    try:
        plan(farm, "normals")
        assert run(farm)["made"] == 3
        assert (disk / "twin.glint").read_bytes() == (farm.folder / "assets/a.glint").read_bytes()
        assert not (disk / "twin.glint").samefile(farm.folder / "assets/a.glint") and not leftovers(farm.folder)
        assert run(farm)["known"] == 3
    finally:
        subprocess.run(["umount", disk], check=True)


def test_records_that_cannot_be_written_end_the_run(farm):
    plan(farm, "normals")
    (farm.folder / "farm.json.log").symlink_to("/dev/full")
    process = farm("run", "farm.json")
    assert process.returncode == 2 and "farm.json.log" in process.stderr
    (farm.folder / "farm.json.log").unlink()
    assert run(farm)["failed"] == 0


def test_half_a_line_of_a_killed_farm_hurts_nobody(farm):
    plan(farm, PYRAMID)
    run(farm)
    (farm.folder / "assets/a.glint").unlink()
    with open(farm.folder / "farm.json.log", "a") as file:
        file.write('{"key":"0')
    assert run(farm)["made"] == 1
    assert run(farm)["known"] == 6


class Running:
    """A farm in the background that makes an asset of the large map."""

    def __init__(self, farm, maps, *arguments):
        shutil.copy(maps / "large.png", farm.folder / "maps")
        plan(farm, "pyramid --stride 8")
        self.start(farm, *arguments)

    def start(self, farm, *arguments):
        self.process = subprocess.Popen(
            [BIN / "glint-farm", "run", "farm.json", "--json", *map(str, arguments)],
            cwd=farm.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def child(self, name="glint-pyramid"):
        """Waits for a program of the large map and returns its number."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            for path in pathlib.Path(f"/proc/{self.process.pid}/task").glob("*/children"):
                for child in path.read_text().split():
                    try:
                        words = pathlib.Path(f"/proc/{child}/cmdline").read_bytes().split(b"\0")
                    except OSError:
                        continue
                    if words[0].decode() == name and words[1].endswith(b"large.glint"):
                        return int(child)
            assert self.process.poll() is None, "ended before it made the pyramid"
        raise AssertionError("starts no program")

    def wait(self):
        output, errors = self.process.communicate(timeout=PATIENCE_S)
        return self.process.returncode, output, errors


def ended(process):
    try:
        return pathlib.Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


def wait_for_end(process):
    deadline = time.monotonic() + PATIENCE_S
    while not ended(process):
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture(scope="module")
def whole(maps, tmp_path_factory):
    """The assets of all four maps as a run makes them that nobody disturbs."""
    folder = tmp_path_factory.mktemp("whole")
    for words in (["plan", maps, "-o", "farm.json", "--make", "pyramid --stride 8"], ["run", "farm.json"]):
        subprocess.run([BIN / "glint-farm", *words], cwd=folder, check=True)
    return contents(folder / "assets")


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_it_cleanly_and_a_second_run_goes_on(farm, maps, whole, number):
    running = Running(farm, maps)
    child = running.child()
    running.process.send_signal(number)
    code, _, errors = running.wait()
    assert code == -number, errors
    assert ended(child), "its program has ended, too"
    assert not leftovers(farm.folder) and "assets/large.pyramid.glint" not in contents(farm.folder)
    assert run(farm)["failed"] == 0
    assert contents(farm.folder / "assets") == whole


def test_a_killed_farm_loses_nothing_and_its_program_keeps_its_lock(farm, maps, whole):
    running = Running(farm, maps)
    child = running.child()
    os.kill(child, signal.SIGSTOP)
    running.process.kill()
    running.wait()
    assert result(farm("status", "farm.json", "--json"))["running"] == 1, "the program lives, and so does its lock"
    os.kill(child, signal.SIGCONT)
    assert run(farm)["failed"] == 0
    wait_for_end(child)
    assert contents(farm.folder / "assets") == whole and not leftovers(farm.folder)


def test_a_killed_program_is_tried_again(farm, maps, whole):
    running = Running(farm, maps)
    os.kill(running.child(), signal.SIGKILL)
    code, _, errors = running.wait()
    assert code == 0, errors
    assert [line["tries"] for line in log(farm) if line["output"] == "assets/large.pyramid.glint"] == [2]
    assert contents(farm.folder / "assets") == whole and not leftovers(farm.folder)


def test_a_program_that_is_killed_each_time_is_a_failure_with_its_signal(farm, maps):
    running = Running(farm, maps, "--retries", 0)
    os.kill(running.child(), signal.SIGKILL)
    code, output, _ = running.wait()
    assert code == 4 and json.loads(output)["result"]["failed"] == 1
    line = next(line for line in log(farm) if line["status"] == "failed")
    assert (line["exit_code"], line["error"]["rule"]) == (KILLED, "process.signal") and "--max-memory" in line["error"][
        "remedy"
    ]


def test_two_farms_make_each_asset_once(farm, maps, whole):
    first = Running(farm, maps)
    second = Running.__new__(Running)
    second.start(farm)
    results = []
    for running in (first, second):
        code, output, errors = running.wait()
        assert code == 0, errors
        results.append(json.loads(output)["result"])
    assert sum(one["made"] for one in results) == len(whole)
    assert all(one["made"] + one["known"] == len(whole) for one in results)
    assert contents(farm.folder / "assets") == whole


# --skip-unchanged of every tool.


def test_an_unchanged_asset_is_left_alone(glint, maps):
    shutil.copy(maps / "a.png", glint.folder)
    ingest = ["ingest", "a.png", "-o", "a.glint", "--skip-unchanged"]
    asset = glint.folder / "a.glint"
    stamp = lambda: (asset.stat().st_ino, asset.stat().st_mtime_ns)

    def makes(*more, code=0):
        before = stamp() if asset.exists() else None
        process = glint(*ingest, *more)
        assert process.returncode == code, process.stderr
        return stamp() != before, process

    assert makes()[0]
    made, process = makes("--depfile", "a.d")
    assert not made and process.stderr == "glint-ingest: a.glint: unchanged\n" and process.stdout == ""
    assert (glint.folder / "a.d").read_text().split()[:3] == ["a.glint:", "\\", "a.png"]
    assert not makes("--quiet")[0] and makes("--quiet")[1].stderr == ""
    assert json.loads(makes("--json")[1].stdout)["status"] == "unchanged"
    assert makes("--convention", "directx")[0], "other parameters"
    assert makes()[0]
    shutil.copy(maps / "b.png", glint.folder / "a.png")
    assert makes()[0], "other pixels"
    damage(asset)
    assert makes()[0], "a damaged asset"
    asset.write_bytes(b"")
    assert makes()[0], "an empty file"
    assert not makes()[0]


def test_an_asset_of_assets_is_unchanged_if_they_are(glint, maps):
    shutil.copy(maps / "a.png", glint.folder)
    steps = [
        "ingest a.png -o n.glint",
        "pyramid n.glint -o p.glint --resolution 64 --sigma-r .02",
        "compress p.glint -o c.glint --rank 4",
    ]
    for step in steps:
        assert glint(*step.split()).returncode == 0
    for step in steps:
        assert "unchanged" in glint(*step.split(), "--skip-unchanged").stderr
    assert glint(*steps[1].split(), "--stride", 16).returncode == 0
    assert "unchanged" not in glint(*steps[2].split(), "--skip-unchanged").stderr


def test_files_that_do_not_say_how_they_were_made_are_made(glint, maps):
    shutil.copy(maps / "a.png", glint.folder)
    command = ["synth", "flat", "--size", 4, "-o", "flat.png", "--skip-unchanged"]
    for _ in range(2):
        process = glint(*command)
        assert process.returncode == 0 and "unchanged" not in process.stderr
    glint("ingest", "a.png", "-o", "n.glint")
    moments = ["moments", "n.glint", "-o", "m.glint", "--textures", ".", "--skip-unchanged"]
    assert glint(*moments).returncode == 0
    (glint.folder / "lean.exr").unlink()
    assert glint(*moments).returncode == 0 and (glint.folder / "lean.exr").exists(), "textures would be missing"
    process = glint("info", "n.glint", "--skip-unchanged")
    assert process.returncode == 1 and "--skip-unchanged" in process.stderr
