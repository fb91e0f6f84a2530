"""glint-pyramid --region and glint-merge: a pyramid in parts is the pyramid of one run, byte for byte."""

import json
import resource
import subprocess

import pytest
from conftest import run_all, run_once

SMALL = "--resolution 32 --sigma-r 0.05 --stride 16"
SHARDS = 3
MAP = ("synth flakes --size 192 -o map.png", "ingest map.png -o map.glint")


def make_shards(glint, flags=SMALL, count=SHARDS, name="map"):
    commands = [f"pyramid {name}.glint -o {name}.{i}of{count}.glint --region {i}/{count} {flags}" for i in range(1, count + 1)]
    run_all(glint, *commands)
    return [f"{name}.{i}of{count}.glint" for i in range(1, count + 1)]


def assert_same(glint, shards, flags, name="map"):
    run_all(glint, f"pyramid {name}.glint -o whole.glint --force {flags}", f"merge {' '.join(shards)} -o joined.glint --force")
    assert (glint.folder / "joined.glint").read_bytes() == (glint.folder / "whole.glint").read_bytes()


@pytest.fixture
def maps(glint):
    run_once(glint, *MAP)
    return glint


@pytest.mark.parametrize(
    "flags",
    [
        SMALL,
        SMALL + " --overlap 1 --levels 2",
        SMALL + " --boundary clamp --precision float",
        SMALL + " --surface smooth",
        "--resolution 32 --sigma-r 0.05 --stride 4 --surface smooth --boundary clamp",
        "--resolution 288 --sigma-r 0.004 --stride 32",  # several words of a mask for each image
    ],
)
def test_parts_are_the_whole(maps, flags):
    shards = make_shards(maps, flags)
    assert_same(maps, reversed(shards), flags)


@pytest.mark.parametrize(
    "size, flags", [("200x77", ""), ("77x200", ""), ("200x77", " --surface smooth"), ("77x200", " --surface smooth")]
)
def test_maps_need_not_be_square(glint, size, flags):
    run_once(glint, f"synth isotropic --size {size} -o map.png", "ingest map.png -o map.glint")
    flags = "--resolution 32 --sigma-r 0.05 --stride 4" + flags
    assert_same(glint, make_shards(glint, flags), flags)


def test_levels_that_agree_are_dropped(glint):
    """The levels of a map that looks the same everywhere agree, so that one run has fewer than its shards."""
    run_all(glint, "synth isotropic --size 512 --correlation 2 -o map.png", "ingest map.png -o map.glint")
    flags = "--resolution 32 --sigma-r 0.2 --stride 32"
    shards = make_shards(glint, flags)
    assert_same(glint, shards, flags)
    levels = lambda name: json.loads(glint("info", name, "--json").stdout)["result"]["properties"]["level_count"]
    assert levels("joined.glint") < levels(shards[0])


def test_more_regions_than_rows(maps):
    flags = "--resolution 32 --sigma-r 0.05 --stride 64 --levels 1"
    assert_same(maps, make_shards(maps, flags, 11), flags)


def test_one_region_is_the_whole(maps):
    assert_same(maps, make_shards(maps, SMALL, 1), SMALL)


def test_shards_are_valid_assets(maps):
    shards = make_shards(maps)
    for shard in shards:
        assert maps("validate", shard).returncode == 0
    info = json.loads(maps("info", shards[1], "--json").stdout)["result"]
    assert info["kind"] == "ndf-pyramid-shard" and info["provenance"]["command"]["region"] == "2/3"


@pytest.mark.parametrize("command", ["query {} --uv .5 .5 --sigma 8 --half 0 0", "compress {} -o out.glint"])
def test_tools_refuse_shards_with_the_remedy(maps, command):
    shard = make_shards(maps)[0]
    process = maps(*command.format(shard).split())
    assert process.returncode == 5 and "glint-merge" in process.stderr and shard in process.stderr


def fails(glint, rule, path, *arguments):
    process = glint("merge", *arguments, "-o", "joined.glint", "--json")
    error = json.loads(process.stdout)["error"]
    assert error["rule"] == rule and error["path"] == path, error
    assert error["remedy"] and not (glint.folder / "joined.glint").exists()
    return error["message"]


def test_missing_and_double_regions_are_refused(maps):
    first, second, third = make_shards(maps)
    assert "2/3 is missing" in fails(maps, "merge.missing", first, first, third)
    assert "1/3 is missing" in fails(maps, "merge.missing", second, second, third)
    assert "2 are missing, 1/3 the first" in fails(maps, "merge.missing", third, third)
    (maps.folder / "copy.glint").write_bytes((maps.folder / second).read_bytes())
    assert "is region 2/3" in fails(maps, "merge.double", "copy.glint", first, second, "copy.glint")


def test_shards_of_other_runs_are_refused(maps):
    first, second, third = make_shards(maps)
    run_all(
        maps,
        f"pyramid map.glint -o other.glint --region 2/3 {SMALL} --boundary clamp",
        f"pyramid map.glint -o four.glint --region 2/4 {SMALL}",
        "synth scratches --size 192 -o scratches.png",
        "ingest scratches.png -o scratches.glint",
        f"pyramid scratches.glint -o scratched.glint --region 2/3 {SMALL}",
        f"pyramid map.glint -o whole.glint {SMALL}",
    )
    assert '--boundary is "clamp", not "wrap"' in fails(maps, "merge.different", "other.glint", first, "other.glint", third)
    assert "one of 4 regions" in fails(maps, "merge.different", "four.glint", first, "four.glint", third)
    assert "another map" in fails(maps, "merge.different", "scratched.glint", first, "scratched.glint", third)
    assert "whole pyramid" in fails(maps, "merge.kind", "whole.glint", first, "whole.glint", third)
    assert "of kind normals" in fails(maps, "merge.kind", "map.glint", first, second, "map.glint")


def test_shards_of_another_version_are_refused(maps):
    h5py = pytest.importorskip("h5py")
    first, second, third = make_shards(maps)
    with h5py.File(maps.folder / second, "r+") as file:
        file.attrs.modify("generator", file.attrs["generator"].replace(b" 0.", b" 9."))
    process = maps("merge", first, second, third, "-o", "joined.glint", "--trust", "--json")
    error = json.loads(process.stdout)["error"]
    assert error["rule"] == "merge.different" and "glint-pyramid 9." in error["message"]


def test_damaged_shards_are_refused(maps):
    first, second, third = make_shards(maps)
    data = bytearray((maps.folder / second).read_bytes())
    data[-100] ^= 1
    (maps.folder / second).write_bytes(data)
    process = maps("merge", first, second, third, "-o", "joined.glint")
    assert process.returncode == 3 and second in process.stderr


@pytest.mark.parametrize("region", ["0/4", "5/4", "2", "1/0", "1/2000", "a/b", "1/4/5"])
def test_regions_must_be_parts_of_a_whole(maps, region):
    process = maps("pyramid", "map.glint", "-o", "out.glint", "--region", region)
    assert process.returncode == 1 and "--region" in process.stderr


def test_regions_are_of_maps_under_geometric_optics(maps):
    assert maps("pyramid", "map.glint", "-o", "out.glint", "--region", "1/2", "--optics", "wave").returncode == 1
    run_all(maps, "wang map.glint -o tiles.glint --size 32")
    process = maps("pyramid", "tiles.glint", "-o", "out.glint", "--region", "1/2")
    assert process.returncode == 5 and "--region" in process.stderr


@pytest.mark.parametrize(
    "rule, normal", [("normals.finite", (float("inf"), 0)), ("normals.finite", (0, float("nan"))), ("normals.disk", (0.8, 0.7))]
)
def test_texels_that_are_no_normals_are_found_where_they_count(maps, rule, normal):
    """The hashes of the map are those of the wrong texel, so that only the check of normals can find it."""
    h5py = pytest.importorskip("h5py")
    numpy = pytest.importorskip("numpy")
    from test_digest import digest, xxh3_128

    with h5py.File(maps.folder / "map.glint", "r+") as file:
        normals = file["normals"][...]
        normals[144, 100] = normal  # in the middle of the second of two regions
        file["normals"][...] = normals
        file["normals"].attrs.modify("xxh3_128", numpy.bytes_(xxh3_128(normals.tobytes())))
        file.attrs.modify("digest", numpy.bytes_(digest(file)))
    flags = "--resolution 32 --sigma-r 0.05 --stride 16 --levels 1".split()
    process = maps("pyramid", "map.glint", "-o", "out.glint", "--region", "2/2", *flags, "--json")
    error = json.loads(process.stdout)["error"]
    assert process.returncode == 3 and error["rule"] == rule and error["path"] == "map.glint", error
    assert "column 100, row 47 from the top" in error["message"] and not (maps.folder / "out.glint").exists()
    process = maps("pyramid", "map.glint", "-o", "out.glint", "--region", "1/2", *flags)
    assert process.returncode == 0, process.stderr
    process = maps("pyramid", "map.glint", "-o", "whole.glint", *flags, "--json")
    assert process.returncode == 3 and json.loads(process.stdout)["error"]["rule"] == rule


def test_unchanged_parts_and_wholes_are_left_alone(maps):
    shards = make_shards(maps)
    run_all(maps, f"merge {' '.join(shards)} -o joined.glint")
    again = lambda *arguments: json.loads(maps(*arguments, "--skip-unchanged", "--json").stdout)["status"]
    assert again("pyramid", "map.glint", "-o", shards[0], "--region", "1/3", *SMALL.split()) == "unchanged"
    assert again("pyramid", "map.glint", "-o", shards[0], "--region", "2/3", *SMALL.split()) == "ok"
    make_shards(maps, SMALL)
    assert again("merge", *shards, "-o", "joined.glint") == "unchanged"
    make_shards(maps, SMALL + " --boundary clamp --force")
    assert again("merge", *shards, "-o", "joined.glint") == "ok"


def limited(glint, name, *arguments, megabytes):
    """Runs a program that may take so much memory of its own. Maps of files do not count: the system takes their pages back."""
    limit = lambda: resource.setrlimit(resource.RLIMIT_DATA, (megabytes << 20, megabytes << 20))
    return subprocess.run(
        [glint.bin / f"glint-{name}", *arguments],
        cwd=glint.folder,
        capture_output=True,
        text=True,
        timeout=120,
        preexec_fn=limit,
    )


def test_parts_need_less_memory_than_the_whole(glint):
    run_all(glint, "synth flakes --size 1024 -o map.png", "ingest map.png -o map.glint")
    flags = ["--stride", "8", "--threads", "2"]
    assert limited(glint, "pyramid", "map.glint", "-o", "whole.glint", *flags, megabytes=300).returncode == 4
    shards = []
    for i in range(1, 9):
        shards.append(f"map.{i}of8.glint")
        process = limited(glint, "pyramid", "map.glint", "-o", shards[-1], "--region", f"{i}/8", *flags, megabytes=300)
        assert process.returncode == 0, process.stderr
    process = limited(glint, "merge", *shards, "-o", "joined.glint", "--threads", "2", megabytes=100)
    assert process.returncode == 0, process.stderr
    assert (glint.folder / "joined.glint").stat().st_size > 300 << 20
