"""glint-pyramid and glint-compress --keep-normals: footprints below level 0 are answered without a second file."""

import json

import pytest
from conftest import run_all, run_once

PYRAMID = "--stride 16 --resolution 64 --sigma-r .02 --levels 2"
MAKE = (
    "synth flakes --size 130x66 -o map.exr",
    "ingest map.exr -o map.glint",
    f"pyramid map.glint -o plain.glint {PYRAMID}",
    f"pyramid map.glint -o i16.glint {PYRAMID} --keep-normals i16",
    f"pyramid map.glint -o f32.glint {PYRAMID} --keep-normals f32",
)
SMALL = ("--uv", ".3", ".7", "--sigma", "1.5")
CODES = 2e-3  # 16 bits: the lobe of .02 against half a step of 1.5e-5


@pytest.fixture
def made(glint):
    run_once(glint, *MAKE)
    return glint


def ask(glint, asset, *more):
    process = glint("query", asset, *SMALL, *more, "--json")
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)["result"]


def peak(glint):
    """A half vector with much light: one that is drawn."""
    process = glint("query", "map.glint", *SMALL, "--sigma-r", ".02", "--samples", "1", "-o", "-")
    assert process.returncode == 0, process.stderr
    return process.stdout.splitlines()[1].split(",")[:2]


def test_kept_normals_answer_as_the_map_does(made):
    half = ("--half", *peak(made))
    given = ask(made, "plain.glint", *half, "--normals", "map.glint")
    assert given["density"] > 1
    assert ask(made, "f32.glint", *half) == given
    assert ask(made, "i16.glint", *half)["density"] == pytest.approx(given["density"], rel=CODES)
    assert ask(made, "i16.glint", *half)["widened"] is False
    # What is given counts instead.
    assert ask(made, "i16.glint", *half, "--normals", "map.glint") == given
    refused = made("query", "plain.glint", *SMALL, *half)
    assert refused.returncode == 1 and "--keep-normals" in refused.stderr


def test_compressed_pyramids_keep_what_their_pyramids_keep(made):
    half = ("--half", *peak(made))
    run_all(
        made,
        "compress f32.glint -o c.glint --rank 4",
        "compress i16.glint -o c16.glint --rank 4",
        "compress plain.glint -o given.glint --rank 4 --normals map.glint",
        "compress f32.glint -o none.glint --rank 4 --keep-normals none",
        "compress f32.glint -o to16.glint --rank 4 --keep-normals i16",
        "compress plain.glint -o plain.cp.glint --rank 4",
    )
    given = ask(made, "plain.cp.glint", *half, "--normals", "map.glint")
    assert ask(made, "c.glint", *half) == given
    for name in ("c16.glint", "given.glint", "to16.glint"):
        assert ask(made, name, *half)["density"] == pytest.approx(given["density"], rel=CODES), name
    assert made("query", "none.glint", *SMALL, *half).returncode == 1
    size = lambda name: (made.folder / name).stat().st_size
    assert size("none.glint") == size("plain.cp.glint") < size("c16.glint") < size("c.glint")


def test_what_is_kept_can_be_ignored(made):
    half = ("--half", *peak(made))
    larger = ("query", "--uv", ".3", ".7", "--sigma", "7", *half, "--json")  # a little above level 0, blended with the texels
    density = lambda *asset: json.loads(made(*larger, *asset).stdout)["result"]["density"]
    plain = density("plain.glint")
    assert density("f32.glint") != plain
    assert density("f32.glint", "--kept-normals", "ignored") == plain
    refused = made("query", "f32.glint", *SMALL, *half, "--kept-normals", "ignored")
    assert refused.returncode == 1 and "leave --kept-normals ignored out" in refused.stderr


@pytest.mark.parametrize("size, more, count", [("130x66", "", 3), ("33x190", " --boundary clamp", 4), ("190x7", "", 9)])
@pytest.mark.parametrize("kept", ["i16", "f32"])
def test_shards_keep_what_one_run_keeps(glint, size, more, count, kept):
    """One texel is steeper than all others, and decides the step of the codes of all regions."""
    numpy = pytest.importorskip("numpy")
    from image_writer import write

    width, height = map(int, size.split("x"))
    normals = numpy.random.default_rng(1).uniform(-0.2, 0.2, (height, width, 2))
    normals[-2, width // 2] = 0.1, 0.8
    z = numpy.sqrt(1 - (normals**2).sum(-1, keepdims=True))
    write(glint.folder / "n.exr", numpy.concatenate([normals, z], -1).astype(numpy.float32))
    flags = f"{PYRAMID.replace('--levels 2', '--levels 1').replace('16', '4')}{more} --keep-normals {kept}"
    run_all(glint, "ingest n.exr -o n.glint --encoding snorm", f"pyramid n.glint -o whole.glint {flags}")
    shards = [f"{i}of{count}.glint" for i in range(1, count + 1)]
    run_all(glint, *[f"pyramid n.glint -o {i}of{count}.glint --region {i}/{count} {flags}" for i in range(1, count + 1)])
    assert glint("validate", *shards).returncode == 0
    report = json.loads(glint("merge", *reversed(shards), "-o", "joined.glint", "--json").stdout)["result"]
    assert (glint.folder / "joined.glint").read_bytes() == (glint.folder / "whole.glint").read_bytes()
    assert report["near_normals_bytes"] > width * height * (4 if kept == "i16" else 8)
    run_all(glint, f"merge {' '.join(shards)} -o filed.glint --max-memory 17M")
    assert (glint.folder / "filed.glint").read_bytes() == (glint.folder / "whole.glint").read_bytes()


def test_shards_that_keep_other_normals_are_refused(made):
    run_all(
        made,
        f"pyramid map.glint -o 1.glint --region 1/2 {PYRAMID} --keep-normals i16",
        f"pyramid map.glint -o 2.glint --region 2/2 {PYRAMID} --keep-normals f32",
        f"pyramid map.glint -o plain2.glint --region 2/2 {PYRAMID}",
    )
    for other in ("2.glint", "plain2.glint"):
        process = made("merge", "1.glint", other, "-o", "joined.glint")
        assert process.returncode == 3 and "--keep-normals" in process.stderr, process.stderr


def test_info_and_reports_say_what_is_kept(made):
    properties = lambda name: json.loads(made("info", name, "--json").stdout)["result"]["properties"]
    assert "near_normals" not in properties("plain.glint")
    assert properties("i16.glint")["near_normals"] == "i16"
    assert "near_normals" in made("info", "i16.glint").stdout
    report = json.loads(made("compress", "i16.glint", "-o", "c.glint", "--rank", "2", "--json").stdout)["result"]
    texels = 130 * 66
    assert 6.6 * texels < report["near_normals_bytes"] < 7 * texels


def test_files_are_valid_and_damage_is_found(made):
    import h5py

    assert made("validate", "i16.glint", "f32.glint").returncode == 0
    with h5py.File(made.folder / "i16.glint", "r+") as file:
        file["near/normals"][3, 4] = (32000, 32000)
    process = made("validate", "i16.glint")
    assert process.returncode == 3 and "near.disk" in process.stdout + process.stderr


def test_results_do_not_depend_on_threads(made):
    run_all(made, f"pyramid map.glint -o one.glint {PYRAMID} --keep-normals i16 --threads 1")
    assert (made.folder / "one.glint").read_bytes() == (made.folder / "i16.glint").read_bytes()


@pytest.mark.parametrize(
    "command, code, text",
    [
        (
            "compress plain.glint -o c.glint --keep-normals i16",
            1,
            "add --normals with the asset that the pyramid was made from",
        ),
        ("compress i16.glint -o c.glint --keep-normals f32", 1, "keeps normals in 16 bits"),
        ("compress plain.glint -o c.glint --keep-normals none --normals map.glint", 1, "leave one of them out"),
        ("compress plain.glint -o c.glint --normals other.glint", 3, "this is not the map that plain.glint was made from"),
        (
            f"pyramid w.glint -o s.glint --stride 8 --resolution 64 --sigma-r .02 --keep-normals i16",
            1,
            "ask the tiles themselves",
        ),
        ("pyramid h.glint -o s.glint --optics wave --keep-normals i16", 1, "--keep-normals"),
    ],
)
def test_wrong_use_is_refused(made, command, code, text):
    run_once(
        made,
        *MAKE,
        "synth flakes --size 130x66 --seed 4 -o other.exr",
        "ingest other.exr -o other.glint",
        "wang map.glint -o w.glint --size 16",
        "synth weave --size 32 -o h.exr --height",
        "ingest h.exr --kind height --to heights -o h.glint --texel-size-um 1",
    )
    process = made(*command.split())
    assert process.returncode == code and text in process.stderr, process.stderr
    assert process.stderr.count("\n") == 1


def test_tiles_of_a_set_keep_theirs(made):
    run_all(made, "synth flakes --size 64 -o n.1001.exr", "synth flakes --size 64 --seed 5 -o n.1002.exr")
    for command in (
        ["ingest", "n.<UDIM>.exr", "-o", "n.<UDIM>.map.glint", "--udim-margin", "8"],
        ["pyramid", "n.<UDIM>.map.glint", "-o", "n.<UDIM>.p.glint", *PYRAMID.split(), "--keep-normals", "f32"],
        ["pyramid", "n.<UDIM>.map.glint", "-o", "plain.<UDIM>.p.glint", *PYRAMID.split()],
        ["compress", "plain.<UDIM>.p.glint", "-o", "n.<UDIM>.cp.glint", "--rank", "4", "--normals", "n.<UDIM>.map.glint"],
    ):
        process = made(*command)
        assert process.returncode == 0, process.stderr
    question = ("--uv", "1.002", ".5", "--sigma", "1.2", "--range", "-.1", "-.1", ".1", ".1", "--json")
    mean = lambda *asked: json.loads(made("query", *asked, *question).stdout)["result"]["mean"]
    given = mean("plain.<UDIM>.p.glint", "--normals", "n.<UDIM>.map.glint")
    assert mean("n.<UDIM>.p.glint") == given
    assert mean("n.<UDIM>.cp.glint") == pytest.approx(given, rel=1e-2)


def test_curved_pixels_average_over_their_half_vectors(made):
    """--spread: the density is the mean over the box of half vectors that the pixel sees."""
    x, y = map(float, peak(made))
    box = ("--range", x - 0.03, y - 0.02, x + 0.03, y + 0.02)
    curved = ask(made, "f32.glint", "--half", x, y, "--spread", ".03", ".02")
    assert curved["density"] == pytest.approx(ask(made, "f32.glint", *box)["mean"], rel=1e-4)
    assert curved["density"] != pytest.approx(ask(made, "f32.glint", "--half", x, y)["density"], rel=1e-3)
    (made.folder / "q.csv").write_text(f"u,v,sigma,hx,hy,spread_x,spread_y\n.3,.7,1.5,{x},{y},.03,.02\n.3,.7,1.5,{x},{y},0,0\n")
    table = made("query", "f32.glint", "--csv", "q.csv", "-o", "-").stdout.splitlines()
    assert float(table[1].split(",")[-1]) == pytest.approx(curved["density"], rel=1e-6)
    assert float(table[2].split(",")[-1]) == pytest.approx(ask(made, "f32.glint", "--half", x, y)["density"], rel=1e-6)
    drawn = made("query", "f32.glint", *SMALL, "--samples", "50", "--spread", ".03", ".02", "-o", "-").stdout.splitlines()[1:]
    for row in drawn[:5]:
        hx, hy, pdf = map(float, row.split(","))
        assert ask(made, "f32.glint", "--half", hx, hy, "--spread", ".03", ".02")["density"] == pytest.approx(pdf, rel=1e-5)
    for wrong in (("--spread", "-1", "0"), ("--spread", ".6", "0"), ("--spread", "nan", "0")):
        assert made("query", "f32.glint", *SMALL, "--half", "0", "0", *wrong).returncode == 1
