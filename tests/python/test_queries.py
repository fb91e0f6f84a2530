"""Answers of the package, against sums over texels in numpy and against each other."""

import threading
import time

import numpy as np
import pytest

import glint_ndf as gn
from glint_ndf._arrays import Batch, members

ROUNDING = 1e-5  # of floats, relative


def density_of_texels(normals, uv, h, sigma, sigma_r):
    """Density by definition: lobes of all texels, weighted by a Gaussian footprint on the periodic map."""
    height, width, _ = normals.shape
    x = (np.arange(width) + 0.5 - uv[0] * width + width / 2) % width - width / 2
    y = (np.arange(height) + 0.5 - uv[1] * height + height / 2) % height - height / 2
    weights = np.exp(-0.5 * (x[None, :] ** 2 + y[:, None] ** 2) / sigma**2)
    squares = ((normals - np.asarray(h)) ** 2).sum(axis=-1)
    lobes = np.exp(-0.5 * squares / sigma_r**2) / (2 * np.pi * sigma_r**2)
    return (weights * lobes).sum() / weights.sum()


def test_density_is_the_sum_over_texels(flakes, random):
    ndf = flakes.open(sigma_r=0.05)
    normals = flakes.texels().astype(np.float64)
    truncation = 0.01  # footprints of the Reference end at some deviations
    for _ in range(20):
        uv, h = random.random(2), random.uniform(-0.4, 0.4, 2)
        expected = density_of_texels(normals, uv, h, 6.0, 0.05)
        assert ndf.density(uv, h, sigma=6.0) == pytest.approx(expected, rel=truncation, abs=1e-3)


def test_leading_dimensions_broadcast(pyramid, random):
    ndf = pyramid.open()
    uv, h, sigma = random.random((5, 1, 2)), random.uniform(-0.2, 0.2, (7, 2)), np.array(20.0)
    table = ndf.density(uv, h, sigma=sigma)
    assert table.shape == (5, 7) and table.dtype == np.float32
    for i in range(5):
        for j in range(7):
            assert table[i, j] == pytest.approx(float(ndf.density(uv[i, 0], h[j], sigma=20.0)), rel=ROUNDING)
    assert ndf.density([0.5, 0.5], [0, 0], sigma=20).shape == ()
    assert ndf.density(np.zeros((0, 2)), np.zeros((0, 2)), sigma=20).shape == (0,)


def test_arrays_of_floats_are_not_copied(random):
    queries = random.random((40, 30, 5), dtype=np.float32)
    uv, constant = queries[..., 1:3], np.zeros(2, dtype=np.float32)
    batch = Batch(members(uv, 2, "uv"))
    assert np.shares_memory(batch.rows(members(uv, 2, "uv")), queries)
    assert np.shares_memory(batch.rows(members(constant, 2, "uv")), constant)


def test_three_forms_of_a_footprint_agree(noise):
    ndf = noise.open(sigma_r=0.05)
    at, h = [0.4, 0.6], [0.05, 0.02]
    round_one = ndf.density(at, h, sigma=9.0)
    assert ndf.density(at, h, covariance=[81.0, 0, 81.0]) == pytest.approx(float(round_one), rel=ROUNDING)
    # A box of the same second moments sees nearly the same.
    side = 9.0 * np.sqrt(3.0)
    box = ndf.density(at, h, box=[[side, 0], [0, side]])
    assert box == pytest.approx(float(round_one), rel=0.2) and box != round_one


def test_doubles_keep_texels_far_out(noise):
    ndf = noise.open(sigma_r=0.02)
    here, far = np.array([0.37, 0.21]), np.array([0.37 + 2.0**30, 0.21 - 2.0**30])
    assert ndf.density(far, [0.02, 0.03], sigma=2.0) == pytest.approx(
        float(ndf.density(here, [0.02, 0.03], sigma=2.0)), rel=1e-2
    )


def test_any_number_of_threads_answers_the_same(pyramid, random):
    ndf = pyramid.open()
    uv, h = random.random((5000, 2)), random.uniform(-0.2, 0.2, (5000, 2))
    one = ndf.density(uv, h, sigma=15.0, threads=1)
    assert np.array_equal(one, ndf.density(uv, h, sigma=15.0, threads=2))
    assert np.array_equal(one, ndf.density(uv, h, sigma=15.0))


def test_other_threads_of_python_run_meanwhile(noise, random):
    ndf = noise.open()
    turns, done = 0, threading.Event()

    def ask():
        ndf.density(random.random((500, 2)), [0.0, 0.0], sigma=40.0, threads=1)
        done.set()

    thread = threading.Thread(target=ask)
    thread.start()
    while not done.is_set():
        time.sleep(0.001)
        turns += 1
    thread.join()
    assert turns > 5


def test_mean_integrates_the_density(pyramid):
    ndf = pyramid.open()
    assert ndf.mean([0.2, 0.8], [-1, -1, 1, 1], sigma=20.0) * 4 == pytest.approx(1, abs=0.01)
    cells = np.linspace(0.05, 0.15, 41)[:-1] + 0.00125
    h = np.stack(np.meshgrid(cells, cells), axis=-1)
    box = ndf.mean([0.2, 0.8], [0.05, 0.05, 0.15, 0.15], sigma=20.0)
    assert ndf.density([0.2, 0.8], h, sigma=20.0).mean() == pytest.approx(float(box), rel=0.01)


def test_samples_follow_the_density(pyramid, random):
    ndf = pyramid.open()
    count = 40000
    h, pdf = ndf.sample([0.2, 0.8], random.random((count, 2)), sigma=20.0)
    assert h.shape == (count, 2) and pdf.shape == (count,)
    share = np.mean((np.abs(h[:, 0] - 0.05) < 0.05) & (np.abs(h[:, 1]) < 0.05))
    expected = float(ndf.mean([0.2, 0.8], [0, -0.05, 0.1, 0.05], sigma=20.0)) * 0.01
    assert abs(share - expected) < 5 * np.sqrt(expected / count)


def test_weights_are_the_brdf_over_the_pdf(pyramid, random):
    brdf = pyramid.open().brdf("conductor", eta=[0.2, 0.9, 1.1], k=[3.9, 2.4, 2.2])
    uv, wo = random.random((2000, 2)), np.array([0.5, 0.1, np.sqrt(0.74)])
    wi, weight, pdf = brdf.sample(uv, wo, random.random((2000, 2)), sigma=20.0)
    f, again = brdf.evaluate(uv, wi, wo, sigma=20.0)
    drawn = pdf > 1e-3
    assert drawn.mean() > 0.9
    assert np.allclose(again[drawn], pdf[drawn], rtol=1e-3)
    assert np.allclose(f[drawn] * wi[drawn, 2:] / pdf[drawn, None], weight[drawn], rtol=1e-3, atol=1e-4)
    swapped, _ = brdf.evaluate(uv, wo, wi, sigma=20.0)
    assert np.allclose(swapped[drawn], f[drawn], rtol=1e-3, atol=1e-4)


def test_lobes_are_the_light_that_samples_find(pyramid, random):
    brdf = pyramid.open().brdf()
    wo = np.array([0.3, -0.2, np.sqrt(0.87)], dtype=np.float32)
    axis, sharpness = np.array([-0.25, 0.25, np.sqrt(0.875)]), 30.0
    wi, weight, pdf = brdf.sample([0.1, 0.3], wo, random.random((200000, 2)), sigma=20.0)
    light = np.exp(sharpness * (wi @ axis - 1)) * (pdf > 0)
    sampled = (weight[:, 0] * light).mean()
    radiance = brdf.lobes([0.1, 0.3], wo, [axis], [sharpness], [[1.0, 2.0, 0.5]], sigma=20.0, cells=8)
    assert radiance[0] == pytest.approx(sampled, rel=0.03)
    assert radiance[1] == pytest.approx(2 * radiance[0], rel=1e-4)


def test_footprints_of_differentials_and_cones():
    covariance = gn.footprint.from_differentials([0.01, 0.0], [0.0, 0.02], 1000, 500)
    assert covariance == pytest.approx([25.0, 0.0, 25.0])
    stretched = gn.footprint.from_cone(2.0, [0.6, 0.0, 0.8], 10.0)
    assert stretched == pytest.approx([400 / 0.64, 0, 400], rel=1e-5)
    assert gn.footprint.from_differentials([[np.nan, 0]], [0, 0], 10, 10) == pytest.approx(np.zeros((1, 3)))
    assert gn.footprint.bounced_spread(0.0, 10.0) == pytest.approx(0.75)


def test_displaced_surfaces_answer(random):
    displaced = gn.open_displaced(gn.displace(gn.synth("weave", 128, heights=True), factors=[8, 16]))
    assert displaced.factors == [8, 16] and displaced.heights(1).shape == (8, 8)
    assert float(displaced.level(1e6)) == 1.0
    wo = np.array([0.3, 0.1, np.sqrt(0.9)])
    uv = random.random((4000, 2))
    wi, weight, pdf = displaced.sample(0.5, uv, wo, random.random((4000, 2)))
    reflected, again = displaced.evaluate(0.5, uv, wi, wo)
    drawn = (pdf > 1e-3) & (weight[:, 0] > 0)
    assert np.allclose(again[drawn], pdf[drawn], rtol=1e-3)
    assert np.allclose(reflected[drawn] / pdf[drawn, None], weight[drawn], rtol=1e-2, atol=1e-3)
    with pytest.raises(ValueError):
        displaced.heights(0)[0, 0] = 1.0


def test_waves_answer_in_colours():
    wave = gn.wave_pyramid(gn.synth("grating", 64, heights=True, texel_size_um=0.5), stride=16).open()
    assert wave.channels == 3
    colours = wave.density_rgb([0.5, 0.5], [[0.0, 0.0], [0.1, 0.0]], sigma=20.0)
    spectrum = wave.density_spectrum([0.5, 0.5], [[0.0, 0.0], [0.1, 0.0]], sigma=20.0)
    assert colours.shape == (2, 3) and spectrum.shape == (2, 3)
    assert np.ptp(colours[1]) > 1  # diffraction has a colour
