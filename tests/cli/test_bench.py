"""glint-bench: its results, going on after a stop, and its page in a browser without a window."""

import base64
import importlib
import json
import math
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import time
from xml.etree import ElementTree

import jsonschema
import pytest
from conftest import BIN

ROOT = pathlib.Path(__file__).parents[2]
SCHEMAS = ROOT / "docs/json/files"
SCHEMA = json.loads((SCHEMAS / "bench-results.schema.json").read_text())
SIZE = 64


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """A folder with a map, results of all methods, and their page."""
    folder = tmp_path_factory.mktemp("bench")
    for command in (
        f"synth flakes --size {SIZE} --flake-size 4 -o map.exr",
        "ingest map.exr -o map.glint",
        "bench map.glint -o results.json --quick",
        "bench --report results.json -o report.html",
    ):
        tool, *words = command.split()
        process = subprocess.run([BIN / f"glint-{tool}", *words], cwd=folder, capture_output=True, text=True, timeout=250)
        assert process.returncode == 0, process.stderr
        if command.startswith("bench map"):
            (folder / "printed.txt").write_text(process.stdout)
    return folder


@pytest.fixture
def results(measured):
    return json.loads((measured / "results.json").read_text())


@pytest.fixture
def copied(glint, measured):
    for name in ("map.glint", "results.json"):
        shutil.copy(measured / name, glint.folder)
    return glint.folder


def test_results_are_as_described(results):
    jsonschema.Draft202012Validator(SCHEMA).validate(results)
    assert [measurement["name"] for measurement in results["measurements"] if measurement["status"] != "ok"] == []
    assert {measurement["method"] for measurement in results["measurements"]} == {
        "brute force",
        "moments",
        "bin map",
        "histograms",
        "pyramid",
        "tucker",
    }


def test_errors_are_those_of_the_methods(results):
    errors = {
        measurement["method"]: {set_["sigma_texels"]: set_ for set_ in measurement["errors"] if set_["shape"] == "round"}
        for measurement in results["measurements"]
    }
    widest = SIZE / 8
    assert errors["brute force"] == {}
    assert errors["pyramid"][widest]["rel_l2"] < 0.1 < errors["moments"][widest]["rel_l2"]
    assert errors["pyramid"][widest]["seen"] <= errors["tucker"][widest]["seen"] + 0.02
    # A bin map is asked for Gaussians and answers boxes, and is right where it is asked for boxes.
    bins = {
        set_["shape"]: set_
        for measurement in results["measurements"]
        if measurement["method"] == "bin map"
        for set_ in measurement["errors"]
    }
    assert bins["box"]["as_asked"] and not bins["round"]["as_asked"]
    assert bins["box"]["rel_l2"] < 0.05 < bins["round"]["rel_l2"]


def test_images_are_of_the_footprints(results):
    truth = results["maps"][0]["truth"]
    for measurement in results["measurements"]:
        for mine, right in zip(measurement["images"], truth):
            assert mine["sigma_texels"] == right["sigma_texels"]
            assert sum(mine["image"]) * 4 / 64**2 == pytest.approx(1, abs=0.03)


# Pictures are kept in half precision, whose last place is 2^-11 of a number: rounding of all pixels averages out.
OF_HALVES = 1e-3


def radiance(picture):
    """Pixels of a picture of the results, top row first."""
    packed = base64.b64decode(picture["picture"])
    return struct.unpack(f"<{len(packed) // 2}e", packed)


def pairs(results):
    """(measurement, its picture, the exact picture) of all pictures."""
    truth = {(picture["scene"], picture["sigma_texels"]): picture for picture in results["maps"][0]["pictures"]}
    assert set(truth) == {(scene, size) for scene in ("plane", "sphere") for size in (2, 8)}
    for measurement in results["measurements"]:
        assert len(measurement["pictures"]) == (0 if measurement["method"] == "brute force" else len(truth))
        for picture in measurement["pictures"]:
            yield measurement, picture, truth[picture["scene"], picture["sigma_texels"]]


def test_pictures_err_as_they_say(results):
    for _, picture, truth in pairs(results):
        mine, right = radiance(picture), radiance(truth)
        assert len(mine) == len(right) == truth["pixels"] ** 2 and max(right) * (1 + OF_HALVES) > truth["white"] > 0
        rmse = math.sqrt(sum((a - b) ** 2 for a, b in zip(mine, right)) / sum(b * b for b in right))
        assert picture["rmse"] == pytest.approx(rmse, abs=OF_HALVES)


def test_pictures_rank_methods_as_a_person_does(results):
    flip = {
        (measurement["method"], picture["scene"], picture["sigma_texels"]): picture["flip"]
        for measurement, picture, _ in pairs(results)
    }
    for scene in ("plane", "sphere"):
        assert 0 < flip["pyramid", scene, 8] < flip["moments", scene, 8]  # one lobe has no sparkles
        assert flip["pyramid", scene, 8] <= flip["tucker", scene, 8] + OF_HALVES
    assert {measurement["method"] for measurement, picture, _ in pairs(results) if not picture["as_asked"]} == {
        "bin map",
        "histograms",
    }


def test_flip_is_that_of_flip_evaluator(results):
    numpy = pytest.importorskip("numpy")
    flip_evaluator = pytest.importorskip("flip_evaluator")

    def shown(picture, truth):
        x = numpy.clip(numpy.array(radiance(picture)) / truth["white"], 0, 1).reshape(truth["pixels"], -1)
        srgb = numpy.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
        return numpy.repeat(srgb[:, :, None], 3, axis=2).astype(numpy.float32)

    for _, picture, truth in pairs(results):
        expected = float(flip_evaluator.evaluate(shown(truth, truth), shown(picture, truth), "LDR")[1])
        assert picture["flip"] == pytest.approx(expected, abs=OF_HALVES)


def test_most_of_the_light_is_shown(results):
    for truth in results["maps"][0]["pictures"]:
        light = radiance(truth)
        assert sum(value for value in light if value > truth["white"] * (1 + OF_HALVES)) <= sum(light) / 3


def test_a_black_picture_is_the_scale_of_flip(results):
    for measurement, picture, truth in pairs(results):
        if measurement["method"] == "pyramid" and picture["sigma_texels"] == 8:
            assert picture["flip"] < truth["black_flip"]
    assert all(0 < truth["black_flip"] < 1 for truth in results["maps"][0]["pictures"])


def test_results_of_another_white_are_refused(glint, copied):
    document = json.loads((copied / "results.json").read_text())
    (copied / "results.json").write_text(json.dumps(document | {"schema": "glint-bench results 1"}, separators=(",", ":")))
    assert "not of the form" in refused(glint, 3, "--report", "results.json", "-o", "some.html")
    message = refused(glint, 3, "map.glint", "-o", "results.json", "--quick", "--only", "moments")
    assert "not of the form" in message and "--force" in message


def spoil_each(document):
    """(name, results with one part spoiled)."""

    def spoil(name, change):
        copy = json.loads(json.dumps(document))
        change(copy["maps"][0], next(m for m in copy["measurements"] if m["pictures"]))
        return name, copy

    def first(part, **values):
        return part[0].update(values)

    yield spoil("no base64", lambda map_, m: first(map_["pictures"], picture="***"))
    yield spoil("no base64", lambda map_, m: first(m["pictures"], picture="***" + m["pictures"][0]["picture"][3:]))
    yield spoil("half a picture", lambda map_, m: first(m["pictures"], picture=m["pictures"][0]["picture"][:400]))
    yield spoil("larger pictures", lambda map_, m: first(map_["pictures"], pixels=49))
    yield spoil("huge pictures", lambda map_, m: first(map_["pictures"], pixels=1 << 30))
    yield spoil("no white", lambda map_, m: map_["pictures"][0].pop("white"))
    yield spoil("white is black", lambda map_, m: first(map_["pictures"], white=0))
    yield spoil("another scene", lambda map_, m: first(map_["pictures"], scene="teapot"))
    yield spoil("another size", lambda map_, m: first(m["pictures"], sigma_texels=3))
    yield spoil("a picture less", lambda map_, m: m["pictures"].pop())
    yield spoil("a truth less", lambda map_, m: map_["pictures"].pop())
    yield spoil("no pictures", lambda map_, m: map_.pop("pictures"))
    yield spoil("no list", lambda map_, m: m.update(pictures=None))
    yield spoil("no FLIP", lambda map_, m: m["pictures"][0].pop("flip"))
    yield spoil("an image less", lambda map_, m: m["images"].pop())
    yield spoil("half an image", lambda map_, m: m["images"][0]["image"].pop())
    yield spoil("an error less", lambda map_, m: m["errors"].pop(0))
    yield spoil("no map", lambda map_, m: m.update(map="0" * 32))
    yield spoil("no time", lambda map_, m: m["times"]["mean"].pop("cold"))


def test_results_that_are_not_whole_are_refused(glint, copied):
    document = json.loads((copied / "results.json").read_text())
    for name, spoiled in spoil_each(document):
        (copied / "spoiled.json").write_text(json.dumps(spoiled, separators=(",", ":")))
        process = glint("bench", "--report", "spoiled.json", "-o", "some.html")
        assert process.returncode == 3 and re.search("(map|measurement) [0-9]+ ", process.stderr), (name, process.stderr)
    (copied / "deep.json").write_text('{"schema":"glint-bench results 2","maps":' + "[" * 100000 + "]" * 100000 + "}")
    assert "nested deeper" in refused(glint, 3, "--report", "deep.json", "-o", "some.html")


def test_pictures_that_were_given_up_are_shown_as_such(glint, copied):
    document = json.loads((copied / "results.json").read_text())
    for picture in next(m for m in document["measurements"] if m["pictures"])["pictures"]:
        for name in ("rmse", "flip", "picture"):
            del picture[name]
        picture["given_up_s"] = 5
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    (copied / "slow.json").write_text(json.dumps(document, separators=(",", ":")))
    process = glint("bench", "--report", "slow.json", "-o", "slow.html")
    assert process.returncode == 0, process.stderr
    if CHROMIUM:
        process = browse(copied, copied / "slow.html", 1280, "--dump-dom")
        assert "Uncaught" not in process.stderr and "was given up after 5 s" in process.stdout, process.stderr


def test_summary_names_the_quickest_method(measured):
    text = (measured / "printed.txt").read_text()
    assert re.search(r"pyramid, stride 32 +[\d.]+ s +[\d.]+ MB +[\d.]+ to +[\d.]+ us", text)
    assert "The quickest within" in text and re.search(r"8 texels +(tucker|pyramid|brute force|bin map)", text)
    assert not list(measured.glob("*.assets"))


def test_measurements_that_are_there_are_not_measured_again(glint, copied):
    document = json.loads((copied / "results.json").read_text())
    kept = document["measurements"][:3]
    (copied / "results.json").write_text(json.dumps(document | {"measurements": kept}, separators=(",", ":")))
    process = glint("bench", "map.glint", "-o", "results.json", "--quick", "--only", "moments,histograms,bin map")
    assert process.returncode == 0, process.stderr
    after = json.loads((copied / "results.json").read_text())["measurements"]
    assert after[:3] == kept and [measurement["method"] for measurement in after[3:]] == ["histograms"]


def test_a_stopped_run_leaves_whole_results(glint, copied):
    (copied / "results.json").unlink()
    process = subprocess.Popen(
        [BIN / "glint-bench", "map.glint", "-o", "results.json", "--quick"],
        cwd=copied,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    for _ in range(1000):
        time.sleep(0.02)
        if (copied / "results.json").exists():
            break
    process.terminate()
    process.wait(timeout=30)
    document = json.loads((copied / "results.json").read_text())
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    process = glint("bench", "map.glint", "-o", "results.json", "--quick", "--only", "moments")
    assert process.returncode == 0, process.stderr


def test_a_method_that_fails_says_so_and_the_rest_goes_on(copied):
    """An installation without glint-sat, and whose glint-pyramid always fails."""
    programs = copied / "bin"
    programs.mkdir()
    shutil.copy(BIN / "glint-bench", programs)  # programs are looked for beside the file itself, behind links
    for tool in ("moments", "binmap", "compress"):
        (programs / f"glint-{tool}").symlink_to(BIN / f"glint-{tool}")
    (programs / "glint-pyramid").write_text("#!/bin/sh\necho no memory left >&2\nexit 4\n")
    (programs / "glint-pyramid").chmod(0o755)
    process = subprocess.run(
        [programs / "glint-bench", "map.glint", "-o", "some.json", "--quick"],
        cwd=copied,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert process.returncode == 0, process.stderr
    document = json.loads((copied / "some.json").read_text())
    jsonschema.Draft202012Validator(SCHEMA).validate(document)
    messages = {m["method"]: m.get("message") for m in document["measurements"]}
    assert [method for method, message in messages.items() if message is None] == ["brute force", "moments", "bin map"]
    assert "cannot be started" in messages["histograms"] and "exit code 4: no memory left" in messages["pyramid"]
    assert "pyramid, stride 32, which it is made from, failed" in messages["tucker"]
    assert "no memory left" in process.stdout
    # Where the programs are there, what failed is measured after all.
    process = subprocess.run(
        [BIN / "glint-bench", "map.glint", "-o", "some.json", "--quick"],
        cwd=copied,
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert process.returncode == 0, process.stderr
    assert {m["status"] for m in json.loads((copied / "some.json").read_text())["measurements"]} == {"ok"}


def refused(glint, code, *words):
    process = glint("bench", *words)
    assert process.returncode == code, process.stderr
    return process.stderr


def test_bad_input_is_named(glint, copied):
    before = (copied / "results.json").read_bytes()
    assert "nothing to measure" in refused(glint, 1, "-o", "x.json")
    assert "exclude" in refused(glint, 1, "map.glint", "--report", "results.json", "-o", "x.html")
    assert "exclude" in refused(glint, 1, "map.glint", "--stability", "-o", "x.json")
    assert "exclude" in refused(glint, 1, "--preset", "deng2022", "--stability", "-o", "x.json")
    assert "no test" in refused(glint, 1, "--stability", "--only", "tucker", "-o", "x.json")
    assert "no preset" in refused(glint, 1, "--preset", "newton1704", "-o", "x.json")
    assert "as a whole" in refused(glint, 1, "--preset", "deng2022", "--only", "cp", "-o", "x.json")
    assert "places" in refused(glint, 1, "--stability", "--places", "3", "-o", "x.json")
    for form in ("stability", "preset"):
        (copied / "some.json").write_text(json.dumps({"schema": f"glint-bench {form} 1", "tests": [{}], "rows": [{}]}))
        assert "lacks a part" in refused(glint, 3, "--report", "some.json", "-o", "x.html")
    assert "no method" in refused(glint, 1, "map.glint", "-o", "x.json", "--only", "magic")
    assert "seed" in refused(glint, 1, "map.glint", "-o", "results.json", "--quick", "--seed", "9")
    assert "places" in refused(glint, 1, "map.glint", "-o", "results.json", "--quick", "--places", "9")
    assert "quick" in refused(glint, 1, "map.glint", "-o", "results.json", "--places", "4")
    assert "no file" in refused(glint, 1, "map.glint", "-o", "/dev/null", "--quick")
    (copied / "half.json").write_bytes(before[: len(before) // 2])
    assert "not whole" in refused(glint, 3, "map.glint", "-o", "half.json", "--quick")
    assert "not whole" in refused(glint, 3, "--report", "half.json", "-o", "x.html")
    (copied / "other.json").write_text('{"schema":"glint-bench results 0"}')
    assert "not of the form" in refused(glint, 3, "--report", "other.json", "-o", "x.html")
    (copied / "lacking.json").write_text('{"schema":"glint-bench results 2","measurements":[7]}')
    assert "lacks" in refused(glint, 3, "--report", "lacking.json", "-o", "x.html")
    (copied / "mine.json").write_text('{"mine": 1}')
    assert "--force" in refused(glint, 1, "map.glint", "-o", "mine.json", "--quick")
    glint("synth", "flat", "--height", "--size", "16", "-o", "h.exr")
    glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "--allow-constant", "-o", "h.glint")
    assert "heights" in refused(glint, 5, "h.glint", "-o", "x.json", "--quick")
    assert (copied / "results.json").read_bytes() == before
    assert not (copied / "x.json").exists() and not (copied / "x.html").exists()


def test_other_files_beside_the_results_are_not_removed(glint, copied):
    (copied / "x.json.assets").mkdir()
    (copied / "x.json.assets/notes.txt").write_text("mine")
    assert "notes.txt" in refused(glint, 1, "map.glint", "-o", "x.json", "--quick")
    assert (copied / "x.json.assets/notes.txt").read_text() == "mine"


# Tests of stability are run by tests/stability; here are their page and the presets.


def test_a_preset_has_figures_beside_those_of_the_paper(glint):
    process = glint("bench", "--preset", "atanasov2021", "--quick", "-o", "paper.json")
    assert process.returncode == 0, process.stderr
    document = json.loads((glint.folder / "paper.json").read_text())
    jsonschema.Draft202012Validator(json.loads((SCHEMAS / "preset-results.schema.json").read_text())).validate(document)
    rows = document["rows"]
    assert not [row for row in rows if "failed" in row.get("note", "")]
    bins = {row["subject"]: row for row in rows if row["figure"] == "bins along an axis"}
    assert len(bins) == 4 and all(row["ours"] == row["paper"] for row in bins.values())  # Eq. 16 of the paper
    assert all(
        row["ours"] == pytest.approx(1, abs=0.03)
        for row in rows
        if row["figure"] == "integral of D" and "0.25" not in row["subject"]
    )
    assert "x1 " in process.stdout and "Table 4" in process.stdout
    assert not list(glint.folder.glob("*.assets"))


# The page, in Chromium where it is installed

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
ACT = """<script>
const shown = {};
const note = (name) => { shown[name] = [...document.querySelectorAll("#time > svg, #bytes > svg, #prepare > svg, #sizes > svg")].map((svg) => svg.querySelectorAll("circle").length); };
const change = (id, value) => { const select = document.getElementById(id); select.value = value; select.dispatchEvent(new Event("change")); };
const picture = () => document.getElementById("picture").toDataURL();
setTimeout(() => {
  note("round");
  const method = picture();
  document.querySelector("input[name=view][value=truth]").click();
  const truth = picture();
  document.querySelector("input[name=view][value=error]").click();
  const error = picture();
  document.querySelector("input[name=view][value=method]").click();
  const subjects = ["sphere", "ndf", "plane"].map((subject) => { change("subject", subject); return picture(); });
  shown.pictures = new Set([method, truth, error, ...subjects]).size;
  shown.same = subjects[2] === method;
  change("metric", "flip");
  note("flip");
  shown.shapes = [...document.getElementById("shape").options].map((option) => option.value);
  shown.flipWithin = document.querySelectorAll("#cheapest tr").length;
  change("shape", "sphere");
  shown.followed = document.getElementById("subject").value;
  change("metric", "seen");
  change("shape", "box");
  change("metric", "tv");
  note("box");
  shown.cheapest = document.querySelectorAll("#cheapest tr").length;
  shown.figures = document.querySelectorAll("#figures tr").length;
  shown.strip = document.querySelectorAll("#strip canvas").length;
  shown.wide = document.documentElement.scrollWidth <= innerWidth;
  document.body.dataset.shown = JSON.stringify(shown);
}, 300);
</script>"""


def browse(folder, page, width, *flags):
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--enable-logging=stderr",
        f"--window-size={width},1400",
        "--virtual-time-budget=4000",
        f"--user-data-dir={folder / 'profile'}",
        *flags,
        f"file://{page}",
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=120)


@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
@pytest.mark.parametrize("width", [1280, 500])
def test_the_page_draws_and_its_choices_work(measured, tmp_path, width):
    page = tmp_path / "page.html"
    page.write_text((measured / "report.html").read_text().replace("</body>", ACT + "</body>"))
    process = browse(tmp_path, page, width, "--dump-dom")
    assert "Uncaught" not in process.stderr and ":CONSOLE" not in process.stderr, process.stderr
    found = re.search(r'data-shown="([^"]*)"', process.stdout)
    assert found, process.stderr[-2000:]
    shown = json.loads(found.group(1).replace("&quot;", '"'))
    methods = 5  # all but brute force
    assert shown["round"][:3] == [methods] * 3 and shown["round"][3] >= 2 * methods
    assert shown["box"][:3] == [methods] * 3
    assert shown["flip"][:3] == [methods] * 3 and shown["shapes"] == ["plane", "sphere"] and shown["flipWithin"] == 3
    assert shown["followed"] == "sphere"
    assert shown["pictures"] == 5 and shown["same"]  # the plane's method, truth and error, a sphere and an NDF
    assert shown["figures"] == 1 + methods + 1 and shown["strip"] == methods + 1 and shown["cheapest"] >= 3
    assert shown["wide"], "the page is wider than the window"


@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
def test_charts_are_written_as_files(measured, tmp_path):
    image = pytest.importorskip("PIL.Image")
    script = ROOT / "pipelines/bench_charts.py"

    def run(page, *choices):
        return subprocess.run(
            [sys.executable, script, page, "--out", tmp_path / "charts", *choices], capture_output=True, text=True, timeout=250
        )

    process = run(measured / "report.html", "--metric", "flip", "--shape", "sphere", "--size", "8")
    assert process.returncode == 0, process.stderr
    assert sorted(path.name for path in (tmp_path / "charts").iterdir()) == sorted(
        f"{name}.{ending}" for name in ("time", "bytes", "prepare", "sizes") for ending in ("svg", "png")
    )
    for name in ("time", "bytes", "prepare", "sizes"):
        svg = ElementTree.parse(tmp_path / f"charts/{name}.svg").getroot()
        texts = ["".join(text.itertext()) for text in svg.iter("{http://www.w3.org/2000/svg}text")]
        assert "bin map" in texts and any("FLIP" in text for text in texts)  # the legend and the axis
        with image.open(tmp_path / f"charts/{name}.png") as picture:
            assert picture.size == (2 * int(svg.get("width")), 2 * int(svg.get("height")))
            assert len(picture.convert("RGB").getcolors(1 << 20)) > 20, "is empty"
    for choice in (
        ("--metric", "flp"),
        ("--map", "nosuch"),
        ("--shape", "ball"),
        ("--size", "3"),
        ("--metric", "flip", "--shape", "round"),
        ("--metric", "toString"),
    ):
        process = run(measured / "report.html", *choice)
        assert process.returncode != 0 and "it has" in process.stderr, (choice, process.stderr)
    assert "is no file" in run(tmp_path / "missing.html").stderr
    (tmp_path / "other.html").write_text("<p>no charts</p>")
    assert "has no charts" in run(tmp_path / "other.html").stderr


PAGE_ACT = """<script>
setTimeout(() => {
  const shown = { circles: document.querySelectorAll("figure > svg circle, figure div > svg circle").length, rows: document.querySelectorAll("tr").length };
  const series = document.getElementById("series");
  if (series) { series.value = series.options[1].value; series.dispatchEvent(new Event("change")); }
  shown.chosen = document.querySelectorAll("figure > svg circle, figure div > svg circle").length;
  shown.wide = document.documentElement.scrollWidth <= innerWidth;
  document.body.dataset.shown = JSON.stringify(shown);
}, 300);
</script>"""


@pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium")
@pytest.mark.parametrize("width", [1280, 500])
@pytest.mark.parametrize("form", ["stability", "preset"])
def test_the_other_pages_draw(glint, tmp_path, form, width):
    if form == "stability":
        results = ROOT / "docs/stability.json"
    else:
        results = tmp_path / "paper.json"
        row = {"source": "Table 2", "subject": "flakes <b>", "figure": "bytes", "unit": "MB"}
        results.write_text(
            json.dumps(
                {
                    "schema": "glint-bench preset 1",
                    "generator": "glint-bench",
                    "machine": {"processor": "p", "cores": 2, "system": "s"},
                    "seed": 1,
                    "quick": True,
                    "preset": "deng2022",
                    "paper": "Deng et al. 2022",
                    "rows": [row | {"paper": 2, "ours": 1}, row | {"ours": 3}, row | {"note": "not repeated </script>"}],
                }
            )
        )
    process = glint("bench", "--report", str(results), "-o", str(tmp_path / "some.html"))
    assert process.returncode == 0, process.stderr
    page = tmp_path / "page.html"
    page.write_text((tmp_path / "some.html").read_text().replace("</body>", PAGE_ACT + "</body>"))
    process = browse(tmp_path, page, width, "--dump-dom")
    assert "Uncaught" not in process.stderr and ":CONSOLE" not in process.stderr, process.stderr
    shown = json.loads(re.search(r'data-shown="([^"]*)"', process.stdout).group(1).replace("&quot;", '"'))
    assert shown["wide"], "the page is wider than the window"
    if form == "preset":
        assert shown["circles"] == 1 and shown["rows"] == 4
    else:
        tests = json.loads(results.read_text())["tests"]
        assert shown["circles"] == sum("value" in point for test in tests for point in test["points"]) > shown["chosen"] > 0


def test_the_page_asks_no_network(measured):
    page = (measured / "report.html").read_text()
    assert not re.findall(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=", page)
    assert "fetch(" not in (ROOT / "apps/glint-bench/page/report.js").read_text()
    assert "Permission to use, copy, modify" in page  # the licences of the libraries inside


# The page of measurements


@pytest.fixture
def report_of_bench(monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.syspath_prepend(str(ROOT / "tests/bench"))
    return importlib.import_module("report"), importlib.import_module("scenes")


def test_a_figure_of_another_name_is_no_empty_cell(report_of_bench):
    report, _ = report_of_bench
    rows = [{"section": "moments", "figure": "moments, flakes", "value": 2.0}]
    assert report.named(rows, r"moments, \S+") == [2.0]
    assert report.named(rows, r"mean, random, \S+ ggx") == []  # of those that are not measured
    with pytest.raises(SystemExit, match="no figure is named"):
        report.named(rows, r"moment, \S+")
    with pytest.raises(SystemExit, match="no figure is named"):
        report.method_table(rows, [("build", r"moment, \S+")])


def test_methods_without_a_figure_are_not_the_quickest(report_of_bench, tmp_path):
    _, scenes = report_of_bench
    lines = [
        "map,model,figure,value,distance,light",
        "flakes,pyramid,microseconds of a mean,4,8,",
        "flakes,moments,microseconds of a mean,1,8,",
        "flakes,cp,flip,0.015,8,0.5",
        "flakes,histograms,flip,0.001,8,0.5",
        "flakes,bin map,bytes,7,,",
    ]
    (tmp_path / "limits.csv").write_text("\n".join(lines) + "\n")
    pictures = scenes.Pictures(tmp_path / "limits.csv")
    assert pictures.microseconds("flakes", "cp", "8") == 4  # answers as the pyramid does
    assert pictures.microseconds("flakes", "histograms", "8") is None
    assert scenes.quickest(pictures, "flakes", "8", 0.02) == (4, "cp", 0.015)
    assert scenes.quickest(pictures, "flakes", "1", 0.02) is None
    scenes.scene_chart(pictures, tmp_path / "chart.png")
