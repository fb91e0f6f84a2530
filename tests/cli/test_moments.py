"""glint-moments: its asset by the text of the specification, its answers, and its textures against maketx and numpy."""

import json
import subprocess

import h5py
import numpy as np
import OpenImageIO as oiio
import pytest
from conftest import run_all, run_once

PRINTED = 1e-6  # shell answers have nine digits
SIZE = 96


@pytest.fixture
def normals(glint):
    run_once(glint, f"synth isotropic --size {SIZE} --alpha .3 -o map.exr", "ingest map.exr -o n.glint")
    return glint.folder / "n.glint"


@pytest.fixture
def heights(glint):
    """Heights that do not tile, of an odd shape."""
    rng = np.random.default_rng(3)
    x, y = np.meshgrid(np.arange(80), np.arange(56))
    image = (2 * np.sin(x / 5) + np.cos(0.3 * y + 0.1 * x) + 0.2 * rng.standard_normal(x.shape)).astype(np.float32)
    write(glint.folder / "h.exr", image)
    run_all(glint, "ingest h.exr --kind height --to heights --boundary clamp -o h.glint")
    return image


def write(path, image):
    output = oiio.ImageOutput.create(str(path))
    assert output.open(
        str(path), oiio.ImageSpec(image.shape[1], image.shape[0], 1 if image.ndim == 2 else image.shape[2], "float")
    )
    output.write_image(np.ascontiguousarray(image.reshape(*image.shape[:2], -1), np.float32))
    output.close()


def read(path, level=0):
    """All channels of a level, top row first."""
    file = oiio.ImageInput.open(str(path))
    assert file is not None, f"{path}: {oiio.geterror()}"
    pixels = file.read_image(0, level, 0, file.spec().nchannels, "float") if file.seek_subimage(0, level) else None
    names = file.spec().channelnames
    file.close()
    return pixels, names


def number(process):
    assert process.returncode == 0, process.stderr
    return float(process.stdout.split()[0])


def slopes_of(path):
    with h5py.File(path) as file:
        n = np.array(file["normals"], np.float64)
    return -n / np.sqrt(1 - (n**2).sum(2, keepdims=True))


def test_the_asset_is_what_the_specification_says(glint, normals):
    run_all(glint, "moments n.glint -o m.glint --finest 0")
    assert glint("validate", "m.glint").returncode == 0
    slopes = slopes_of(normals)
    with h5py.File(glint.folder / "m.glint") as file:
        assert list(file.attrs["level_columns"]) == [96, 48, 24, 12, 6, 3, 1]
        # Whole texels, up to the level where three become one.
        for level in range(6):
            n = 2**level
            blocks = slopes.reshape(SIZE // n, n, SIZE // n, n, 2).swapaxes(1, 2).reshape(SIZE // n, SIZE // n, n * n, 2)
            mean = blocks.mean(2)
            away = blocks - mean[:, :, None]
            covariance = [(away[..., a] * away[..., b]).mean(2) for a, b in ((0, 0), (0, 1), (1, 1))]
            stored = np.array(file[f"level_{level:02}/moments"])
            assert stored == pytest.approx(np.dstack([mean, *covariance]), abs=1e-6)
        top = np.array(file["level_06/moments"])[0, 0]
        assert top[:2] == pytest.approx(slopes.mean((0, 1)), abs=1e-6)
        assert top[2] == pytest.approx(slopes[..., 0].var(), rel=1e-4)


def test_info_tells_what_it_is(glint, normals):
    run_all(glint, "moments n.glint -o m.glint")
    info = json.loads(glint("info", "m.glint", "--json").stdout)["result"]
    assert info["kind"] == "slope-moments" and info["properties"]["finest_level"] == 1
    deviations = info["statistics"]["slope_deviations"]
    assert deviations == sorted(deviations) and deviations[-1] == pytest.approx(0.3 / 2**0.5, rel=0.1)


def test_answers_are_those_of_a_surface_with_normal_slopes(glint, normals):
    """Large footprints of noise: its alpha is known, and brute force agrees."""
    run_all(glint, "moments n.glint -o m.glint")
    far = ["--uv", ".3", ".6", "--sigma", "60", "--half"]
    for half in (["0", "0"], ["0.2", "0.1"]):
        truth = number(glint("query", "n.glint", *far, *half, "--sigma-r", "0.05"))
        assert number(glint("query", "m.glint", *far, *half, "--sigma-r", "0.05")) == pytest.approx(truth, rel=0.1)
    assert number(glint("query", "m.glint", *far[:-1], "--range", "-1", "-1", "1", "1")) == pytest.approx(0.25, rel=1e-4)


def test_smooth_footprints_are_told_that_they_are_too_small(glint, normals):
    run_all(glint, "moments n.glint -o m.glint --finest 3")
    small = ["query", "m.glint", "--uv", ".3", ".6", "--half", "0", "0", "--sigma"]
    assert number(glint(*small, "1")) == number(glint(*small, "4"))
    assert number(glint(*small, "4")) != number(glint(*small, "8"))


def test_heights_give_the_moments_of_their_normals(glint, heights):
    run_all(
        glint,
        "ingest h.exr --kind height --boundary clamp -o n.glint",
        "moments n.glint --boundary clamp -o a.glint",
        "moments h.glint --boundary clamp -o b.glint",
    )
    with h5py.File(glint.folder / "a.glint") as a, h5py.File(glint.folder / "b.glint") as b:
        for level in range(a.attrs["level_count"]):
            assert np.array(a[f"level_{level:02}/moments"]) == pytest.approx(
                np.array(b[f"level_{level:02}/moments"]), rel=1e-4, abs=1e-6
            )


def test_lean_textures_are_those_of_maketx(glint, heights):
    """maketx clamps slopes at the border. It filters levels of odd sizes in another way, so these are not compared."""
    (glint.folder / "t").mkdir()
    run_all(glint, "moments h.glint --boundary clamp --gradient sobel -o m.glint --textures t")
    subprocess.run(
        ["maketx", "--bumpslopes", "--bumpformat", "height", "-d", "float", "h.exr", "-o", "maketx.exr"],
        cwd=glint.folder,
        check=True,
        capture_output=True,
    )
    compared = 0
    for level, side in enumerate(((80, 56), (40, 28), (20, 14), (10, 7))):
        ours, names = read(glint.folder / "t/lean.exr", level)
        theirs, their_names = read(glint.folder / "maketx.exr", level)
        assert names == their_names and ours.shape == (side[1], side[0], 6)
        assert np.abs(ours - theirs).max() < 1e-5
        compared += 1
    assert compared == 4
    # Every level is there, down to one texel.
    assert [read(glint.folder / "t/lean.exr", level)[0].shape[:2] for level in range(4, 7)] == [(3, 5), (1, 2), (1, 1)]


def lobes_of(moments, extra):
    """Larger and smaller alpha, and the angle of the larger."""
    matrix = np.stack([moments[..., 2] + extra, moments[..., 3], moments[..., 3], moments[..., 4] + extra], -1).reshape(
        *moments.shape[:2], 2, 2
    )
    values, vectors = np.linalg.eigh(matrix.astype(np.float64))
    alphas = np.minimum(1, np.sqrt(2 * np.maximum(values, 0)))
    return alphas[..., 1], alphas[..., 0], np.arctan2(vectors[..., 1, 1], vectors[..., 0, 1])


@pytest.mark.parametrize("lobe", ["isotropic", "gltf", "materialx"])
def test_textures_hold_the_lobes_of_every_level(glint, lobe):
    run_all(glint, "synth brushed --size 64 -o map.exr", "ingest map.exr -o n.glint")
    (glint.folder / "t").mkdir()
    run_all(glint, f"moments n.glint -o m.glint --finest 0 --textures t --lobe {lobe} --bits 16 --roughness 0.4")
    extra = 0.4**4 / 2
    step = 1.5 / 65535
    with h5py.File(glint.folder / "m.glint") as file:
        for level in range(7):
            stored = np.array(file[f"level_{level:02}/moments"])[::-1]
            stored[..., 2] -= extra
            stored[..., 4] -= extra
            large, small, angle = lobes_of(stored, extra)
            texture = lambda name: read(glint.folder / f"t/{name}_{level:02}.png")[0]
            normal = 2 * texture("normal") - 1
            assert -normal[..., :2] / normal[..., 2:] == pytest.approx(stored[..., :2], abs=3e-4)
            roughness = texture("roughness")[..., 0]
            if lobe == "isotropic":
                assert roughness == pytest.approx(np.minimum(1, stored[..., 2] + stored[..., 4] + 2 * extra) ** 0.25, abs=step)
                continue
            anisotropy = texture("anisotropy")
            clear = large - small > 0.02  # elsewhere the direction is that of rounding
            if lobe == "gltf":
                assert roughness == pytest.approx(small**0.5, abs=step)
                # The alphas that a renderer gets back, by the text of KHR_materials_anisotropy.
                assert roughness**2 + (1 - roughness**2) * anisotropy[..., 2] ** 2 == pytest.approx(large, abs=1e-3)
                direction = 2 * anisotropy[..., :2] - 1
                along = direction[..., 0] * np.cos(angle) + direction[..., 1] * np.sin(angle)
            else:
                # By the text of roughness_anisotropy.
                aspect = np.sqrt(1 - anisotropy[..., 0])
                assert np.minimum(1, roughness**2 / aspect) == pytest.approx(large, abs=1e-3)
                assert roughness**2 * aspect == pytest.approx(small, abs=1e-3)
                turn = 2 * np.pi * texture("rotation")[..., 0]
                along = np.cos(turn - angle)
            assert np.abs(along)[clear] == pytest.approx(1, abs=1e-3)
            assert clear.any() or level < 2


def test_roughness_may_vary_over_the_map(glint, normals):
    image = np.linspace(0.2, 0.6, SIZE * SIZE).reshape(SIZE, SIZE)
    write(glint.folder / "r.exr", image)
    run_all(glint, "moments n.glint -o a.glint --finest 0", "moments n.glint -o b.glint --finest 0 --roughness r.exr")
    with h5py.File(glint.folder / "a.glint") as a, h5py.File(glint.folder / "b.glint") as b:
        added = np.array(b["level_00/moments"]) - np.array(a["level_00/moments"])
        assert added[::-1, :, 2] == pytest.approx(image**4 / 2, abs=1e-6)
        top = np.array(b["level_06/moments"]) - np.array(a["level_06/moments"])
        assert top[0, 0, 4] == pytest.approx((image**4 / 2).mean(), abs=1e-5)


def test_other_tools_take_the_textures(glint, normals):
    (glint.folder / "t").mkdir()
    run_all(glint, "moments n.glint -o m.glint --textures t")
    files = sorted(path.name for path in (glint.folder / "t").glob("roughness_*.png"))
    assert len(files) == 7
    first, *others = (f"t/{name}" for name in files)
    mips = [word for name in others for word in ("--mipimage", name)]
    subprocess.run(["maketx", first, *mips, "-o", "roughness.tx"], cwd=glint.folder, check=True, capture_output=True)
    for level, name in enumerate(files):
        assert read(glint.folder / "roughness.tx", level)[0] == pytest.approx(read(glint.folder / f"t/{name}")[0], abs=1 / 255)


def test_errors_of_lobes_tell_where_one_lobe_is_not_enough(glint, normals):
    run_all(glint, "synth weave --size 96 -o w.exr", "ingest w.exr -o w.glint")
    (glint.folder / "t").mkdir()
    errors = {}
    for name in "nw":
        result = json.loads(
            glint(
                "moments", f"{name}.glint", "-o", "m.glint", "--force", "--textures", "t", "--roughness", ".3", "--json"
            ).stdout
        )["result"]
        errors[name] = [level["variation"] for level in result["lobe_errors"]]
    assert errors["n"][0] < 0.05 and errors["w"][0] < 0.12  # a texel is a facet; steep ones have lobes of another shape
    assert errors["n"][-1] < 0.5 * errors["w"][-1]  # noise has normal slopes, threads have several lobes


def test_the_same_bytes_on_any_number_of_threads(glint, normals):
    for threads in (1, 4):
        folder = glint.folder / f"t{threads}"
        folder.mkdir()
        run_all(glint, f"moments n.glint -o m{threads}.glint --textures t{threads} --lobe gltf --threads {threads}")
    names = sorted(path.name for path in (glint.folder / "t1").iterdir())
    assert len(names) == 1 + 3 * 7
    for name in names:
        assert (glint.folder / "t1" / name).read_bytes() == (glint.folder / "t4" / name).read_bytes(), name
    with h5py.File(glint.folder / "m1.glint") as a, h5py.File(glint.folder / "m4.glint") as b:
        assert np.array_equal(a["level_00/moments"], b["level_00/moments"])


def refused(glint, code, *words):
    process = glint("moments", *words)
    assert process.returncode == code and process.stdout == "", process.stderr
    return process.stderr


def test_bad_input_is_named(glint, normals):
    write(glint.folder / "small.exr", np.full((8, 8), 0.5))
    write(glint.folder / "loud.exr", np.full((SIZE, SIZE), 1.5))
    (glint.folder / "t").mkdir()
    out = ["n.glint", "-o", "m.glint"]
    assert "levels 0 to 6" in refused(glint, 1, *out, "--finest", "7")
    assert "0 to 1" in refused(glint, 1, *out, "--roughness", "1.5")
    assert "nothing.png" in refused(glint, 2, *out, "--roughness", "nothing.png")
    assert "8 x 8" in refused(glint, 3, *out, "--roughness", "small.exr")
    assert "1.5" in refused(glint, 3, *out, "--roughness", "loud.exr")
    assert "mkdir" in refused(glint, 2, *out, "--textures", "missing")
    assert "--textures" in refused(glint, 1, *out, "--lobe", "gltf")
    assert "8 or 16" in refused(glint, 1, *out, "--textures", "t", "--bits", "12")
    (glint.folder / "t/roughness_03.png").write_text("mine")
    assert "roughness_03.png" in refused(glint, 1, *out, "--textures", "t")
    assert (glint.folder / "t/roughness_03.png").read_text() == "mine"
    run_all(glint, "pyramid n.glint -o p.glint --stride 32")
    assert "ndf-pyramid" in refused(glint, 5, "p.glint", "-o", "m.glint")
    assert not (glint.folder / "m.glint").exists() and len(list((glint.folder / "t").iterdir())) == 1


def test_textures_do_not_replace_the_roughness_that_they_are_made_of(glint, normals):
    (glint.folder / "t").mkdir()
    write(glint.folder / "r.exr", np.full((SIZE, SIZE), 0.5))
    subprocess.run(["oiiotool", "r.exr", "-d", "uint8", "-o", "t/roughness_00.png"], cwd=glint.folder, check=True)
    before = (glint.folder / "t/roughness_00.png").read_bytes()
    assert "input" in refused(glint, 1, "n.glint", "-o", "m.glint", "--roughness", "t/roughness_00.png", "--textures", "t")
    assert (glint.folder / "t/roughness_00.png").read_bytes() == before
    assert "two outputs" in refused(glint, 1, "n.glint", "-o", "t/lean.exr", "--textures", "t")
    assert not (glint.folder / "t/lean.exr").exists()
