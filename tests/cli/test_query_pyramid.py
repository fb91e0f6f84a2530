"""glint-pyramid, glint-compress and glint-query, from an image to answers."""

import csv
import io
import json
import struct

import pytest
from conftest import BIN

# Shell answers are printed with nine digits.
PRINTED = 1e-6
LEFT_OUT = (
    2e-3  # texels answer below level 0: up to a thousandth of the light is left out, and a single density may lose twice that
)
FOOTPRINT = ["--uv", "0.3", "0.7", "--sigma", "20"]


@pytest.fixture(scope="session")
def assets(tmp_path_factory):
    """A map of 256 x 256, its pyramid of four levels (the finest: 13.9 texels), and what it compresses to. Paths by kind."""
    import subprocess

    folder = tmp_path_factory.mktemp("assets")

    def run(name, *arguments):
        process = subprocess.run([BIN / f"glint-{name}", *arguments], cwd=folder, capture_output=True, text=True, timeout=120)
        assert process.returncode == 0, process.stderr

    run("synth", "isotropic", "--size", "256", "-o", "map.exr")
    run("ingest", "map.exr", "-o", "normals.glint")
    run(
        "pyramid",
        "normals.glint",
        "-o",
        "pyramid.glint",
        "--stride",
        "32",
        "--resolution",
        "64",
        "--sigma-r",
        "0.02",
        "--levels",
        "3",
    )
    run("synth", "isotropic", "--size", "256", "--seed", "9", "-o", "other.exr")
    run("ingest", "other.exr", "-o", "other.glint")
    kinds = {"normals": folder / "normals.glint", "other": folder / "other.glint", "pyramid": folder / "pyramid.glint"}
    if (BIN / "glint-compress").exists():
        run("compress", "pyramid.glint", "-o", "compressed.glint")
        kinds["compressed"] = folder / "compressed.glint"
    return kinds


@pytest.fixture
def ask(glint, assets):
    """Runs glint-query on an asset by kind."""

    def run(kind, *arguments):
        if kind not in assets:
            pytest.skip("glint-compress is not built")
        return glint("query", assets[kind], *arguments)

    run.folder = glint.folder
    return run


def number(process):
    assert process.returncode == 0, process.stderr
    return float(process.stdout.split()[0])


MODELS = ["normals", "pyramid", "compressed"]


@pytest.mark.parametrize("kind", MODELS)
def test_density_and_mean_are_printed_and_in_json(ask, kind):
    density = number(ask(kind, *FOOTPRINT, "--half", "0.02", "-0.03"))
    assert density > 0
    result = json.loads(ask(kind, *FOOTPRINT, "--half", "0.02", "-0.03", "--json").stdout)["result"]
    assert result["density"] == pytest.approx(density, rel=PRINTED)
    whole = ask(kind, *FOOTPRINT, "--range", "-1", "-1", "1", "1")
    assert number(whole) == pytest.approx(0.25, rel=2e-3)
    result = json.loads(ask(kind, *FOOTPRINT, "--range", "-1", "-1", "1", "1", "--json").stdout)["result"]
    assert result["mean"] == pytest.approx(0.25, rel=2e-3)


@pytest.mark.parametrize("kind", MODELS)
def test_models_agree_on_the_same_question(ask, kind):
    # Images that stand for the footprint keep a few percent of error, and so does compression.
    question = ["--uv", "0.3125", "0.6875", "--sigma", "20", "--range", "-0.0625", "-0.0625", "0.0625", "0.0625"]
    exact = number(ask("normals", *question, "--sigma-r", "0.02"))
    assert number(ask(kind, *question, *(["--sigma-r", "0.02"] if kind == "normals" else []))) == pytest.approx(exact, rel=0.1)


@pytest.mark.parametrize("kind", MODELS)
def test_kinds_of_footprints_with_the_same_moments_answer_alike(ask, kind):
    sigma, half = 20.0, ["--half", "0.01", "0.02"]
    uv = ["--uv", "0.3", "0.7"]
    isotropic = number(ask(kind, *uv, "--sigma", sigma, *half))
    assert number(ask(kind, *uv, "--cov", sigma**2, 0, sigma**2, *half)) == pytest.approx(isotropic, rel=1e-5)
    axis = sigma * 3**0.5
    box = number(ask(kind, *uv, "--box", axis, 0, 0, axis, *half))
    # The texels know a box from a Gaussian; pyramids do not.
    assert box == pytest.approx(isotropic, rel=0.5 if kind == "normals" else 1e-4)


def test_repeat_prints_nanoseconds(ask):
    process = ask("pyramid", *FOOTPRINT, "--half", "0", "0", "--repeat", "1500")
    assert process.returncode == 0
    lines = process.stdout.splitlines()
    assert len(lines) == 2 and lines[1].endswith(" ns per query") and float(lines[1].split()[0]) > 0
    result = json.loads(ask("pyramid", *FOOTPRINT, "--half", "0", "0", "--repeat", "1500", "--json").stdout)["result"]
    assert result["nanoseconds"] > 0


def png_size(path):
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return struct.unpack(">II", data[16:24])


def exr_size(path):
    data = path.read_bytes()
    assert struct.unpack("<I", data[:4])[0] == 20000630
    at = data.index(b"dataWindow\0box2i\0") + len(b"dataWindow\0box2i\0") + 4
    x0, y0, x1, y1 = struct.unpack("<4i", data[at : at + 16])
    return x1 - x0 + 1, y1 - y0 + 1


@pytest.mark.parametrize("kind, size", [("normals", 256), ("pyramid", 64), ("compressed", 64)])
def test_image_has_the_assets_own_size_or_the_given_one(ask, kind, size):
    for name, read in (("a.png", png_size), ("a.exr", exr_size)):
        assert ask(kind, *FOOTPRINT, "--image", name).returncode == 0
        assert read(ask.folder / name) == (size, size)
        assert ask(kind, *FOOTPRINT, "--image", name, "--image-size", "40").returncode == 0
        assert read(ask.folder / name) == (40, 40)


def test_image_of_another_kind_is_a_usage_error(ask):
    assert ask("pyramid", *FOOTPRINT, "--image", "a.jpg").returncode == 1
    assert ask("pyramid", *FOOTPRINT, "--image", "missing/a.png").returncode in (1, 2)


HEADERS = {
    "u,v,sigma,hx,hy": "0.3,0.7,20,0.02,-0.03",
    "u,v,sigma,x0,y0,x1,y1": "0.3,0.7,20,-0.1,-0.1,0.1,0.1",
    "u,v,sxx,sxy,syy,hx,hy": "0.3,0.7,400,50,300,0.02,-0.03",
    "u,v,sxx,sxy,syy,x0,y0,x1,y1": "0.3,0.7,400,50,300,-0.1,-0.1,0.1,0.1",
    "u,v,ax,ay,bx,by,hx,hy": "0.3,0.7,30,5,-5,40,0.02,-0.03",
    "u,v,ax,ay,bx,by,x0,y0,x1,y1": "0.3,0.7,30,5,-5,40,-0.1,-0.1,0.1,0.1",
}


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("header", HEADERS)
def test_every_header_answers_as_the_options_do(ask, kind, header):
    row = HEADERS[header]
    (ask.folder / "q.csv").write_text(f"{header}\n{row}\n{row}\n")
    process = ask(kind, "--csv", "q.csv", "-o", "a.csv")
    assert (process.returncode, process.stdout, process.stderr) == (0, "", "")
    rows = list(csv.reader(io.StringIO((ask.folder / "a.csv").read_text())))
    answer = "density" if "hx" in header else "mean"
    assert rows[0] == header.split(",") + [answer]
    assert [r[:-1] for r in rows[1:]] == [row.split(",")] * 2
    values = dict(zip(header.split(","), row.split(",")))
    option = ["--uv", values["u"], values["v"]]
    for name, columns in (
        ("--sigma", ["sigma"]),
        ("--cov", ["sxx", "sxy", "syy"]),
        ("--box", ["ax", "ay", "bx", "by"]),
        ("--half", ["hx", "hy"]),
        ("--range", ["x0", "y0", "x1", "y1"]),
    ):
        if columns[0] in values:
            option += [name, *(values[c] for c in columns)]
    expected = number(ask(kind, *option))
    assert [float(r[-1]) for r in rows[1:]] == pytest.approx([expected] * 2, rel=PRINTED)
    assert ask(kind, "--csv", "q.csv", "-o", "-").stdout == (ask.folder / "a.csv").read_text()


def test_other_columns_are_kept_in_their_order_and_quoted_fields_survive(ask):
    table = [
        ["name", "hy", "hx", "sigma", "v", "u", "re, mark"],
        ["plain", "-0.03", "0.02", "20", "0.7", "0.3", ""],
        ["with, comma", "-0.03", "0.02", "20", "0.7", "0.3", 'a "quoted" word'],
        ["two\nlines", "0", "0", "30", "0.1", "0.2", " spaces "],
    ]
    with open(ask.folder / "q.csv", "w", newline="") as file:
        csv.writer(file).writerows(table)
    assert ask("pyramid", "--csv", "q.csv", "-o", "a.csv").returncode == 0
    with open(ask.folder / "a.csv", newline="") as file:
        rows = list(csv.reader(file))
    assert [r[:-1] for r in rows] == table
    assert rows[0][-1] == "density"
    assert float(rows[1][-1]) == float(rows[2][-1]) > 0
    assert float(rows[3][-1]) > 0


def test_answers_of_a_table_can_be_asked_again(ask):
    (ask.folder / "q.csv").write_text("u,v,sigma,hx,hy\n0.3,0.7,20,0,0\n")
    assert ask("pyramid", "--csv", "q.csv", "-o", "a.csv").returncode == 0
    assert ask("pyramid", "--csv", "a.csv", "-o", "b.csv").returncode == 0
    last = (ask.folder / "b.csv").read_text().splitlines()[1].split(",")
    assert last[-1] == last[-2]


@pytest.mark.parametrize(
    "table, where",
    [
        ("u,v,sigma,hx,hy\n0.3,0.7,20,0,0\n0.3,0.7,20,0,zero\n", ["row 2", "column hy"]),
        ("u,v,sigma,hx,hy\n0.3,0.7,nan,0,0\n", ["row 1", "column sigma"]),
        ("u,v,sigma,hx,hy\n0.3,,20,0,0\n", ["row 1", "column v"]),
        ("u,v,sigma,hx,hy\n0.3,0.7,20,0\n", ["row 1"]),
        ("u,v,sigma,hx,hy\n0.3,0.7,20,0,0,0\n", ["row 1"]),
        ("u,v,hx,hy\n0.3,0.7,0,0\n", ["header"]),
        ("u,v,sigma\n0.3,0.7,20\n", ["header"]),
        ("u,v,sigma,sxx,sxy,syy,hx,hy\n0,0,20,1,0,1,0,0\n", ["header"]),
        ("u,v,sigma,hx,hy,x0,y0,x1,y1\n0,0,20,0,0,0,0,1,1\n", ["header"]),
        ("u,sigma,hx,hy\n0.3,20,0,0\n", ["header"]),
        ('u,v,sigma,hx,hy\n0.3,"0.7,20,0,0\n', ["row"]),
        ("", []),
    ],
)
def test_tables_that_cannot_be_read_are_invalid_input_with_the_place(ask, table, where):
    (ask.folder / "q.csv").write_text(table)
    process = ask("pyramid", "--csv", "q.csv", "-o", "a.csv")
    assert process.returncode == 3, process.stderr
    assert "q.csv" in process.stderr
    for place in where:
        assert place in process.stderr
    assert not (ask.folder / "a.csv").exists()


@pytest.mark.parametrize("kind", MODELS)
def test_samples_follow_the_density(ask, kind):
    count, limits = 5000, (-0.2, -0.1, 0.0, 0.1, 0.2)
    process = ask(kind, *FOOTPRINT, "--samples", str(count), "--seed", "3", "-o", "s.csv")
    assert process.returncode == 0, process.stderr
    text = (ask.folder / "s.csv").read_text()
    rows = list(csv.reader(io.StringIO(text)))
    assert rows[0] == ["hx", "hy", "pdf"] and len(rows) == count + 1
    samples = [tuple(map(float, row)) for row in rows[1:]]
    for hx, hy, pdf in samples[::500]:
        assert pdf == pytest.approx(number(ask(kind, *FOOTPRINT, "--half", str(hx), str(hy))), rel=PRINTED)
    # Shares of boxes of half vectors, within five deviations of independent samples (these are stratified).
    for x0, x1 in zip(limits, limits[1:]):
        mean = number(ask(kind, *FOOTPRINT, "--range", str(x0), "-0.1", str(x1), "0.15"))
        share = mean * (x1 - x0) * 0.25
        found = sum(x0 <= hx < x1 and -0.1 <= hy < 0.15 for hx, hy, _ in samples) / count
        assert abs(found - share) < 5 * (share / count) ** 0.5 + 0.01
    again = ask(kind, *FOOTPRINT, "--samples", str(count), "--seed", "3", "--threads", "1", "-o", "-")
    assert again.stdout == text
    assert ask(kind, *FOOTPRINT, "--samples", str(count), "--seed", "4", "-o", "-").stdout != text


def test_samples_need_a_place(ask):
    for arguments in (["--samples", "10"], ["--samples", "0", "-o", "s.csv"], ["--half", "0", "0", "-o", "s.csv"]):
        assert ask("pyramid", *FOOTPRINT, *arguments).returncode == 1
    assert not (ask.folder / "s.csv").exists()


@pytest.mark.parametrize("kind", ["pyramid", "compressed"])
def test_below_the_finest_level_needs_the_normals(ask, assets, kind):
    question = ["--uv", "0.3", "0.7", "--sigma", "3", "--half", "0.02", "-0.03"]
    process = ask(kind, *question)
    assert process.returncode == 1
    assert "--normals" in process.stderr
    with_normals = number(ask(kind, *question, "--normals", assets["normals"]))
    assert with_normals == pytest.approx(number(ask("normals", *question, "--sigma-r", "0.02")), rel=LEFT_OUT)
    (ask.folder / "q.csv").write_text("u,v,sigma,hx,hy\n0.3,0.7,3,0.02,-0.03\n")
    assert ask(kind, "--csv", "q.csv", "-o", "a.csv").returncode == 1
    assert ask(kind, "--csv", "q.csv", "-o", "a.csv", "--normals", assets["normals"]).returncode == 0


@pytest.mark.parametrize("kind", MODELS)
def test_positions_far_out_are_those_of_the_map(ask, kind):
    """Next to 4096 floats are an eighth of a texel of this map apart."""
    near, far = ("0.3", "0.7"), ("4096.3", "-4095.3")
    ask_at = lambda uv: number(ask(kind, "--uv", *uv, "--sigma", "14", "--half", "0.02", "-0.03"))
    assert ask_at(near) > 0
    assert ask_at(far) == pytest.approx(ask_at(near), rel=PRINTED)
    rows = "".join(f"{u},{v},14,0.02,-0.03\n" for u, v in (near, far))
    (ask.folder / "q.csv").write_text("u,v,sigma,hx,hy\n" + rows)
    assert ask(kind, "--csv", "q.csv", "-o", "a.csv").returncode == 0
    a, b = (float(line.split(",")[-1]) for line in (ask.folder / "a.csv").read_text().splitlines()[1:])
    assert a == pytest.approx(b, rel=PRINTED)


@pytest.mark.parametrize("kind", ["pyramid", "compressed"])
def test_a_footprint_that_is_widened_is_warned_of(ask, assets, kind):
    question = ["--uv", "0.3", "0.7", "--sigma", "15", "--half", "0.02", "-0.03"]  # level 0 has 13.9 texels
    assert "add --normals" in ask(kind, *question).stderr
    assert json.loads(ask(kind, *question, "--json").stdout)["result"]["widened"] is True
    answered = ask(kind, *question, "--normals", assets["normals"], "--json")
    assert json.loads(answered.stdout)["result"]["widened"] is False
    assert answered.stderr == ""


@pytest.mark.parametrize("kind", ["pyramid", "compressed"])
def test_interpolation_is_chosen(ask, kind):
    question = [*FOOTPRINT, "--half", "0.02", "-0.03", "--interpolation"]
    footprint, trilinear = number(ask(kind, *question, "footprint")), number(ask(kind, *question, "trilinear"))
    assert footprint == number(ask(kind, *FOOTPRINT, "--half", "0.02", "-0.03"))
    assert footprint != trilinear
    assert footprint == pytest.approx(trilinear, rel=0.5)


@pytest.mark.parametrize("kind", ["pyramid", "compressed"])
def test_pixels_are_smooth_or_constant(ask, kind):
    def density(x, *pixels):
        return number(ask(kind, *FOOTPRINT, "--half", str(x), "-0.03", *pixels))

    left, right = 0.0157, 0.0233  # both in one of 64 pixels
    assert density(left, "--pixels", "constant") == density(right, "--pixels", "constant")
    assert density(left, "--pixels", "smooth") == density(left) != density(right)


def test_normals_of_another_map_are_invalid_input(ask, assets, glint):
    question = ["--uv", "0.3", "0.7", "--sigma", "3", "--half", "0", "0"]
    for kind in ("pyramid", "compressed"):  # of the same size: told apart by the hash that the asset names
        process = ask(kind, *question, "--normals", assets["other"])
        assert process.returncode == 3
        assert "is not the map" in process.stderr and "give the asset that glint-pyramid read, normals.glint" in process.stderr
    glint("synth", "isotropic", "--size", "64", "-o", "small.exr")
    glint("ingest", "small.exr", "-o", "small.glint")
    for kind in ("pyramid", "compressed"):
        if kind in assets:
            assert ask(kind, *question, "--normals", "small.glint").returncode == 3
    assert ask("pyramid", *question, "--normals", assets["pyramid"]).returncode == 5  # another kind of asset


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["--uv", "0.3", "0.7", "--half", "0", "0"],
        ["--uv", "0.3", "0.7", "--sigma", "20"],
        ["--uv", "0.3", "--sigma", "20", "--half", "0", "0"],
        ["--uv", "0.3", "0.7", "--sigma", "-1", "--half", "0", "0"],
        ["--uv", "0.3", "0.7", "--sigma", "nan", "--half", "0", "0"],
        ["--uv", "0.3", "0.7", "--sigma", "20", "--cov", "1", "0", "1", "--half", "0", "0"],
        [*FOOTPRINT, "--half", "0", "0", "--range", "0", "0", "1", "1"],
        [*FOOTPRINT, "--range", "0", "0", "1"],
        [*FOOTPRINT, "--half", "0", "0", "--repeat", "-1"],
        [*FOOTPRINT, "--image", "a.png", "--image-size", "9999"],
        ["--csv", "q.csv"],
    ],
)
def test_questions_that_make_no_sense_are_usage_errors(ask, arguments):
    (ask.folder / "q.csv").write_text("u,v,sigma,hx,hy\n")
    process = ask("pyramid", *arguments)
    assert process.returncode == 1, process.stderr
    assert process.stdout == ""


@pytest.mark.parametrize(
    "options",
    [
        ["--levels", "99"],
        ["--levels", "0"],
        ["--levels", "two"],
        ["--stride", "1"],
        ["--stride", "1e9"],
        ["--resolution", "40"],
        ["--resolution", "16"],
        ["--resolution", "many"],
        ["--sigma-r", "0"],
        ["--sigma-r", "0.5"],
        ["--surface", "rough"],
        ["--precision", "double"],
    ],
)
def test_pyramid_options_out_of_range_are_usage_errors(glint, assets, options):
    process = glint("pyramid", assets["normals"], "-o", "p.glint", *options)
    assert process.returncode == 1, process.stderr
    assert not (glint.folder / "p.glint").exists()


def test_pyramid_reads_normals_only(glint, assets):
    assert glint("pyramid", assets["pyramid"], "-o", "p.glint").returncode == 5
    assert glint("pyramid", "missing.glint", "-o", "p.glint").returncode == 2


@pytest.mark.parametrize("kind", MODELS)
@pytest.mark.parametrize("kept", [0.1, 0.5, 0.999])
def test_truncated_assets_are_invalid_input(glint, assets, kind, kept):
    if kind not in assets:
        pytest.skip("glint-compress is not built")
    whole = assets[kind].read_bytes()
    (glint.folder / "cut.glint").write_bytes(whole[: int(kept * len(whole))])
    process = glint("query", "cut.glint", *FOOTPRINT, "--half", "0", "0")
    assert process.returncode == 3, process.stderr
    assert "cut.glint" in process.stderr
    if kind == "normals":
        assert glint("pyramid", "cut.glint", "-o", "p.glint").returncode == 3


@pytest.mark.parametrize("surface", ["flat", "smooth"])
def test_pyramids_do_not_depend_on_threads(glint, assets, surface):
    options = ["--stride", "32", "--resolution", "64", "--sigma-r", "0.02", "--surface", surface]
    for threads in ("1", "2"):
        process = glint("pyramid", assets["normals"], "-o", f"p{threads}.glint", *options, "--threads", threads)
        assert (process.returncode, process.stdout, process.stderr) == (0, "", "")
    assert (glint.folder / "p1.glint").read_bytes() == (glint.folder / "p2.glint").read_bytes()


def test_compressed_files_do_not_depend_on_threads(glint, assets):
    if "compressed" not in assets:
        pytest.skip("glint-compress is not built")
    for threads in ("1", "2"):
        assert glint("compress", assets["pyramid"], "-o", f"c{threads}.glint", "--threads", threads).returncode == 0
    assert (glint.folder / "c1.glint").read_bytes() == (glint.folder / "c2.glint").read_bytes()


def test_json_of_a_pyramid_lists_its_levels(glint, assets):
    options = ["--stride", "32", "--resolution", "64", "--sigma-r", "0.02", "--levels", "3", "--json"]
    result = json.loads(glint("pyramid", assets["normals"], "-o", "p.glint", *options).stdout)["result"]
    assert [level["stride_texels"] for level in result["levels"] if not level["is_mean"]] == [32, 64, 128]
    assert [level["columns"] * level["rows"] for level in result["levels"]] == [144, 36, 144, 1]
    assert [level["is_mean"] for level in result["levels"]] == [False, False, False, True]
    assert result["size_bytes"] == sum(level["size_bytes"] for level in result["levels"])


def test_resolution_is_chosen_by_sigma_r(glint, assets):
    for sigma_r, resolution in (
        ("0.02", 160),
        ("0.2", 32),
        ("0.001", 1024),
    ):  # sigma_r has 1.5 pixels or a little more, within the limits
        options = ["--resolution", "auto", "--sigma-r", sigma_r, "--levels", "1", "--stride", "128", "--json", "--force"]
        result = json.loads(glint("pyramid", assets["normals"], "-o", "p.glint", *options).stdout)["result"]
        assert result["resolution"] == resolution
        assert result["sigma_r_pixels"] == pytest.approx(float(sigma_r) * resolution / 2)
    for options, told in (
        ([], True),
        (["--resolution", "auto", "--sigma-r", "0.001", "--stride", "128"], False),
    ):  # as fine as it gets
        process = glint("pyramid", assets["normals"], "-o", "p.glint", "--force", "--verbose", "--levels", "1", *options)
        assert ("give --resolution auto" in process.stdout + process.stderr) == told


def test_pyramid_and_compressed_files_are_valid(glint, assets):
    for kind in ("pyramid", "compressed"):
        if kind in assets:
            assert glint("validate", assets[kind]).returncode == 0


@pytest.mark.parametrize("kind", ["pyramid", "compressed"])
def test_stretched_footprints_are_several_round_ones(ask, kind):
    half = ["--half", "0.05", "-0.02"]

    def answers(covariance, *options):
        return number(ask(kind, "--uv", "0.3", "0.7", "--cov", *covariance, *half, *options))

    across, up = ["1600", "0", "225"], ["225", "0", "1600"]
    assert answers(across) != pytest.approx(answers(up), rel=1e-3)
    assert answers(across, "--parts", "1") == answers(up, "--parts", "1")


def test_covariances_are_checked(ask):
    for covariance in (["100", "500", "100"], ["-100", "0", "100"]):
        process = ask("normals", "--uv", "0.3", "0.7", "--cov", *covariance, "--half", "0", "0")
        assert process.returncode == 1
        assert "no covariance" in process.stderr


def test_depfile_names_what_a_table_comes_from(ask, assets):
    (ask.folder / "in.csv").write_text("u,v,sigma,hx,hy\n0.3,0.7,20,0,0\n")
    assert (
        ask("pyramid", "--csv", "in.csv", "-o", "out.csv", "--normals", assets["normals"], "--depfile", "out.d").returncode == 0
    )
    rule = (ask.folder / "out.d").read_text()
    assert rule.startswith("out.csv:")
    for name in ("in.csv", "pyramid.glint", "normals.glint"):
        assert name in rule


def test_options_of_other_kinds_are_warned_of(ask):
    process = ask("pyramid", *FOOTPRINT, "--half", "0", "0", "--surface", "smooth")
    assert process.returncode == 0
    assert "warning: --surface has no effect" in process.stderr
    assert ask("normals", *FOOTPRINT, "--half", "0", "0", "--surface", "smooth").stderr == ""


BETWEEN_CENTRES = 0.02  # of a mean over some thousands of texels: what interpolation between images costs


@pytest.mark.parametrize(
    "size, uv", [("1024x128", (0.3, 0.1)), ("512x50", (0.3, 0.1)), ("1000x200", (0.3, 0.2)), ("64x700", (0.7, 0.9))]
)
def test_thin_maps_are_answered_as_their_texels_are(glint, tmp_path, size, uv):
    """A footprint that is wider than the map, in every form of the pyramid."""
    path = lambda kind: tmp_path / f"{kind}.glint"
    assert glint("synth", "brushed", "--size", size, "-o", tmp_path / "t.png", "--seed", "1").returncode == 0
    assert glint("ingest", tmp_path / "t.png", "-o", path("normals")).returncode == 0
    assert glint("pyramid", path("normals"), "-o", path("pyramid")).returncode == 0
    for method in "cp", "tucker", "pca":
        assert glint("compress", path("pyramid"), "-o", path(method), "--method", method, "--rank", "32").returncode == 0

    def ask(kind):
        process = glint(
            "query", path(kind), "--uv", *map(str, uv), "--sigma", "300", "--range", "-0.125", "-0.125", "0.125", "0.125"
        )
        assert process.returncode == 0, process.stderr
        return float(process.stdout)

    exact = ask("normals")
    assert glint("validate", path("pyramid")).returncode == 0
    for kind in "pyramid", "cp", "tucker", "pca":
        assert abs(ask(kind) / exact - 1) < BETWEEN_CENTRES, kind
