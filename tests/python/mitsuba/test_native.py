"""The C++ BSDF `glint_native` answers as the Python BSDF `glint`.

Needs the environment variable GLINT_MITSUBA_PLUGINS: the folder that python/mitsuba_native/build.py wrote to.
"""

import os

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from conftest import VARIANTS, glint, make_scene, render

FOLDER = os.environ.get("GLINT_MITSUBA_PLUGINS", "")

pytestmark = pytest.mark.skipif(not FOLDER, reason="GLINT_MITSUBA_PLUGINS names no folder of a compiled plugin")

#: Scalar variants place points in double precision in Python and in float here: lobes of sigma_r 0.02 turn 1e-7 into 1e-5.
TOLERANCE = {"scalar_rgb": 3e-5, "llvm_ad_rgb": 1e-6, "llvm_ad_spectral": 1e-6}


@pytest.fixture(params=VARIANTS)
def variant(request):
    mi.set_variant(request.param)
    mi.file_resolver().append(FOLDER)
    return request.param


def interactions(lanes, seed):
    """Points all over a map with random footprints and views, and directions near the mirrored ones."""
    random = np.random.default_rng(seed).random((12, lanes), dtype=np.float32)
    number = (lambda x: mi.Float(x)) if lanes > 1 else (lambda x: float(x[0]))
    r = [number(row) for row in random]
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi = dr.normalize(mi.Vector3f(r[0] - 0.5, r[1] - 0.5, 1))
    lit = dr.normalize(mi.Vector3f(0.3 * (r[2] - 0.5) - r[0] + 0.5, 0.3 * (r[3] - 0.5) - r[1] + 0.5, 1))
    si.uv = mi.Point2f(5 * r[4], 5 * r[5])
    si.duv_dx, si.duv_dy = mi.Vector2f(0.05 * r[6], 0.02 * r[7]), mi.Vector2f(0.02 * r[8], 0.05 * r[9])
    if mi.is_spectral:
        si.wavelengths = [450, 500, 550, 600]
    return si, lit, mi.Point2f(r[10], r[11])


def test_answers_are_those_of_the_python_form(variant, noise_pyramid):
    parameters = {"material": "Au", "uv_scale": 3.0, "rotation": 25.0}
    ours = mi.load_dict(glint(noise_pyramid, **parameters))
    native = mi.load_dict({**glint(noise_pyramid, **parameters), "type": "glint_native"})
    context = mi.BSDFContext()
    lanes, repeats = (1, 40) if variant.startswith("scalar") else (2000, 1)
    lit_lanes = 0
    for seed in range(repeats):
        si, lit, xi = interactions(lanes, seed)
        pairs = list(zip(ours.eval_pdf(context, si, lit), native.eval_pdf(context, si, lit)))
        (a, weight_a), (b, weight_b) = ours.sample(context, si, 0.5, xi), native.sample(context, si, 0.5, xi)
        pairs += [(a.wo, b.wo), (a.pdf, b.pdf), (weight_a, weight_b)]
        for first, second in pairs:
            first, second = np.array(first), np.array(second)
            assert second == pytest.approx(first, rel=TOLERANCE[variant], abs=TOLERANCE[variant] * max(1, float(np.abs(first).max())))
        lit_lanes += int((np.array(pairs[0][0]) > 0).any(axis=0).sum())
    assert lit_lanes > 0.2 * lanes * repeats


def test_pictures_agree(variant, noise_pyramid):
    material = {"material": "Cu", "uv_scale": 2.0}
    spp = 4 if variant.startswith("scalar") else 16
    python, native = (
        render(make_scene({**glint(noise_pyramid, **material), "type": name}, "point", "glint_path", size=12), spp)
        for name in ("glint", "glint_native")
    )
    assert python.max() > 0
    assert native == pytest.approx(python, rel=1e-3, abs=1e-3 * float(python.max()))


def test_errors_name_the_plugin(variant, noise_pyramid):
    for broken in ({"asset": "no/such.glint"}, {"interpolation": "cubic"}, {"uv_scale": 0.0}, {"unknown": 1.0}):
        with pytest.raises(Exception, match="glint_native"):
            mi.load_dict({**glint(noise_pyramid), "type": "glint_native", **broken})


def test_symbolic_loops_are_refused(noise_pyramid):
    mi.set_variant("llvm_ad_rgb")
    mi.file_resolver().append(FOLDER)
    scene = make_scene({**glint(noise_pyramid, sigma=4.0), "type": "glint_native"}, "area", "path")
    with pytest.raises(Exception):
        mi.render(scene, spp=1)
    assert render(scene, 4).mean() > 0
