"""Tools refuse assets that hold values which are none, and say where they are."""

import math
import shutil
import struct
import subprocess

import pytest
from conftest import BIN

h5py = pytest.importorskip("h5py")

SIZE = 64
BAD = {"nan": math.nan, "infinite": math.inf, "outside": 1.5}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with one small asset of every kind that something is made from."""
    folder = tmp_path_factory.mktemp("assets")
    runs = [
        ("synth", "isotropic", "--size", SIZE, "-o", "map.exr"),
        ("ingest", "map.exr", "-o", "normals.glint"),
        ("synth", "isotropic", "--height", "--size", SIZE, "-o", "heights.exr"),
        ("ingest", "heights.exr", "--kind", "height", "--to", "heights", "-o", "heights.glint"),
        ("pyramid", "normals.glint", "-o", "pyramid.glint", "--stride", "16"),
        ("compress", "pyramid.glint", "-o", "compressed.glint", "--rank", "4"),
        ("sat", "normals.glint", "-o", "sat.glint"),
        ("displace", "heights.glint", "-o", "displaced.glint", "--factor", "16", "--base", "diffuse:0.8"),
    ]
    runs += [
        ("ingest", "heights.exr", "--kind", "height", "--to", "heights", "--texel-size-um", "1", "-o", "waves.glint"),
        (
            "pyramid",
            "waves.glint",
            "-o",
            "wave-pyramid.glint",
            *"--optics wave --stride 32 --resolution 64 --wavelengths 3".split(),
        ),
        ("compress", "wave-pyramid.glint", "-o", "wave-cp.glint", "--tolerance", "0.2"),
        ("shlobes", "--light", "lights.json", "-o", "light.glint", "--order", "4"),
        ("shlobes", "--sigma-r", "0.1", "-o", "lobes.glint", "--order", "4"),
        ("wang", "normals.glint", "-o", "tiles.glint", "--size", "16"),
    ]
    (folder / "lights.json").write_text(
        '{"lights": [{"type": "sphere", "centre": [0, 0, 5], "radius": 1, "radiance": [1, 1, 1]}]}'
    )
    for tool, *arguments in runs:
        subprocess.run([BIN / f"glint-{tool}", *map(str, arguments)], cwd=folder, check=True, timeout=120)
    return folder


@pytest.fixture
def assets(glint, made):
    """The folder of the test, with copies of these assets."""
    for path in made.glob("*.glint"):
        shutil.copy(path, glint.folder)
    return glint.folder


def with_value(folder, source, dataset, element, value, name="bad.glint"):
    """A copy of an asset with one f32 element of a dataset replaced."""
    shutil.copy(folder / source, folder / name)
    with h5py.File(folder / source, "r") as file:
        place = file[dataset].id.get_offset() + 4 * element
        assert file[dataset].dtype == "<f4"
    with open(folder / name, "r+b") as file:
        file.seek(place)
        file.write(struct.pack("<f", value))
    return name


# Column 3, row 7 from the top; rows are stored from the bottom.
TEXEL = (SIZE - 1 - 7) * SIZE + 3


@pytest.mark.parametrize("value", BAD.values(), ids=BAD.keys())
@pytest.mark.parametrize(
    "tool, arguments",
    [
        ("pyramid", ["-o", "out.glint"]),
        ("sat", ["-o", "out.glint"]),
        ("moments", ["-o", "out.glint"]),
        ("binmap", ["-o", "out.glint", "--alpha", "0.02"]),
        ("query", ["--uv", ".5", ".5", "--sigma", "9", "--image", "out.exr"]),
        ("query", ["--uv", ".5", ".5", "--sigma", "9", "--samples", "10", "-o", "out.csv"]),
        ("query", ["--uv", ".5", ".5", "--sigma", "9", "--surface", "smooth", "--image", "out.exr"]),
    ],
    ids=["pyramid", "sat", "moments", "binmap", "image", "samples", "smooth-image"],
)
def test_normals_that_are_none_are_named_by_their_texel(glint, assets, tool, arguments, value):
    bad = with_value(assets, "normals.glint", "normals", 2 * TEXEL, value)
    process = glint(tool, bad, *arguments)
    assert process.returncode == 3, process.stderr
    assert "column 3, row 7 from the top" in process.stderr and "bad.glint" in process.stderr
    assert not any((assets / name).exists() for name in ["out.glint", "out.exr", "out.csv"])


@pytest.mark.parametrize("value", [*BAD.values(), -1e30], ids=[*BAD, "huge"])
@pytest.mark.parametrize(
    "line",
    [
        "pyramid bad.glint -o out.glint --stride 16",
        "pyramid bad.glint -o out.glint --stride 16 --surface smooth",
        "pyramid bad.glint -o out.glint --stride 16 --keep-normals i16",
        "pyramid bad.glint -o out.glint --stride 16 --region 2/2",
        "sat bad.glint -o out.glint",
        "moments bad.glint -o out.glint",
        "binmap bad.glint -o out.glint",
        "tiny bad.glint -o out.glint --cut 16",
        "wang bad.glint -o out.glint --size 16",
        "query bad.glint --uv .5 .5 --sigma 9 --image out.exr",
    ],
)
def test_normals_that_are_none_stop_builders_that_trust_their_input(glint, assets, line, value):
    with_value(assets, "normals.glint", "normals", 2 * TEXEL, value)
    process = glint(*line.split(), "--trust")
    assert process.returncode == 3 and process.stderr.count("\n") == 1, process.stderr
    assert "column 3, row 7 from the top" in process.stderr and "bad.glint" in process.stderr
    assert not any((assets / name).exists() for name in ["out.glint", "out.exr"])


@pytest.mark.parametrize("value", BAD.values(), ids=BAD.keys())
def test_other_texels_that_are_none_stop_builders_that_trust_their_input(glint, assets, value):
    with_value(assets, "tiles.glint", "normals", 2 * (16 * 16 + 40), value, "bad-tiles.glint")
    lines = [
        "pyramid bad-tiles.glint -o out.glint --stride 4",
        "wang bad-tiles.glint -o out.glint --explicit 32 32",
    ]
    if not math.isfinite(value):
        with_value(assets, "waves.glint", "heights", TEXEL, value)
        lines += [
            "pyramid bad.glint -o out.glint --optics wave --stride 32 --resolution 64 --wavelengths 3",
            "displace bad.glint -o out.glint --factor 16 --base diffuse:0.8",
            "moments bad.glint -o out.glint",
        ]
    for line in lines:
        process = glint(*line.split(), "--trust")
        assert process.returncode == 3 and process.stderr.count("\n") == 1, (line, process.stderr)
        assert ("tile 1 " if "tiles" in line else "column 3, row 7 from the top") in process.stderr
        assert not (assets / "out.glint").exists()


@pytest.mark.parametrize("value", BAD.values(), ids=BAD.keys())
@pytest.mark.parametrize("kept", ["i16", "f32"])
def test_kept_normals_that_are_none_stop_a_merge_that_trusts_its_shards(glint, assets, kept, value):
    for k in (1, 2):
        line = f"pyramid normals.glint -o shard{k}.glint --force --stride 16 --keep-normals {kept} --region {k}/2"
        assert glint(*line.split()).returncode == 0
    with_value(assets, "shard2.glint", "near/normals", 7, value)
    process = glint("merge", "shard1.glint", "bad.glint", "-o", "out.glint", "--trust")
    assert process.returncode == 3 and "bad.glint" in process.stderr and process.stderr.count("\n") == 1, process.stderr
    assert not (assets / "out.glint").exists()


@pytest.mark.parametrize("dataset", ["level_00/pixels", "level_00/block_means"])
@pytest.mark.parametrize("value", [math.nan, math.inf, -1e30], ids=["nan", "infinite", "negative"])
def test_pyramids_with_bad_values_do_not_crash_a_compression_that_trusts_them(glint, assets, dataset, value):
    assert glint("pyramid", "normals.glint", "-o", "f32.glint", "--stride", "16", "--precision", "float").returncode == 0
    bad = with_value(assets, "f32.glint", dataset, 0, value)
    for method in ("cp", "tucker", "pca"):
        for size in (["--rank", "4"], ["--tolerance", ".2"]):
            process = glint("compress", bad, "-o", "out.glint", "--force", "--method", method, *size, "--trust")
            assert process.returncode in (0, 3, 4), process.stderr
            asked = glint("query", "out.glint", "--uv", ".1", ".1", "--sigma", "20", "--half", ".1", "0")
            assert asked.returncode in (0, 2, 3), asked.stderr  # 2: nothing was made


@pytest.mark.parametrize("value", BAD.values(), ids=BAD.keys())
def test_one_query_of_normals_that_are_none_is_refused(glint, assets, value):
    bad = with_value(assets, "normals.glint", "normals", 2 * TEXEL, value)
    for question in [["--half", ".1", ".05"], ["--range", "-.2", "-.2", ".2", ".2"]]:
        for surface in ["flat", "smooth"]:
            at = ["--uv", (3 + 0.5) / SIZE, 1 - (7 + 0.5) / SIZE]
            process = glint("query", bad, *at, "--sigma", "2", "--surface", surface, *question)
            assert process.returncode == 3 and process.stdout == ""
            assert "column 3, row 7 from the top" in process.stderr
    assert glint("info", bad).returncode in (0, 3)


@pytest.mark.parametrize("value", [math.nan, math.inf], ids=["nan", "infinite"])
def test_heights_that_are_none_are_named_by_their_texel(glint, assets, value):
    bad = with_value(assets, "heights.glint", "heights", TEXEL, value)
    for tool, *flags in [("displace", "--factor", "16", "--base", "diffuse:0.8"), ("moments",)]:
        process = glint(tool, bad, "-o", "out.glint", *flags)
        assert process.returncode == 3
        assert "column 3, row 7 from the top" in process.stderr
        assert not (assets / "out.glint").exists()


def test_pyramids_with_bad_means_are_not_compressed(glint, assets):
    bad = with_value(assets, "pyramid.glint", "level_00/block_means", 0, math.nan)
    process = glint("compress", bad, "-o", "out.glint", "--rank", "4")
    assert process.returncode == 3
    assert "pyramid.block_means" in process.stderr or "from the top" in process.stderr
    assert not (assets / "out.glint").exists()


@pytest.mark.parametrize(
    "source, dataset",
    [
        ("pyramid.glint", "level_00/block_means"),
        ("compressed.glint", "image_scales"),
        ("compressed.glint", "scales"),
        ("sat.glint", "bin_normals"),
    ],
)
@pytest.mark.parametrize("value", [math.nan, math.inf, -1e30], ids=["nan", "infinite", "negative"])
def test_queries_of_other_kinds_with_bad_values_are_refused(glint, assets, source, dataset, value):
    bad = with_value(assets, source, dataset, 0, value)
    footprint = ["--uv", ".1", ".1", "--sigma", "20"]
    for question in [["--half", ".02", ".01"], ["--image", "out.exr"], ["--samples", "5", "-o", "out.csv"]]:
        assert glint("query", bad, *footprint, *question).returncode == 3


@pytest.mark.parametrize("dataset", ["heights", "lobes", "slopes", "spatial_scale"])
def test_queries_of_displacements_with_bad_values_are_refused(glint, assets, dataset):
    bad = with_value(assets, "displaced.glint", f"level_00/{dataset}", 0, math.nan)
    place = ["--uv", ".05", ".05", "--level", "0"]
    light = ["--wi", ".3", ".1", ".9", "--wo", "-.2", ".1", ".9"]
    for question in [light, ["--image", "out.exr"]]:
        process = glint("query", "reflectance", bad, *place, *question)
        assert process.returncode == 3 and process.stdout == ""


def test_normals_of_another_map_are_refused(glint, assets):
    other = [
        ("synth", "isotropic", "--size", SIZE, "--seed", "5", "-o", "other.exr"),
        ("ingest", "other.exr", "-o", "other.glint"),
    ]
    assert all(glint(*run).returncode == 0 for run in other)
    question = ["--uv", ".5", ".5", "--sigma", "2", "--half", ".1", "0"]
    for asset in ["pyramid.glint", "compressed.glint"]:
        assert glint("query", asset, "--normals", "normals.glint", *question).returncode == 0
        process = glint("query", asset, "--normals", "other.glint", *question)
        assert process.returncode == 3
        assert "is not the map" in process.stderr


def test_the_inputs_of_a_compressed_pyramid_name_its_map(glint, assets):
    text = glint("info", "compressed.glint").stdout
    assert "pyramid.glint/normals.glint" in text


# Assets of which a bit is flipped, and command lines that read them.
INSIDE_TILE = 4 * 2 * (8 * 16 + 8)  # offset of column 8, row 8 of a tile: its sides must be like those of others
POINT = "--uv .5 .5 --sigma"
DIRECTIONS = "--wi .3 .1 .9 --wo -.2 .1 .9"
READERS = [
    ("normals", "pyramid normals.glint -o out.glint"),
    ("normals", "sat normals.glint -o out.glint"),
    ("normals", "moments normals.glint -o out.glint"),
    ("normals", "binmap normals.glint -o out.glint --alpha 0.02"),
    ("normals", "tiny normals.glint -o out.glint --cut 16"),
    ("normals", "wang normals.glint -o out.glint --size 32"),
    ("heights", "displace heights.glint -o out.glint --factor 16 --base diffuse:0.8"),
    ("waves", "pyramid waves.glint -o out.glint --optics wave --stride 32 --resolution 64 --wavelengths 3"),
    ("pyramid", "compress pyramid.glint -o out.glint --rank 4"),
    ("normals", f"query normals.glint {POINT} 9 --half .1 0"),
    ("normals", f"query compressed.glint --normals normals.glint {POINT} 2 --half .1 0"),
    ("compressed", f"query compressed.glint {POINT} 20 --half .1 0"),
    ("sat", f"query sat.glint {POINT} 20 --half .1 0"),
    ("wave-pyramid", f"query wave-pyramid.glint {POINT} 20 --half .1 0"),
    ("wave-pyramid", "compress wave-pyramid.glint -o out.glint --rank 4"),
    ("wave-cp", f"query wave-cp.glint {POINT} 20 --half .1 0"),
    ("displaced", f"query reflectance displaced.glint --uv .05 .05 --level 0 {DIRECTIONS}"),
    ("sat", f"query light sat.glint --light light.glint {POINT} 20 --wo .3 .1 .9"),
    ("light", f"query light sat.glint --light light.glint {POINT} 20 --wo .3 .1 .9"),
    ("lobes", f"query light sat.glint --light light.glint --lobes lobes.glint {POINT} 20 --wo .3 .1 .9"),
    ("tiles", "query plane tiles.glint --texel 5 7 --sigma 2 --half .1 0"),
]


@pytest.mark.parametrize(
    "source, line", READERS, ids=[f"{line.split()[0]}-{source}-{k}" for k, (source, line) in enumerate(READERS)]
)
def test_flipped_bits_are_refused_unless_they_are_trusted(glint, assets, source, line):
    """The lowest bit of a float is a value like any other: only the hash can tell."""
    path = assets / f"{source}.glint"
    with h5py.File(path, "r") as file:
        arrays = []
        file.visititems(
            lambda _, thing: (
                arrays.append(thing.id.get_offset())
                if isinstance(thing, h5py.Dataset) and thing.dtype in ("<f4", "<f2")
                else None
            )
        )
    data = bytearray(path.read_bytes())
    data[arrays[0] + (INSIDE_TILE if source == "tiles" else 0)] ^= 1
    command = line.split()
    sound = glint(*command)
    assert sound.returncode == 0, sound.stderr
    (assets / "out.glint").unlink(missing_ok=True)
    path.write_bytes(data)
    process = glint(*command)
    assert process.returncode == 3, process.stderr
    # A bound of normals that is too small by a bit is found by its texels first.
    assert "has bytes with hash" in process.stderr or "does not hold all texels" in process.stderr
    assert process.stdout == "" and not (assets / "out.glint").exists()
    trusted = glint(*command, "--trust")
    if "--normals" in line:
        assert trusted.returncode == 3 and "is not the map" in trusted.stderr
    else:
        assert trusted.returncode == 0, trusted.stderr
