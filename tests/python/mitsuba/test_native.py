"""The BSDF in C++ answers as the BSDF in Python."""

import pathlib
import shutil

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import glint_ndf as gn
import glint_ndf.mitsuba as gm
from glint_ndf.mitsuba import native

from scenes import make_scene, render

# Rounding of directions: a lobe of sigma_r 0.02 magnifies it.
ROUNDING = 2e-4


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("native")


@pytest.fixture
def loaded(folder):
    if shutil.which("g++") is None:
        pytest.fail("g++ is missing")
    native.load(folder)


def interactions(lanes, random):
    """Shading points with differentials, and a second direction near the mirror direction of each."""
    jit = dr.is_jit_v(mi.Float)

    def numbers(low, high):
        return mi.Float(random.uniform(low, high, lanes).astype(np.float32)) if jit else float(random.uniform(low, high))

    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.t = mi.Float(1)
    si.uv = mi.Point2f(numbers(-2, 2), numbers(-2, 2))
    si.duv_dx, si.duv_dy = mi.Vector2f(numbers(0, 0.1), numbers(-0.05, 0.05)), mi.Vector2f(numbers(0, 0.05), numbers(0.02, 0.1))
    si.n = mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(si.n)
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0.3, 0), mi.Vector3f(0, -1, 0)  # slanted and mirrored
    si.wi = dr.normalize(mi.Vector3f(numbers(-0.5, 0.5), numbers(-0.5, 0.5), numbers(0.3, 1)))
    lit = dr.normalize(mi.Vector3f(-si.wi.x + numbers(-0.2, 0.2), -si.wi.y + numbers(-0.2, 0.2), si.wi.z))
    return si, lit, mi.Point2f(numbers(0, 1), numbers(0, 1))


@pytest.mark.parametrize(
    "variant, lanes, rounds", [("llvm_ad_rgb", 5000, 1), ("llvm_ad_spectral", 5000, 1), ("scalar_rgb", 1, 200)]
)
@pytest.mark.parametrize("optics", [{}, {"material": "Au"}], ids=["mirror", "gold"])
def test_both_forms_answer_the_same(variant, lanes, rounds, optics, noise_pyramid, folder):
    mi.set_variant(variant)
    native.load(folder)
    random = np.random.default_rng(3)
    parameters = {"asset": noise_pyramid.path, "uv_scale": 3.0, "rotation": 25.0, **optics}
    both = [mi.load_dict({"type": name, **parameters}) for name in ("glint", "glint_native")]
    ctx = mi.BSDFContext()
    lit_lanes = 0
    for _ in range(rounds):
        si, lit, xi = interactions(lanes, random)
        if variant == "llvm_ad_spectral":
            si.wavelengths = mi.UnpolarizedSpectrum(450, 520, 590, 650)
        with gm.wavefront():
            answers = []
            for bsdf in both:
                f, pdf = bsdf.eval_pdf(ctx, si, lit)
                drawn, weight = bsdf.sample(ctx, si, mi.Float(0.5), xi)
                answers.append([np.array(x, dtype=np.float64) for x in (f, pdf, drawn.wo, drawn.pdf, weight)])
        for python, compiled in zip(*answers):
            assert np.all(np.abs(python - compiled) <= ROUNDING * (np.abs(python) + 1))
        lit_lanes += np.count_nonzero(answers[0][1] > 0.01)
    assert lit_lanes > 0.3 * lanes * rounds


def test_pictures_are_the_same(llvm, noise_pyramid, loaded):
    integrator = {"type": "glint_path", "max_depth": 3}
    images = [
        render(make_scene({"type": name, "asset": noise_pyramid.path, "material": "Al"}, "area", integrator), 16)
        for name in ("glint", "glint_native")
    ]
    assert images[0].max() > 0.1
    assert np.abs(images[0] - images[1]).max() < 1e-3 * images[0].max()


def test_footprints_without_extent_are_the_narrowest_of_the_asset(noise_pyramid, loaded):
    mi.set_variant("scalar_rgb")
    si, lit, _ = interactions(1, np.random.default_rng(1))
    si.duv_dx, si.duv_dy = mi.Vector2f(0), mi.Vector2f(0)
    narrowest = max(noise_pyramid.open().smallest_sigma, 0.5)
    asset = {"type": "glint_native", "asset": noise_pyramid.path}
    values = [mi.load_dict(d).eval(mi.BSDFContext(), si, lit)[0] for d in (asset, {**asset, "sigma": narrowest})]
    assert values[0] == pytest.approx(values[1], rel=1e-5)


@pytest.mark.parametrize(
    "parameters, words",
    [
        ({"asset": "/nowhere.glint"}, "nowhere.glint"),
        ({"interpolation": "cubic"}, "give footprint or trilinear"),
        ({"uv_scale": 1.0, "texels_per_unit": 5.0}, "give one of them"),
        ({"facets": "beckmann"}, "bin-map"),
        ({"uv_scale": -1.0}, "uv_scale"),
        ({"uv_scale": float("nan")}, "uv_scale"),
        ({"texels_per_unit": 0.0}, "texels_per_unit"),
        ({"sigma": -4.0}, "sigma"),
        ({"footprint_scale": -1.0}, "footprint_scale"),
        ({"footprint_parts": 99}, "footprint_parts"),
        ({"coat": 1.5}, "coat"),
        ({}, "asset"),
    ],
)
def test_errors_name_the_plugin_and_what_is_wrong(parameters, words, llvm, noise_pyramid, loaded):
    parameters = {"asset": noise_pyramid.path, **parameters} if parameters else {}
    with pytest.raises(RuntimeError) as raised:
        mi.load_dict({"type": "glint_native", **parameters})
    assert "glint_native" in str(raised.value) and words in str(raised.value)


def test_symbolic_loops_are_an_error_and_no_crash(llvm, noise_pyramid, loaded):
    scene = make_scene({"type": "glint_native", "asset": noise_pyramid.path}, "area", "path")
    with pytest.raises(RuntimeError) as raised:
        mi.render(scene, spp=1)
    error, words = raised.value, ""
    while error is not None:
        words, error = words + str(error), error.__cause__ or error.__context__
    assert "glint_native" in words and "wavefront" in words


def test_failed_plugins_close_their_assets(llvm, noise_pyramid, loaded, tmp_path):
    noise_pyramid.save(tmp_path / "noise.glint")
    for _ in range(3):
        with pytest.raises(RuntimeError):
            mi.load_dict({"type": "glint_native", "asset": str(tmp_path / "noise.glint"), "facets": "beckmann"})
    assert str(tmp_path) not in pathlib.Path("/proc/self/maps").read_text()


def test_assets_are_found_beside_the_scene(llvm, noise_pyramid, loaded, tmp_path):
    noise_pyramid.save(tmp_path / "noise.glint")
    (tmp_path / "scene.xml").write_text(
        '<scene version="3.0.0"><shape type="rectangle"><bsdf type="glint_native">'
        '<string name="asset" value="noise.glint"/></bsdf></shape></scene>'
    )
    assert "noise.glint" in str(mi.load_file(str(tmp_path / "scene.xml")).shapes()[0].bsdf())


def test_a_missing_compiler_is_said(monkeypatch, tmp_path):
    monkeypatch.setenv("CXX", "no-such-compiler")
    with pytest.raises(gn.UnsupportedError, match="CXX"):
        native.load(tmp_path)
