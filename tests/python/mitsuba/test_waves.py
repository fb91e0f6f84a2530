"""Wave optics: diffraction in colour, and by wavelength in spectral variants."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scenes import make_scene, render

import glint_ndf as gn

#: Of the grating, micrometres: 8 texels of 1 um.
PERIOD_UM = 8.0


@pytest.fixture(scope="module")
def grating():
    return gn.synth("grating", 64, heights=True, texel_size_um=1.0, slope=0.1, feature=PERIOD_UM)


@pytest.fixture(scope="module")
def coloured(grating):
    return gn.wave_pyramid(grating, stride=16, resolution=256, coherence_um=8.0)


@pytest.fixture(scope="module")
def by_wavelength(grating):
    return gn.wave_pyramid(grating, stride=16, resolution=512, coherence_um=8.0, spectral=True)


def wave(asset):
    return {"type": "glint", "asset": asset.path, "material": "none", "sigma": 8.0}


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize("name", ["coloured", "by_wavelength"])
def test_white_light_stays_white_on_the_whole(variant, name, request):
    """Under even light all orders of diffraction together are nearly colourless. Red, green and blue below 0, of colours that a
    screen cannot show, count as 0, which adds up to a tenth.
    """
    asset = request.getfixturevalue(name)
    mi.set_variant(variant)
    image = render(make_scene(wave(asset), "constant", "direct"), 4 if variant == "scalar_rgb" else 128)
    colour = image.mean(axis=(0, 1))
    assert (colour < 1.15).all()
    assert colour == pytest.approx([colour.mean()] * 3, rel=0.15)
    assert colour.mean() > 0.5


def test_orders_of_diffraction_are_where_the_grating_equation_says(by_wavelength):
    """With light from straight above the first order leaves at sin(angle) = wavelength / period: blue before red."""
    mi.set_variant("llvm_ad_spectral")
    bsdf = mi.load_dict(wave(by_wavelength))
    sines = np.linspace(0.03, 0.095, 201)
    for nm in (450.0, 550.0, 650.0):
        si = dr.zeros(mi.SurfaceInteraction3f, len(sines))
        si.wi, si.uv, si.wavelengths = [0, 0, 1], [0.5, 0.5], [nm] * 4
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(sines, 0, np.sqrt(1 - sines**2))))[0]
        # The peak of two channels, 57 nm apart, in pixels of 1/256 of the disk: 31 nm.
        assert sines[value.argmax()] * PERIOD_UM * 1000 == pytest.approx(nm, abs=57 / 2 + 31)


def test_samples_agree_with_values(by_wavelength):
    mi.set_variant("llvm_ad_spectral")
    bsdf = mi.load_dict(wave(by_wavelength))
    lanes = 1000
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.wi, si.uv, si.wavelengths = dr.normalize(mi.Vector3f(0.2, 0.1, 1)), [0.5, 0.5], [450, 500, 550, 600]
    xi = np.random.default_rng(1).random((3, lanes), dtype=np.float32)
    drawn, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(xi[0]), mi.Point2f(xi[1], xi[2]))
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, drawn.wo)
    valid = np.array(drawn.pdf) > 0
    assert valid.mean() > 0.8
    assert np.array(pdf)[valid] == pytest.approx(np.array(drawn.pdf)[valid], rel=1e-3)
    assert np.array(value / pdf)[:, valid] == pytest.approx(np.array(weight)[:, valid], rel=5e-3, abs=1e-3)
