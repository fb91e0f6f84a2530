"""glint-pyramid --optics wave: its asset by the text of the specification, its colours, and what it refuses."""

import json

import h5py
import numpy as np
import OpenImageIO as oiio
import pytest
from conftest import run_all, run_once

SIZE, STRIDE, RESOLUTION, PERIOD, DEPTH_UM = 96, 32, 128, 16, 0.25
PRINTED = 1e-6  # shell answers have nine digits
HALVES = 2e-3  # both sides are rounded to half precision


@pytest.fixture
def grating(glint):
    run_once(
        glint,
        f"synth grating --height --texel-size-um 1 --depth-um {DEPTH_UM} --feature-size {PERIOD} --size {SIZE} -o g.exr",
        "ingest g.exr -o g.glint --kind height --to heights --height-scale-um 1 --texel-size-um 1",
    )
    return glint.folder / "g.glint"


def pyramid(glint, name, options=""):
    process = glint(
        "pyramid",
        "g.glint",
        "-o",
        name,
        "--optics",
        "wave",
        "--coherence-um",
        "10",
        *options.split(),
        *([] if "--stride" in options else ["--stride", STRIDE]),
        *([] if "--resolution" in options else ["--resolution", RESOLUTION]),
        "--json",
    )
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)


def images(path, level=0):
    """Densities [image][channel][y][x] of a level, by section 15 of the specification."""
    with h5py.File(path) as file:
        resolution, channels, scale = (file.attrs[name] for name in ("resolution", "channels", "value_scale"))
        group = file[f"level_{level:02}"]
        masks = group["masks"][()].reshape(-1, group["masks"].shape[2])
        pixels = group["channel_pixels"][()].astype(np.float64) * scale
        grey = group["pixels"][()].astype(np.float64) * scale
    blocks = resolution // 16
    out, greys, stored = (
        np.zeros((len(masks), channels, resolution, resolution)),
        np.zeros((len(masks), resolution, resolution)),
        0,
    )
    for image, words in enumerate(masks):
        for block in range(blocks * blocks):
            if not int(words[block // 64]) >> (block % 64) & 1:
                continue
            y, x = block // blocks * 16, block % blocks * 16
            out[image, :, y : y + 16, x : x + 16] = pixels[stored].transpose(1, 0, 2)
            greys[image, y : y + 16, x : x + 16] = grey[stored]
            stored += 1
    assert stored == len(pixels)
    return out, greys


def colours(path):
    with h5py.File(path) as file:
        return file["channel_rgb"][()].astype(np.float64), file["wavelengths_um"][()]


def test_asset_by_the_specification(glint, grating):
    pyramid(glint, "w.glint")
    densities, grey = images(glint.folder / "w.glint")
    rgb, wavelengths = colours(glint.folder / "w.glint")
    assert densities.shape[1] == 3 and len(wavelengths) == 8
    assert np.allclose(rgb.sum(axis=0), 1, atol=1e-3)
    assert np.allclose(grey, densities.mean(axis=1), rtol=HALVES, atol=1e-6)
    # Every channel of every image keeps its light.
    assert np.allclose(densities.sum(axis=(2, 3)) * 4 / RESOLUTION**2, 1, atol=1e-3)
    assert glint("validate", "w.glint").returncode == 0


def test_query_prints_the_colour_of_a_pixel(glint, grating):
    pyramid(glint, "w.glint", "--overlap 1")
    densities, grey = images(glint.folder / "w.glint")
    rgb, _ = colours(glint.folder / "w.glint")
    columns = SIZE // STRIDE
    sigma = STRIDE * 1.5 / np.sqrt(12)
    for image, (y, x) in [(0, (64, 64)), (4, (64, 65)), (7, (63, 62))]:
        u, v = (image % columns + 0.5) / columns, (image // columns + 0.5) / columns
        psi = [2 * (pixel + 0.5) / RESOLUTION - 1 for pixel in (x, y)]
        process = glint(
            "query",
            "w.glint",
            "--uv",
            u,
            v,
            "--sigma",
            sigma,
            "--half",
            *psi,
            "--pixels",
            "constant",
            "--interpolation",
            "trilinear",
            "--json",
        )
        assert process.returncode == 0, process.stderr
        result = json.loads(process.stdout)["result"]
        assert np.allclose(result["channels"], densities[image, :, y, x], rtol=HALVES, atol=1e-4)
        assert np.allclose(
            result["rgb"], densities[image, :, y, x] @ rgb, rtol=HALVES, atol=HALVES * densities[image, :, y, x].max()
        )
        assert np.isclose(result["density"], grey[image, y, x], rtol=HALVES, atol=1e-4)
    process = glint("query", "w.glint", "--uv", ".5", ".5", "--sigma", 20, "--half", 0, 0)
    assert len(process.stdout.split()) == 3


def test_spectral_channels_are_the_wavelengths_and_have_the_orders_of_the_grating(glint, grating):
    resolution = 512  # so that the spot of an order is as wide as a pixel
    pyramid(glint, "s.glint", f"--spectral --wavelengths 0.45,0.65 --overlap 1 --resolution {resolution}")
    densities, _ = images(glint.folder / "s.glint")
    _, wavelengths = colours(glint.folder / "s.glint")
    assert np.allclose(wavelengths, [0.45, 0.65])
    centres = (np.arange(resolution) + 0.5) * 2 / resolution - 1
    amplitude = DEPTH_UM / 2 / np.sin(7 * np.pi / 16)  # the highest texel is a sixteenth of a quarter from the top of the sine
    for channel, wavelength in enumerate(wavelengths):
        profile = densities[:, channel].mean(axis=0).sum(axis=0)
        # Power J_n(4 pi a / lambda)^2 at psi = n lambda / (2 period): the mean of psi^2 is that of the slopes, and that of the spot.
        variance = (profile * centres**2).sum() / profile.sum()
        slopes = (2 * np.pi * amplitude / PERIOD) ** 2 / 2
        spot = (wavelength / (4 * np.pi * np.sqrt(2) * 10)) ** 2
        pixel = (2 / resolution) ** 2 / 12
        assert np.isclose(variance, slopes + spot + pixel, rtol=0.005)


def test_image_is_in_colour(glint, grating):
    pyramid(glint, "w.glint")
    for name in ("ndf.exr", "ndf.png"):
        run_all(glint, f"query w.glint --uv .5 .5 --sigma 20 --image {name}")
        pixels = oiio.ImageBuf(str(glint.folder / name)).get_pixels(oiio.FLOAT)
        assert pixels.shape == (RESOLUTION, RESOLUTION, 3)
        # Orders of other wavelengths lie beside each other.
        assert np.abs(pixels[..., 0] - pixels[..., 2]).max() > 0.1 * pixels.max()


def test_footprints_below_the_finest_level_are_refused(glint, grating):
    pyramid(glint, "w.glint")
    process = glint("query", "w.glint", "--uv", ".5", ".5", "--sigma", 3, "--half", 0, 0)
    assert process.returncode == 1 and "smaller --stride" in process.stderr


@pytest.mark.parametrize(
    "options, code, words",
    [
        ("--coherence-um 0", 1, "coherence-um"),
        (f"--coherence-um {SIZE + 1}", 1, f"give the longest wavelength, 0.800625, to the size of the map, {SIZE}"),
        ("--wavelengths 0", 1, "0 wavelengths"),
        ("--wavelengths 0.0,0.5", 1, "0 um is no wavelength of light"),
        ("--wavelengths 0.5,10.0", 1, "10 um is no wavelength of light"),
        ("--wavelengths 65", 1, "65 wavelengths"),
        ("--wavelengths blue", 1, "'blue' is not a wavelength"),
        ("--wavelengths 1.1,1.3", 1, "add --spectral"),
        ("--sigma-r 0.01", 1, "--sigma-r"),
        ("--boundary clamp", 1, "--boundary"),
    ],
)
def test_options_that_have_no_answer_are_refused(glint, grating, options, code, words):
    process = glint("pyramid", "g.glint", "-o", "w.glint", "--optics", "wave", *options.split())
    assert process.returncode == code and words in process.stderr, process.stderr
    assert process.stderr.count("\n") == 1
    assert not (glint.folder / "w.glint").exists()


def test_inputs_that_have_no_answer_are_refused(glint, grating):
    run_all(
        glint,
        "synth flakes --size 64 -o n.exr",
        "ingest n.exr -o n.glint",
        "ingest g.exr -o unknown.glint --kind height --to heights",
    )
    process = glint("pyramid", "n.glint", "-o", "w.glint", "--optics", "wave")
    assert process.returncode == 5 and "kind normals" in process.stderr and "--to heights" in process.stderr
    process = glint("pyramid", "unknown.glint", "-o", "w.glint", "--optics", "wave")
    assert process.stderr.count("\n") == 1
    assert process.returncode == 3 and "unknown.glint" in process.stderr and "--texel-size-um" in process.stderr
    process = glint("pyramid", "n.glint", "-o", "w.glint", "--spectral")
    assert process.returncode == 1 and "add --optics wave" in process.stderr
    # Texels of a millimetre, and a coherence area of 10 um.
    run_all(glint, "ingest g.exr -o wide.glint --kind height --to heights --texel-size-um 100000")
    process = glint("pyramid", "wide.glint", "-o", "w.glint", "--optics", "wave")
    assert (
        process.returncode == 1 and "coherent images" in process.stderr and "--coherence-um" in process.stderr
    ), process.stderr
    # A coherence area of centimetres asks for more samples than fit.
    process = glint("pyramid", "wide.glint", "-o", "w.glint", "--optics", "wave", "--coherence-um", "10000")
    assert process.returncode == 1 and "samples of the surface" in process.stderr, process.stderr
    pyramid(glint, "w.glint")
    process = glint("compress", "w.glint", "-o", "c.glint", "--normals", "n.glint")
    assert process.returncode == 1 and "keeps no normals" in process.stderr, process.stderr


def test_warns_of_what_the_answer_cannot_have(glint, grating):
    warnings = " ".join(pyramid(glint, "w.glint", "--wavelengths 0.55 --stride 8")["warnings"])
    assert "wider than the wavelength" in warnings and "speckle" in warnings and "below the coherence area" in warnings
    warnings = " ".join(pyramid(glint, "v.glint")["warnings"])
    assert "speckle" not in warnings and "coherence" not in warnings


def lab(xyz, white):
    """CIE L*a*b* of X, Y, Z that are divided by those of the illuminant."""
    t = xyz / white
    f = np.where(t > 0.008856, np.cbrt(t), 7.787 * t + 16 / 116)
    return np.stack([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def test_colours_of_a_grating_converge_with_wavelengths(glint, grating):
    """Mean deltaE against 64 wavelengths, over psi across the grooves that are brighter than a hundredth of the brightest."""
    profiles = {}
    for count in (8, 16, 32, 64):
        pyramid(glint, f"{count}.glint", f"--wavelengths {count} --overlap 1 --levels 1 --resolution 256")
        densities, _ = images(glint.folder / f"{count}.glint")
        profiles[count] = densities.mean(axis=0).sum(axis=1)
    truth = profiles[64]
    white = truth[1].max()
    seen = truth[1] > 0.01 * white
    errors = {
        count: np.linalg.norm(lab(profiles[count], white) - lab(truth, white), axis=0)[seen].mean() for count in (8, 16, 32)
    }
    assert errors[8] < 12 and errors[16] < 5 and errors[32] < 1.5, errors
    assert errors[32] < errors[16] < errors[8]
