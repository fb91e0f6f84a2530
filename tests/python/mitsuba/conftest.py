"""Assets and scenes of the tests of the Mitsuba plugins."""

import mitsuba as mi
import numpy as np
import pytest

import glint_ndf as gn
import glint_ndf.mitsuba  # noqa: F401  registers the plugins

VARIANTS = ("scalar_rgb", "llvm_ad_rgb", "llvm_ad_spectral")


@pytest.fixture(params=VARIANTS)
def any_variant(request):
    mi.set_variant(request.param)
    return request.param


@pytest.fixture
def llvm():
    mi.set_variant("llvm_ad_rgb")


@pytest.fixture(scope="session")
def noise():
    return gn.synth("isotropic", 128, seed=2, alpha=0.3)


@pytest.fixture(scope="session")
def noise_pyramid(noise):
    return gn.pyramid(noise, stride=8, sigma_r=0.02)


@pytest.fixture(scope="session")
def brushed_pyramid():
    return gn.pyramid(gn.synth("brushed", 128, seed=4), stride=16, sigma_r=0.02)


@pytest.fixture(scope="session")
def flat():
    """A mirror: every normal points straight up."""
    up = np.broadcast_to(np.float32([0.5, 0.5, 1]), (16, 16, 3))
    return gn.ingest(np.ascontiguousarray(up), allow_constant=True)


@pytest.fixture(scope="session")
def displaced():
    heights = gn.synth("isotropic", 64, seed=5, heights=True, alpha=0.3)
    return gn.displace(heights, factors=[16], base="diffuse", albedo=0.8)
