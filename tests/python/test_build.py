"""Builders make what the tools make, from arrays and without files of one's own."""

import gc
import inspect
import json
import os
import re
import subprocess
import sys

import numpy as np
import pytest

import glint_ndf as gn


def arrays_of(asset):
    """Hash of every array of an asset, by its path."""
    return {d["path"]: d["hash"] for d in gn.info(asset)["datasets"]}


@pytest.mark.parametrize(
    "made, tool, options",
    [
        (lambda n: gn.pyramid(n), "glint-pyramid", []),
        (
            lambda n: gn.pyramid(n, surface="smooth", stride=16, sigma_r=0.02, levels=2, precision="float", resolution="auto"),
            "glint-pyramid",
            [
                "--surface",
                "smooth",
                "--stride",
                "16",
                "--sigma-r",
                "0.02",
                "--levels",
                "2",
                "--precision",
                "float",
                "--resolution",
                "auto",
            ],
        ),
        (lambda n: gn.bin_map(n, alpha=0.02, alpha_max=0.1), "glint-binmap", ["--alpha", "0.02:0.1"]),
        (lambda n: gn.bin_map(n), "glint-binmap", []),
        (lambda n: gn.histogram(n), "glint-sat", []),
        (lambda n: gn.moments(n), "glint-moments", []),
        (lambda n: gn.compress(gn.pyramid(n), tolerance=0.3), "glint-compress", ["--tolerance", "0.3"]),
        (lambda n: gn.compress(gn.pyramid(n), method="cp", rank=4), "glint-compress", ["--method", "cp", "--rank", "4"]),
    ],
    ids=["pyramid", "pyramid-smooth", "bin-map-range", "bin-map", "histogram", "moments", "compress", "compress-cp"],
)
def test_builders_make_the_arrays_of_the_tools(made, tool, options, noise, run_tool, tmp_path):
    noise.save(tmp_path / "n.glint")
    source = tmp_path / "n.glint"
    if tool == "glint-compress":
        run_tool("glint-pyramid", source, "-o", tmp_path / "p.glint")
        source = tmp_path / "p.glint"
    run_tool(tool, source, "-o", tmp_path / "out.glint", *options)
    asset = made(noise)
    assert arrays_of(asset) == arrays_of(tmp_path / "out.glint")
    assert gn.validate(asset).valid


def test_displaced_and_waves_are_those_of_the_tools(run_tool, tmp_path):
    heights = gn.synth("isotropic", 32, heights=True, texel_size_um=1.0, alpha=0.05)  # wave optics of steep maps take long
    heights.save(tmp_path / "h.glint")
    run_tool("glint-displace", tmp_path / "h.glint", "-o", tmp_path / "d.glint", "--factor", "8", "--base", "diffuse:0.5")
    assert arrays_of(gn.displace(heights, factors=[8], albedo=0.5)) == arrays_of(tmp_path / "d.glint")
    bins = np.array([4, 4, 4], "<i4").tobytes()
    (tmp_path / "grey.binary").write_bytes(bins + np.repeat(np.array([1500, 1500 / 1.15, 1500 / 1.66]) / 8, 64).tobytes())
    table = ["--base-table", tmp_path / "grey.binary"]
    run_tool("glint-displace", tmp_path / "h.glint", "-o", tmp_path / "t.glint", "--factor", "8", *table)
    displaced = gn.displace(heights, factors=[8], base="table", table=tmp_path / "grey.binary")
    assert arrays_of(displaced) == arrays_of(tmp_path / "t.glint")
    with pytest.raises(gn.ArgumentError, match="table"):
        gn.displace(heights, base="table")
    run_tool(
        "glint-pyramid",
        tmp_path / "h.glint",
        "-o",
        tmp_path / "w.glint",
        "--optics",
        "wave",
        "--coherence-um",
        "5",
        "--stride",
        "16",
    )
    assert arrays_of(gn.wave_pyramid(heights, stride=16, coherence_um=5)) == arrays_of(tmp_path / "w.glint")


def test_synthetic_maps_are_those_of_the_tool(run_tool, tmp_path):
    run_tool("glint-synth", "scratches", "--size", "96x64", "--seed", "5", "-o", tmp_path / "s.exr")
    run_tool("glint-ingest", tmp_path / "s.exr", "-o", tmp_path / "s.glint")
    texels = gn.load(tmp_path / "s.glint").texels()
    assert np.abs(gn.synth("scratches", 96, 64, seed=5).texels() - texels).max() < 1e-3  # of a file of half floats


def test_images_have_their_top_row_first():
    image = np.full((4, 6, 3), (0.5, 0.5, 1.0), dtype=np.float32)
    image[0, :, 0] = 0.6  # the top row leans to the right
    texels = gn.ingest(image).texels()
    assert texels.shape == (4, 6, 2)
    assert texels[3, 0, 0] > 0.1 and abs(texels[0, 0, 0]) < 1e-3
    assert np.array_equal(gn.ingest(image[::-1], bottom_row_first=True).texels(), texels)


def test_codes_and_heights_are_read(random):
    codes = random.integers(120, 136, (16, 16, 3), dtype=np.uint8)
    codes[..., 2] = 255
    assert gn.ingest(codes, dequantize="none").report["dequantized"] is False
    heights = random.random((16, 16)).astype(np.float64)
    asset = gn.ingest(heights, kind="height", to="heights", height_scale=3.0, bottom_row_first=True)
    assert asset.kind == "heights" and np.allclose(asset.texels(), 3 * heights, rtol=1e-6)
    assert gn.ingest(heights, kind="height").kind == "normals"


def test_assets_name_what_they_were_made_of_and_how(noise):
    pyramid = gn.pyramid(noise, sigma_r=0.02)
    provenance = gn.info(gn.compress(pyramid, rank=2))["provenance"]
    assert provenance["generator"].startswith("glint-ndf ")
    assert provenance["command"]["rank"] == 2
    assert [i["name"] for i in provenance["inputs"]] == ["ndf-pyramid", "ndf-pyramid/normals"]
    # So a compressed pyramid knows its map, and refuses another.
    compressed = gn.compress(pyramid, rank=2)
    assert compressed.open(normals=noise).has_normals
    with pytest.raises(gn.InvalidInputError):
        compressed.open(normals=gn.synth("isotropic", 256, seed=77))


def test_compressed_pyramids_keep_normals(noise):
    bare, kept = gn.pyramid(noise), gn.pyramid(noise, keep_normals="i16")
    kept_type = lambda asset: gn.info(asset)["properties"].get("near_normals")
    assert kept_type(gn.compress(kept, rank=2)) == "i16"
    assert kept_type(gn.compress(kept, rank=2, keep_normals="none")) is None
    assert kept_type(gn.compress(bare, rank=2, normals=noise)) == "i16"
    floats = gn.compress(bare, rank=2, normals=noise, keep_normals="f32")
    assert kept_type(floats) == "f32" and floats.open().has_normals
    assert not floats.open(kept_normals="ignored").has_normals
    for source, options, text in (
        (bare, dict(keep_normals="i16"), "normals="),
        (kept, dict(keep_normals="f32"), "normals="),
        (bare, dict(keep_normals="none", normals=noise), "leave one of them out"),
        (bare, dict(keep_normals="i8"), "give one of"),
    ):
        with pytest.raises(gn.ArgumentError, match=text):
            gn.compress(source, rank=2, **options)
    with pytest.raises(gn.InvalidInputError):
        gn.compress(bare, rank=2, normals=gn.synth("isotropic", 256, seed=77))


def test_results_do_not_depend_on_threads(noise):
    assert arrays_of(gn.pyramid(noise, threads=1)) == arrays_of(gn.pyramid(noise, threads=2))


def test_progress_is_told_and_its_exception_comes_back(noise):
    seen = []
    gn.pyramid(noise, progress=lambda done, total: seen.append((done, total)))
    assert seen and seen[-1][0] == seen[-1][1]

    def fail(done, total):
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        gn.pyramid(noise, progress=fail)


def test_temporary_files_live_as_long_as_they_are_needed(noise):
    pyramid = gn.pyramid(noise)
    path = pyramid.path
    ndf = pyramid.open()
    del pyramid
    gc.collect()
    assert os.path.exists(path) and ndf.density([0.5, 0.5], [0, 0], sigma=20.0) > 0
    del ndf
    gc.collect()
    assert not os.path.exists(os.path.dirname(path))


def test_files_appear_whole_or_not_at_all(noise, tmp_path):
    target = tmp_path / "n.glint"
    gn.save(noise, target)
    with pytest.raises(gn.FileError, match="overwrite=True"):
        noise.save(target)
    noise.save(target, overwrite=True)
    assert [p.name for p in tmp_path.iterdir()] == ["n.glint"]
    assert target.stat().st_mode & 0o777 == 0o666 & ~current_umask()
    with pytest.raises(gn.FileError):
        noise.save(tmp_path / "no" / "n.glint")
    assert gn.open(target.read_bytes(), sigma_r=0.02).density([0.3, 0.3], [0, 0], sigma=4.0) == gn.open(
        target, sigma_r=0.02
    ).density([0.3, 0.3], [0, 0], sigma=4.0)


def current_umask():
    mask = os.umask(0)
    os.umask(mask)
    return mask


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda n: gn.open("/nowhere.glint"), gn.FileError, "nowhere"),
        (lambda n: gn.open(__file__), gn.InvalidInputError, "not an HDF5 file"),
        (lambda n: gn.open(b"nothing"), gn.InvalidInputError, "not an HDF5 file"),
        (lambda n: gn.open(gn.synth("weave", 32, heights=True)), gn.UnsupportedError, "heights"),
        (lambda n: gn.open(n, sigma_r=9), gn.ArgumentError, "sigma_r"),
        (lambda n: gn.open(n, surface="round"), gn.ArgumentError, "flat, smooth"),
        (lambda n: gn.open(n, estimator="best"), gn.ArgumentError, "exact, published"),
        (lambda n: n.open().density([0, 0], [0, 0]), gn.ArgumentError, "sigma, covariance and box"),
        (lambda n: n.open().density([0, 0], [0, 0], sigma=1, box=[[1, 0], [0, 1]]), gn.ArgumentError, "sigma, box"),
        (lambda n: n.open().density([0, 0, 0], [0, 0], sigma=1), gn.ArgumentError, "uv"),
        (lambda n: n.open().density(np.zeros((3, 2)), np.zeros((4, 2)), sigma=1), gn.ArgumentError, "broadcast"),
        (lambda n: n.open().brdf("conductor", eta=1.0), gn.ArgumentError, "k: missing"),
        (lambda n: n.open().brdf(facets="beckmann"), gn.UnsupportedError, "bin-map"),
        (lambda n: gn.pyramid(n, sigma_r=5), gn.ArgumentError, "sigma_r: out of range"),
        (lambda n: gn.pyramid("n.glint"), gn.ArgumentError, "glint_ndf.load"),
        (lambda n: gn.pyramid(gn.pyramid(n)), gn.UnsupportedError, "normals"),
        (lambda n: gn.compress(gn.pyramid(n), rank=2, tolerance=0.1), gn.ArgumentError, "both are given"),
        (lambda n: gn.bin_map(n, alpha=2.0), gn.ArgumentError, "alpha"),
        (lambda n: gn.ingest(np.zeros((4, 4, 3), dtype=np.int64)), gn.ArgumentError, "int64"),
        (lambda n: gn.ingest(np.zeros((0, 4, 3), dtype=np.uint8)), gn.ArgumentError, "shape"),
        (lambda n: gn.ingest(np.zeros((8, 8, 3), dtype=np.uint8)), gn.InvalidInputError, ""),
        (lambda n: gn.synth("velvet"), gn.ArgumentError, "isotropic"),
        (lambda n: gn.open_displaced(n), gn.UnsupportedError, "displacement"),
        (lambda n: gn.ingest(np.full((8, 8, 3), np.nan, dtype=np.float32)), gn.InvalidInputError, "fix_invalid"),
        (lambda n: gn.synth("flakes", 64.5), gn.ArgumentError, "width"),
        (lambda n: gn.synth("flakes", 64, seed=-1), gn.ArgumentError, "seed"),
        (lambda n: gn.pyramid(n, levels=2**40), gn.ArgumentError, "levels"),
        (lambda n: gn.pyramid(n, levels=True), gn.ArgumentError, "levels"),
        (lambda n: gn.pyramid(n, threads=-1), gn.ArgumentError, "threads"),
        (lambda n: n.open().brdf("dielectric", eta=[1.5, 1.4]), gn.ArgumentError, "eta"),
        (lambda n: n.open().brdf().lobes([0, 0], [0, 0, 1], [0, 0, 1], 5.0, [1, 1, 1], sigma=3), gn.ArgumentError, "lobes"),
        (
            lambda n: n.open().brdf().lobes([0, 0], [0, 0, 1], [[0, 0, 1]] * 2, [5.0] * 3, [[1, 1, 1]], sigma=3),
            gn.ArgumentError,
            "broadcast",
        ),
        (lambda n: n.open().density("here", [0, 0], sigma=1), gn.ArgumentError, "uv"),
    ],
)
def test_errors_say_what_is_wrong_in_words_of_python(call, error, words, noise):
    with pytest.raises(error) as raised:
        call(noise)
    assert words in str(raised.value)
    assert "--" not in str(raised.value)
    assert isinstance(raised.value, gn.GlintError)


def test_names_of_files_stay_as_they_are(tmp_path):
    with pytest.raises(gn.FileError) as raised:
        gn.open(tmp_path / "my--file.glint")
    assert "my--file.glint" in str(raised.value)
    (tmp_path / "my--file.glint").write_bytes(b"no asset")
    with pytest.raises(gn.InvalidInputError, match="my--file.glint"):
        gn.pyramid(gn.load(tmp_path / "my--file.glint"))


def test_arrays_of_other_layouts_are_taken(noise):
    packed = np.zeros(3, dtype=[("tag", "u1"), ("uv", "f4", 2)])
    packed["uv"] = [[0.1, 0.2], [0.3, 0.4], [0.5, 0.6]]
    plain = np.ascontiguousarray(packed["uv"])
    ndf = noise.open(sigma_r=0.05)
    expected = ndf.density(plain, [0, 0], sigma=3.0)
    for other in (packed["uv"], plain.astype(">f4"), plain[::-1].copy()[::-1]):
        assert np.array_equal(ndf.density(other, [0, 0], sigma=3.0), expected)
    codes = np.random.default_rng(1).integers(31000, 34000, (8, 8, 3)).astype(">u2")
    codes[..., 2] = 65535
    assert np.array_equal(gn.ingest(codes).texels(), gn.ingest(codes.astype(np.uint16)).texels())


def test_flakes_of_materialx_are_made():
    few, all_of_it = (gn.synth("flake2d", 64, flake_size_uv=1 / 16, roughness=0.4, coverage=c).texels() for c in (0.3, 1.0))
    assert 0.1 < np.mean(np.any(few != 0, axis=-1)) < 0.6 < np.mean(np.any(all_of_it != 0, axis=-1))


def test_broken_files_are_findings_of_validate(noise, tmp_path):
    assert gn.validate(noise).valid
    (tmp_path / "x.glint").write_bytes(b"no asset")
    report = gn.validate(tmp_path / "x.glint")
    assert not report.valid and report.findings[0].rule == "file.signature"


def test_public_names_have_docstrings():
    for name in gn.__all__:
        public = getattr(gn, name)
        assert inspect.getdoc(public), name
        if inspect.isclass(public):
            for member, value in vars(public).items():
                if not member.startswith("_") and (callable(value) or isinstance(value, property)):
                    assert inspect.getdoc(value), f"{name}.{member}"


def test_the_package_stays_apart_from_another_hdf5():
    """The module shows no symbol of its HDF5, so that h5py and others keep theirs."""
    from glint_ndf import _glint

    symbols = subprocess.run(
        ["nm", "--dynamic", "--defined-only", _glint.__file__], capture_output=True, text=True, check=True
    ).stdout
    assert "PyInit__glint" in symbols
    assert " H5" not in symbols


def test_the_wheel_needs_nothing_but_what_it_holds():
    from glint_ndf import _glint

    needed = subprocess.run(["ldd", _glint.__file__], capture_output=True, text=True, check=True).stdout
    of_the_system = re.compile(r"linux-vdso|ld-linux|lib(c|m|dl|pthread|stdc\+\+|gcc_s|rt)\.so")
    for line in needed.splitlines():
        assert of_the_system.search(line) or "glint_ndf.libs/" in line, line


def test_the_example_of_the_package_runs():
    example = inspect.getdoc(gn).split("::\n\n")[1].split("\n\nIn Mitsuba")[0]
    code = inspect.cleandoc(example).replace("1024", "128") + "\nprint(float(density))"
    printed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert float(printed) >= 0
    json.dumps(gn.info(gn.synth("flat", 16)))
