"""UDIM sets through the tools: tiles that are cut from one large map answer as the large map."""

import ctypes
import json
import os

import h5py
import numpy as np
import OpenImageIO as oiio
import pytest
from conftest import BIN, run_all

WIDTH, HEIGHT, MARGIN = 96, 72, 64  # of a tile; the margin that tests ask for
CUT_TAIL = 2e-3  # a tile answers alone where a thousandth of a footprint lies beyond its margins
TILES = {1001: (0, 0), 1002: (1, 0), 1011: (0, 1), 1012: (1, 1)}


def write(path, image):
    """Writes an image whose bottom row comes first."""
    image = np.ascontiguousarray(image[::-1].reshape(image.shape[0], image.shape[1], -1), np.float32)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), oiio.ImageSpec(image.shape[1], image.shape[0], image.shape[2], "float"))
    assert output.write_image(image)
    output.close()


def cut(large, column, row):
    return large[row * HEIGHT : (row + 1) * HEIGHT, column * WIDTH : (column + 1) * WIDTH]


def large_heights():
    rng = np.random.default_rng(2)
    x, y = np.meshgrid(np.arange(2 * WIDTH), np.arange(2 * HEIGHT))
    return (np.sin(x / 5) + np.cos(y / 7) + 0.002 * x * y / 9 + 0.1 * rng.standard_normal(x.shape)).astype(np.float32)


def large_normals():
    """Normals whose mean follows the place, so that a footprint in the wrong place is seen."""
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.linspace(-0.25, 0.25, 2 * WIDTH), np.linspace(-0.25, 0.25, 2 * HEIGHT))
    n = np.stack([x, y], axis=-1) + 0.2 * rng.uniform(-1, 1, (2 * HEIGHT, 2 * WIDTH, 2))
    return np.concatenate([n, np.sqrt(1 - (n**2).sum(-1, keepdims=True))], axis=-1).astype(np.float32)


def make_images(folder, large, tiles=TILES, name="n"):
    write(folder / f"{name}.exr", large)
    for tile in tiles:
        write(folder / f"{name}.{tile}.exr", cut(large, *TILES[tile]))


def densities(glint, asset, uv, sigma, *options):
    rows = "\n".join(f"{u:.9g},{v:.9g},{sigma},0.1,-0.05" for u, v in uv)
    (glint.folder / "q.csv").write_text("u,v,sigma,hx,hy\n" + rows + "\n")
    process = glint("query", asset, "--csv", "q.csv", "-o", "-", *options)
    assert process.returncode == 0, process.stderr
    lines = process.stdout.split()
    column = lines[0].split(",").index("density")
    return np.array([float(line.split(",")[column]) for line in lines[1:]])


def places():
    """Random places, and places on and beside borders of tiles."""
    rng = np.random.default_rng(4)
    uv = rng.uniform(0.05, 1.95, (40, 2))
    uv[:10, 0] = 1
    uv[10:20, 1] = 1 + rng.uniform(-0.05, 0.05, 10)
    uv[0] = (1, 1)
    return uv


def relative(values, truth):
    return np.sqrt(((values - truth) ** 2).sum() / (truth**2).sum())


def test_texels_of_a_set_answer_as_the_large_map(glint):
    make_images(glint.folder, large_normals())
    run_all(glint, "ingest n.exr -o n.glint --boundary clamp", "ingest n.<UDIM>.exr -o n.<UDIM>.glint --udim-margin 64")
    uv = places()
    for sigma in (1, 6, 19):
        truth = densities(glint, "n.glint", uv / 2, sigma, "--boundary", "clamp", "--sigma-r", "0.05")
        assert relative(densities(glint, "n.<UDIM>.glint", uv, sigma, "--sigma-r", "0.05"), truth) < CUT_TAIL


def test_heights_have_their_slopes_across_borders(glint):
    make_images(glint.folder, large_heights(), name="h")
    run_all(
        glint,
        "ingest h.exr -o h.glint --kind height --boundary clamp",
        "ingest h.<UDIM>.exr -o h.<UDIM>.map.glint --kind height --udim-margin 16",
    )
    with h5py.File(glint.folder / "h.glint") as file:
        truth = file["normals"][:]
    for tile, (column, row) in TILES.items():
        with h5py.File(glint.folder / f"h.{tile}.map.glint") as file:
            left, below, right, above = file.attrs["udim_margins"]
            assert file.attrs["udim"] == tile
            assert (left, below, right, above) == (16 * column, 16 * row, 16 * (1 - column), 16 * (1 - row))
            texels = file["normals"][:]
        own = texels[below : below + HEIGHT, left : left + WIDTH]
        assert np.array_equal(own, cut(truth, column, row))


@pytest.fixture
def compressed(glint):
    """A set of three tiles, as images, maps, pyramids and compressed pyramids."""
    make_images(glint.folder, large_normals(), tiles=(1001, 1002, 1011))
    run_all(
        glint,
        "ingest n.<UDIM>.exr -o n.<UDIM>.map.glint --udim-margin 64 --depfile n.d",
        "pyramid n.<UDIM>.map.glint -o n.<UDIM>.p.glint --stride 8 --resolution 64 --sigma-r 0.05 --depfile p.d",
        "compress n.<UDIM>.p.glint -o n.<UDIM>.cp.glint --tolerance 0.1",
        "moments n.<UDIM>.map.glint -o n.<UDIM>.m.glint",
    )
    return glint


def test_a_set_goes_through_every_tool_that_takes_sets(compressed):
    glint = compressed
    make_images(glint.folder, large_normals(), tiles=(), name="n")
    run_all(glint, "ingest n.exr -o n.glint --boundary clamp")
    uv = places()
    uv = uv[(uv.max(axis=1) < 0.75) | (uv.min(axis=1) < 0.75) & (uv.max(axis=1) > 1.1) & (uv.min(axis=1) < 0.7)]
    truth = densities(glint, "n.glint", uv / 2, 8, "--boundary", "clamp", "--sigma-r", "0.05")
    of_pyramids = relative(densities(glint, "n.<UDIM>.p.glint", uv, 8), truth)
    assert 0 < of_pyramids < 0.1
    assert relative(densities(glint, "n.<UDIM>.cp.glint", uv, 8), truth) < 0.2
    with_normals = densities(glint, "n.<UDIM>.cp.glint", uv, 1, "--normals", "n.<UDIM>.map.glint")
    truth = densities(glint, "n.glint", uv / 2, 1, "--boundary", "clamp", "--sigma-r", "0.05")
    assert relative(with_normals, truth) < 0.02
    assert (densities(glint, "n.<UDIM>.m.glint", uv, 8, "--sigma-r", "0.05") > 0).all()

    # Depfiles name every file of the set; tiles depend on their neighbours.
    for depfile, kind in (("n.d", "exr"), ("p.d", "map.glint")):
        text = (glint.folder / depfile).read_text()
        assert all(f"n.{tile}.{kind}" in text for tile in (1001, 1002, 1011))

    # The other tools that take patterns.
    assert glint("validate", "n.<UDIM>.cp.glint").returncode == 0
    info = json.loads(glint("info", "n.<UDIM>.p.glint", "--json").stdout)["result"]["tiles"]
    assert [entry["tile"] for entry in info] == [1001, 1002, 1011]
    assert info[1]["result"]["udim"] == {"tile": 1002, "margins_texels": [MARGIN, 0, 0, 0]}

    # Where the set has no tile.
    process = glint("query", "n.<UDIM>.cp.glint", "--uv", "1.5", "1.5", "--sigma", "8", "--half", "0.1", "0")
    assert (process.returncode, process.stdout.strip()) == (0, "0")
    assert "no tile at uv 1.5 1.5" in process.stderr


def test_c_programs_open_a_set(compressed):
    glint = compressed
    library = ctypes.CDLL(BIN.parent / "libglint" / "libglint.so")

    class Footprint(ctypes.Structure):
        _fields_ = [
            ("kind", ctypes.c_int32),
            ("u", ctypes.c_double),
            ("v", ctypes.c_double),
            ("m", ctypes.c_float * 4),
            ("spread", ctypes.c_float * 2),
        ]

    library.glint_footprint_isotropic.restype = Footprint
    library.glint_footprint_isotropic.argtypes = [ctypes.c_double, ctypes.c_double, ctypes.c_float]
    library.glint_error_message.restype = ctypes.c_char_p
    ndf = ctypes.c_void_p()
    path = os.fsencode(glint.folder / "n.<UDIM>.cp.glint")
    assert library.glint_ndf_open(path, None, ctypes.byref(ndf)) == 0, library.glint_error_message()
    uv = [(0.3, 0.4), (1.02, 0.6), (0.7, 0.99), (1.5, 1.5)]
    answers = []
    for u, v in uv:
        footprint, density = library.glint_footprint_isotropic(u, v, 8), ctypes.c_float()
        assert (
            library.glint_density(
                ndf, ctypes.byref(footprint), ctypes.c_float(0.1), ctypes.c_float(-0.05), ctypes.byref(density)
            )
            == 0
        )
        answers.append(density.value)
    library.glint_ndf_close(ndf)
    assert np.allclose(answers, densities(glint, "n.<UDIM>.cp.glint", uv, 8), rtol=1e-6)
    assert answers[3] == 0 < min(answers[:3])


def test_only_tiles_whose_inputs_changed_are_made_again(glint):
    large = np.concatenate([large_normals()] * 2, axis=1)
    for column in range(4):
        write(glint.folder / f"n.{1001 + column}.exr", cut(large, column, 0))
    ingest = ("ingest", "n.<UDIM>.exr", "-o", "n.%(UDIM)d.map.glint", "--skip-unchanged", "--json")
    statuses = lambda process: [tile["status"] for tile in json.loads(process.stdout)["result"]["tiles"]]
    assert statuses(glint(*ingest)) == ["ok"] * 4
    assert statuses(glint(*ingest)) == ["unchanged"] * 4
    write(glint.folder / "n.1001.exr", cut(large, 1, 1))
    assert statuses(glint(*ingest)) == ["ok", "ok", "unchanged", "unchanged"]


def test_a_damaged_tile_is_named_and_leaves_no_asset(glint):
    make_images(glint.folder, large_normals(), tiles=(1001, 1003 - 1))
    bad = large_normals()[:HEIGHT, :WIDTH].copy()
    bad[3, 5] = np.nan
    write(glint.folder / "n.1003.exr", bad)
    process = glint("ingest", "n.<UDIM>.exr", "-o", "n.<UDIM>.glint")
    assert process.returncode == 3
    assert "n.1003.exr" in process.stderr and "--fix-invalid" in process.stderr
    assert sorted(path.name for path in glint.folder.glob("n.*.glint")) == ["n.1001.glint"]  # 1002 needs the texels of 1003
    assert glint("ingest", "n.<UDIM>.exr", "-o", "n.<UDIM>.glint", "--fix-invalid").returncode == 0


def test_files_that_a_set_leaves_out_and_tiles_that_are_gone_are_named(glint):
    make_images(glint.folder, large_normals(), tiles=(1001, 1002))
    image = (glint.folder / "n.1001.exr").read_bytes()
    for name in ("n.0999.exr", "n.10011.exr"):
        (glint.folder / name).write_bytes(image)
    process = glint("ingest", "n.<udim>.exr", "-o", "n.<UDIM>.glint")  # lower case, as Arnold has it
    assert process.returncode == 0, process.stderr
    assert [line.split(": ")[2] for line in process.stderr.splitlines()] == ["n.0999.exr", "n.10011.exr"]
    assert sorted(path.name for path in glint.folder.glob("n.*.glint")) == ["n.1001.glint", "n.1002.glint"]
    for name in ("n.0999.exr", "n.10011.exr", "n.1002.exr"):
        (glint.folder / name).unlink()
    process = glint("ingest", "n.<UDIM>.exr", "-o", "n.<UDIM>.glint")
    assert process.returncode == 0 and "n.1002.glint: is of a tile that the input has no file of: remove it" in process.stderr
    (glint.folder / "n.1002.glint").unlink()
    assert glint("ingest", "n.<UDIM>.exr", "-o", "n.<UDIM>.glint").stderr == ""


def test_wrong_uses_say_what_to_do(glint):
    make_images(glint.folder, large_normals(), tiles=(1001, 1002))
    run_all(glint, "ingest n.<UDIM>.exr -o n.<UDIM>.glint --udim-margin 64", "ingest n.exr -o n.glint")

    def refused(code, text, *command):
        process = glint(*command)
        assert process.returncode == code, process.stderr
        assert text in process.stderr
        assert process.stderr.count("\n") == 1

    refused(1, "put <UDIM> into the name of the output", "ingest", "n.<UDIM>.exr", "-o", "x.glint")
    refused(1, "names a UDIM set", "ingest", "n.exr", "-o", "x.<UDIM>.glint")
    refused(2, "no file of a tile", "ingest", "none.<UDIM>.exr", "-o", "x.<UDIM>.glint")
    refused(1, "does not repeat", "ingest", "n.<UDIM>.exr", "-o", "x.<UDIM>.glint", "--boundary", "wrap")
    refused(1, "does not repeat", "pyramid", "n.<UDIM>.glint", "-o", "x.<UDIM>.glint", "--boundary", "wrap")
    refused(5, "glint-pyramid", "binmap", "n.<UDIM>.glint", "-o", "x.<UDIM>.glint")
    refused(5, "glint-pyramid", "sat", "n.1001.glint", "-o", "x.glint")
    refused(
        5, "not made of sets", "pyramid", "n.<UDIM>.glint", "-o", "x.<UDIM>.glint", "--optics", "wave", "--coherence-um", "10"
    )
    (glint.folder / "own.1001.glint").write_bytes((glint.folder / "n.glint").read_bytes())
    refused(3, "map of its own", "pyramid", "own.<UDIM>.glint", "-o", "x.<UDIM>.glint")
    refused(3, "map of its own", "query", "own.<UDIM>.glint", "--uv", "0", "0", "--sigma", "3", "--half", "0", "0")
