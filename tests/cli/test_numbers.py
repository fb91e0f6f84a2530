"""Numbers mean the same in options, configuration files, lists and tables, and tables are checked exactly like options."""

import json

import pytest

PLACE = ["--uv", "0.3", "0.7"]
HALF = ["--half", "0.02", "-0.03"]
KINDS = ["normals", "pyramid", "compressed", "bins", "sums"]
# Column names and option of each form of a footprint.
FORMS = {"--sigma": "sigma", "--cov": "sxx,sxy,syy", "--box": "ax,ay,bx,by"}


@pytest.fixture(scope="module")
def assets(tmp_path_factory):
    """A map and what answers for it. Paths by kind."""
    import subprocess

    from conftest import BIN

    folder = tmp_path_factory.mktemp("numbers")

    def run(name, *arguments):
        process = subprocess.run([BIN / f"glint-{name}", *arguments], cwd=folder, capture_output=True, text=True, timeout=120)
        assert process.returncode == 0, process.stderr

    run("synth", "isotropic", "--size", "128", "-o", "map.exr")
    run("ingest", "map.exr", "-o", "normals.glint")
    run("pyramid", "normals.glint", "-o", "pyramid.glint", "--stride", "32", "--resolution", "64", "--sigma-r", "0.02")
    run("compress", "pyramid.glint", "-o", "compressed.glint")
    run("binmap", "normals.glint", "-o", "bins.glint")
    run("sat", "normals.glint", "-o", "sums.glint")
    run("synth", "leather", "--height", "--size", "64", "-o", "heights.exr")
    run("ingest", "heights.exr", "--kind", "height", "--to", "heights", "-o", "heights.glint")
    run("displace", "heights.glint", "-o", "displaced.glint", "--factors", "8,16", "--angular", "3")
    return {kind: folder / f"{kind}.glint" for kind in (*KINDS, "displaced")}


def ask_table(glint, asset, text, *command):
    (glint.folder / "q.csv").write_text(text)
    return glint("query", *command, asset, "--csv", "q.csv", "-o", "-")


def test_a_number_with_zeros_in_front_is_decimal(glint):
    glint("synth", "flakes", "--size", "0016", "--seed", "0010", "-o", "a.exr")
    glint("synth", "flakes", "--size", "16x016", "--seed", "10", "-o", "b.exr")
    (glint.folder / "run.toml").write_text("seed = 010\n")
    glint("synth", "flakes", "--size", "16", "--config", "run.toml", "-o", "c.exr")
    pixels = [(glint.folder / name).read_bytes() for name in ("a.exr", "b.exr", "c.exr")]
    assert pixels[0] == pixels[1] == pixels[2]


@pytest.mark.parametrize(
    "option",
    [
        ["--seed", "18446744073709551616"],
        ["--seed", "-1"],
        ["--seed=-1"],
        ["--seed", "0x10"],
        ["--threads", "-1"],
        ["--threads", "4294967298"],
        ["--size", "4294967312"],
        ["--size", "16x4294967312"],
        ["--bits", "4294967304"],
    ],
)
def test_whole_numbers_that_do_not_fit_are_usage_errors(glint, option):
    process = (
        glint("synth", "flat", "--size", "16", "-o", "a.exr", *option)
        if "--size" not in option
        else glint("synth", "flat", "-o", "a.exr", *option)
    )
    assert process.returncode == 1, process.stderr
    assert option[0].split("=")[0] in process.stderr
    assert not (glint.folder / "a.exr").exists()


# What is no footprint: refused alike as an option and as a row, by every model.
@pytest.mark.parametrize(
    "form, values",
    [
        ("--sigma", "-4"),
        ("--sigma", "0"),
        ("--sigma", "1e-9"),
        ("--sigma", "2e9"),
        ("--sigma", "nan"),
        ("--sigma", "inf"),
        ("--sigma", "1e39"),
        ("--cov", "16 40 16"),
        ("--cov", "-16 0 16"),
        ("--cov", "16 0 -16"),
        ("--cov", "0 0 0"),
        ("--cov", "16 nan 16"),
        ("--cov", "1e30 0 1e30"),
        ("--box", "0 0 0 0"),
        ("--box", "8 0 8 0"),
        ("--box", "8 4 -16 -8"),
        ("--box", "1e30 0 0 1"),
        ("--box", "8 0 0 inf"),
    ],
)
def test_what_is_no_footprint_is_refused_as_an_option_and_as_a_row(glint, assets, form, values):
    words = values.split()
    for kind in KINDS:
        option = glint("query", assets[kind], *PLACE, form, *words, *HALF)
        assert option.returncode == 1, (kind, option.stdout, option.stderr)
        good = "20" if form == "--sigma" else "400,0,400" if form == "--cov" else "20,0,0,20"
        row = ask_table(glint, assets[kind], f"u,v,{FORMS[form]},hx,hy\n.3,.7,{good},0,0\n.3,.7,{','.join(words)},0,0\n")
        assert row.returncode == 3, (kind, row.stdout, row.stderr)
        assert row.stdout == ""
        assert "q.csv: row 2: " in row.stderr


@pytest.mark.parametrize("values", [".2 .2 -.2 -.2", ".1 -.2 .1 .2", "0 .3 .3 0"])
def test_a_range_without_area_is_refused_as_an_option_and_as_a_row(glint, assets, values):
    words = values.split()
    for kind in KINDS:
        option = glint("query", assets[kind], *PLACE, "--sigma", "20", "--range", *words)
        assert option.returncode == 1 and "--range" in option.stderr
        row = ask_table(glint, assets[kind], f"u,v,sigma,x0,y0,x1,y1\n.3,.7,20,0,0,.1,.1\n.3,.7,20,{','.join(words)}\n")
        assert row.returncode == 3 and "q.csv: row 2: " in row.stderr


# Footprints without a width are footprints: rounding makes them of thin ones.
@pytest.mark.parametrize(
    "form, values",
    [
        ("--cov", "400 400 400"),
        ("--cov", "400 0 0"),
        ("--cov", "0 0 400"),
        ("--cov", "400 400.0001 400"),
        ("--sigma", "20"),
        ("--box", "20 0 0 20"),
    ],
)
def test_a_footprint_is_answered_alike_as_an_option_and_as_a_row(glint, assets, form, values):
    for kind in KINDS:
        normals = ["--normals", assets["normals"]] if kind in ("pyramid", "compressed") else []
        option = glint("query", assets[kind], *PLACE, form, *values.split(), *HALF, *normals)
        assert option.returncode == 0, option.stderr
        (glint.folder / "q.csv").write_text(f"u,v,{FORMS[form]},hx,hy\n.3,.7,{','.join(values.split())},0.02,-0.03\n")
        row = glint("query", assets[kind], "--csv", "q.csv", "-o", "-", *normals)
        assert row.returncode == 0, row.stderr
        assert row.stdout.split(",")[-1].strip() == option.stdout.strip()


def test_a_row_below_the_finest_level_is_named(glint, assets):
    process = ask_table(glint, assets["pyramid"], "u,v,sigma,hx,hy\n.3,.7,20,0,0\n.3,.7,2,0,0\n")
    assert process.returncode == 1, "the row is good, but an option is missing"
    assert "q.csv: row 2: " in process.stderr and "--normals" in process.stderr


@pytest.mark.parametrize("start", ["\ufeff", '\ufeff"', ""])
def test_headers_survive_a_byte_order_mark_blanks_and_capitals(glint, assets, start):
    first = 'U"' if start.endswith('"') else "U"
    process = ask_table(glint, assets["normals"], f"{start}{first}, V,Sigma ,\tHX, hY\r\n 0.3 ,0.7,\t+020,.02, -0.03\r\n")
    assert process.returncode == 0, process.stderr
    expected = glint("query", assets["normals"], *PLACE, "--sigma", "20", *HALF).stdout.strip()
    assert process.stdout.splitlines()[1].split(",")[-1] == expected


def test_columns_that_make_no_query_are_named(glint, assets):
    process = ask_table(glint, assets["normals"], "u;v;sigma;hx;hy\n0;0;20;0;0\n")
    assert process.returncode == 3
    assert "u;v;sigma;hx;hy" in process.stderr
    process = ask_table(glint, assets["normals"], "u,v,sigma,U,hx,hy\n0,0,20,0,0,0\n")
    assert process.returncode == 3
    assert "two columns are named u" in process.stderr


@pytest.mark.parametrize(
    "table, message",
    [
        ("u,v,sigma,hx,hy,spread_y\n0,0,20,0,0,.1\n", "name all of spread_x,spread_y"),
        ("u;v;sigma;hx;hy\n0,3;0,7;20;0;0\n", "separated by semicolons"),
        ("# queries\nu,v,sigma,hx,hy\n0,0,20,0,0\n", "the first line is a comment"),
        ("u,v,sigma,hx\n0,0,20,0,0\n", "name all of hx,hy"),
        ("u,v,sigma\n0,0,20,0\n", "do not make one query"),
        ("u,v,sigma,hx,hy\n0,0,20,0,0\n0,0,20,0\n", "row 2: 4 fields"),
        ('u,v,sigma,hx,hy\n0,0,20,0,0\n0,0,"20"x,0,0\n', "row 2: "),
        ("u\0,\0v\0", "not UTF-8"),
    ],
)
def test_tables_are_judged_by_text_then_columns_then_rows(glint, assets, table, message):
    process = ask_table(glint, assets["normals"], table)
    assert process.returncode == 3 and message in process.stderr, process.stderr


def test_a_table_of_a_header_gets_the_column_that_its_rows_would_get(glint, assets):
    assert ask_table(glint, assets["normals"], "u,v,sigma,x0,y0,x1,y1\n").stdout == "u,v,sigma,x0,y0,x1,y1,mean\n"


@pytest.mark.parametrize("cell", ["nan", "inf", "", "x", "1e99", "0x1", "1 2"])
def test_cells_that_are_no_numbers_are_refused_by_row_and_column(glint, assets, cell):
    process = ask_table(glint, assets["normals"], f"u,v,sigma,hx,hy\n.3,.7,20,0,0\n.3,.7,20,{cell},0\n")
    assert process.returncode == 3
    assert "q.csv: row 2: column hx: " in process.stderr


@pytest.mark.parametrize(
    "table",
    [
        "u,v,sigma,hx,hy\n.5,.5,2,0,0\n.5,.5,-2,0,0\n",
        "u,v,level,hx,hy\n.5,.5,0,0,0\n.5,.5,0.5,0,0\n",
        "u,v,level,hx,hy\n.5,.5,1,0,0\n.5,.5,2,0,0\n",
        "u,v,level,wix,wiy,wiz,wox,woy,woz\n.5,.5,0,0,0,1,0,0,1\n.5,.5,0,0,0,0,0,0,1\n",
    ],
)
def test_rows_that_ask_a_displacement_are_checked_like_options(glint, assets, table):
    process = ask_table(glint, assets["displaced"], table, "reflectance")
    assert process.returncode == 3, process.stdout
    assert "q.csv: row 2: " in process.stderr


def test_numbers_of_area_lights_must_fit(glint):
    light = {"type": "sphere", "centre": [0, 0, 5], "radius": 1e60, "radiance": [1, 1, 1]}
    (glint.folder / "lights.json").write_text(json.dumps({"lights": [light]}))
    process = glint("shlobes", "--light", "lights.json", "-o", "l.glint", "--order", "4")
    assert process.returncode == 3
    assert "radius" in process.stderr


def test_a_bin_map_has_the_roughness_of_the_other_tools_by_default(glint, assets):
    """An asset made without a word about roughness answers as the normals do when they are asked without one."""
    question = [*PLACE, "--box", "24", "0", "0", "24", "--range", "-0.1", "-0.1", "0.1", "0.1"]
    bins = float(glint("query", assets["bins"], *question).stdout)
    normals = float(glint("query", assets["normals"], *question).stdout)
    # Bins hold a mean normal each, which moves mass over the border of a range by less than this.
    assert bins == pytest.approx(normals, rel=0.02)
    properties = json.loads(glint("info", assets["bins"], "--json").stdout)["result"]["properties"]
    assert properties["alpha"] == pytest.approx(0.005 * 2**0.5, rel=1e-6)


def test_messages_print_small_numbers_as_they_are(glint, assets):
    question = [*PLACE, "--sigma", "20", *HALF]
    assert (
        "roughnesses of 0.0070710676 to 0.0070710676, not 0.00015"
        in glint("query", assets["bins"], *question, "--alpha", "0.00015").stderr
    )
    process = glint("pyramid", assets["normals"], "-o", "p.glint", "--resolution", "1024", "--sigma-r", "1e-7")
    assert process.returncode == 1
    assert "give 0.0001953 (a tenth of a pixel" in process.stderr
