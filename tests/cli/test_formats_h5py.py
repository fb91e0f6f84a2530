"""Reads every golden file with h5py and formats/SPEC.md only, and checks densities against sums that must be 1."""

import pathlib

import h5py
import numpy as np
import pytest

GOLDEN = pathlib.Path(__file__).parent.parent / "golden" / "v1.0"
INTEGRAL_TOLERANCE = 1e-3  # of the format: SPEC.md, rule pyramid.integral


def text(value):
    return value.decode("utf-8")


def open_asset(name, kind):
    file = h5py.File(GOLDEN / name, "r")
    assert text(file.attrs["glint_format"]) == "glint"
    assert file.attrs["format_major"] == 1
    assert len(file.attrs["required_features"]) == 0
    assert text(file.attrs["kind"]) == kind
    return file


def bits(words):
    """All bits of an array of u64, lowest first."""
    return np.array([(int(word) >> b) & 1 for word in np.ravel(words) for b in range(64)])


def pyramid_image(file, level, i, j):
    resolution = file.attrs["resolution"]
    per_axis = resolution // 16
    group = file[f"level_{level:02d}"]
    occupied = bits(group["masks"][j, i])
    words = group["masks"].shape[2]
    first = int(group["mask_ranks"][(j * file.attrs["level_columns"][level] + i) * words])
    image = np.zeros((resolution, resolution))
    for b in range(per_axis**2):
        if occupied[b]:
            block = group["pixels"][first + occupied[:b].sum()].astype(np.float64)
            y, x = 16 * (b // per_axis), 16 * (b % per_axis)
            image[y : y + 16, x : x + 16] = file.attrs["value_scale"] * block
    return image


def basis_images(method, file, cluster):
    """[K][16][16], rows y."""
    basis = file["basis"]
    p, k, rx, ry = (int(cluster[name]) for name in ("first_basis", "columns", "rank_x", "rank_y"))

    def functions(at, rank):
        sums = basis[at : at + 16 * rank].astype(np.float64).reshape(16, rank)
        return np.diff(sums, axis=0, prepend=0)

    if method == "cp":
        return np.einsum("xk,yk->kyx", functions(p, k), functions(p + 16 * k, k))
    if method == "tucker":
        core = file["core"][int(cluster["first_scale"]) :][:k]
        u, v = functions(p, rx)[:, core % 16], functions(p + 16 * rx, ry)[:, core // 16]
        return np.einsum("xk,yk->kyx", u, v)
    sums = basis[p : p + 256 * k].astype(np.float64).reshape(16, 16, k)
    return np.diff(np.diff(sums, axis=0, prepend=0), axis=1, prepend=0).transpose(2, 0, 1)


def coefficients_of(file, cluster, slice_index):
    """[K]: wide ones, then those of 4 bits."""
    k, narrow = int(cluster["columns"]), int(cluster["narrow_columns"])
    wide, half = k - narrow, (narrow + 1) // 2
    first = int(cluster["first_coefficient"]) + slice_index * (wide + half)
    row = file["coefficients"][first : first + wide + half]
    if narrow == 0:
        return row.astype(np.float64)
    packed = row[wide:].view(np.uint8).astype(int)
    halves = np.concatenate([packed & 15, packed >> 4])[:narrow]
    return np.concatenate([row[:wide].astype(np.float64), np.where(halves < 8, halves, halves - 16)])


def spots_block(file, cluster, slice_index):
    """[16][16] of a slice of spots."""
    n = int(cluster["slice_count"])
    data = file["coefficients"][int(cluster["first_coefficient"]) :].view(np.uint8)
    groups = -(-n // 16)
    before = data[: 4 * groups].view("<u4")
    counts, rests = data[4 * groups :][:n].astype(int), data[4 * groups + n :][:n]
    first = counts[: slice_index // 16 * 16].sum()
    assert first == before[slice_index // 16]
    first += counts[slice_index // 16 * 16 : slice_index].sum()
    spots = data[4 * groups + -(-2 * n // 4) * 4 + 4 * first :][: 4 * counts[slice_index]].reshape(-1, 4)
    weight_scale, rest_scale = file["scales"][int(cluster["first_scale"]) :][:2].astype(np.float64)
    rest = (rests[slice_index : slice_index + 1].astype(np.uint16) * 64).view(np.float16)[0]
    block = np.full((16, 16), rest_scale * float(rest))
    edges = 8 * np.arange(17) + 176
    for x, y, low, high in spots.astype(int):
        along = [np.diff(file["spot_sums"][...].astype(np.float64)[edges - place]) for place in (x, y)]
        block += weight_scale * (low + 256 * high) * np.outer(along[1], along[0])
    return block


def compressed_image(file, m):
    resolution = file.attrs["resolution"]
    per_axis = resolution // 16
    method = text(file.attrs["method"])
    region, slot = int(file["image_regions"][m]), int(file["image_slots"][m])
    image = np.zeros((resolution, resolution))
    for place, b in enumerate(file["place_blocks"][...].astype(int)):
        assert file["block_places"][b] == place
        cluster = file["clusters"][region, place]
        at = int(cluster["first_word"]) + slot // 64
        word = int(file["masks"][at])
        if not (word >> (slot % 64)) & 1:
            continue
        below = bin(word & ((1 << (slot % 64)) - 1)).count("1")
        slice_index = int(file["mask_ranks"][at]) + below
        count = int(cluster["columns"])
        if count == 0:
            block = spots_block(file, cluster, slice_index)
        else:
            scales = file["scales"][int(cluster["first_scale"]) : int(cluster["first_scale"]) + count].astype(np.float64)
            images = basis_images(method, file, cluster)
            block = np.tensordot(scales * coefficients_of(file, cluster, slice_index), images, axes=1)
        y, x = 16 * (b // per_axis), 16 * (b % per_axis)
        image[y : y + 16, x : x + 16] = block
    return image * file["image_scales"][m]


def floors(file, m):
    """What is taken off the pixels of an image, before its scale, where densities must not be negative."""
    resolution = file.attrs["resolution"]
    per_axis = resolution // 16
    image = np.zeros((resolution, resolution))
    region = int(file["image_regions"][m])
    for place, b in enumerate(file["place_blocks"][...].astype(int)):
        codes = file["floors"][region, place].reshape(4, 4).astype(np.uint16) * 64
        block = np.kron(codes.view(np.float16).astype(np.float64), np.ones((4, 4)))
        y, x = 16 * (b // per_axis), 16 * (b % per_axis)
        image[y : y + 16, x : x + 16] = block * float(file["clusters"][region, place]["floor_unit"])
    return image


def block_shares(file, m):
    """Stored shares of the blocks of an image, by block."""
    blocks = (file.attrs["resolution"] // 16) ** 2
    stored = enumerate(file["place_blocks"][...].astype(int))
    bits = [b for place, b in stored if int(file["block_masks"][m, place // 64]) >> (place % 64) & 1]
    first, last = (int(file["first_block"][k]) for k in (m, m + 1))
    codes = file["block_masses"][first:last].astype(np.uint16) * 64
    assert len(bits) == len(codes)
    shares = np.zeros(blocks)
    shares[bits] = codes.view(np.float16)
    return shares


def integral(image):
    return image.sum() * (2 / len(image)) ** 2


def test_normals():
    file = open_asset("normals.glint", "normals")
    normals = file["normals"][...]
    height, width = file.attrs["height"], file.attrs["width"]
    assert normals.shape == (height, width, 2)
    assert (np.square(normals).sum(axis=-1) < 1).all()
    assert normals[3, 5, 0] == np.float32(0.194547504)
    for level in range(file.attrs["bounds_level_count"]):
        bounds = file[f"bounds/level_{level:02d}"][...]
        size = 2 ** (level + 1)
        for j, i in np.ndindex(bounds.shape[:2]):
            rows = np.arange(j * size, min((j + 1) * size, height) + 1) % height
            columns = np.arange(i * size, min((i + 1) * size, width) + 1) % width
            block = normals[np.ix_(rows, columns)].reshape(-1, 2)
            assert np.array_equal(bounds[j, i], np.concatenate([block.min(axis=0), block.max(axis=0)]))


def test_heights():
    file = open_asset("heights.glint", "heights")
    assert file["heights"].shape == (file.attrs["height"], file.attrs["width"])
    assert file["heights"][3, 5] == np.float32(0.0129489619)


def test_pyramid():
    file = open_asset("ndf-pyramid.glint", "ndf-pyramid")
    for level in range(file.attrs["level_count"]):
        for j in range(file.attrs["level_rows"][level]):
            for i in range(file.attrs["level_columns"][level]):
                assert abs(integral(pyramid_image(file, level, i, j)) - 1) < INTEGRAL_TOLERANCE
        group = file[f"level_{level:02d}"]
        means = group["pixels"][...].astype(np.float64).mean(axis=(1, 2)) * file.attrs["value_scale"]
        np.testing.assert_allclose(group["block_means"][...], means, rtol=1e-3)
    assert pyramid_image(file, 0, 1, 1)[33, 30] == np.float32(4.3046875)
    assert pyramid_image(file, 1, 0, 1)[29, 35] == np.float32(4.7890625)


@pytest.mark.parametrize(
    "name, values",
    [
        ("cp-i8", (3.49882889, 3.00286174, 2.97668457)),
        ("tucker-f16", (4.83468008, 3.82640028, 3.10592413)),
        ("pca-i8", (3.49882889, 3.0028615, 2.97668457)),
        ("narrow-i8", (4.72693872, 3.72354555, 3.08629251)),
        ("spots-i8", (0.513697445, 0.513941109, 0.515995741)),
        ("cp-f32", (3.49453115, 3.00421071, 2.98451018)),
    ],
)
def test_compressed(name, values):
    file = open_asset(f"ndf-cp-{name}.glint", "ndf-cp")
    images = [compressed_image(file, m) for m in range(len(file["image_regions"]))]
    for m, image in enumerate(images):
        assert abs(integral(image) - 1) < INTEGRAL_TOLERANCE
        density = np.maximum(image / file["image_scales"][m] - floors(file, m), 0) * file["density_scales"][m]
        assert abs(integral(density) - 1) < INTEGRAL_TOLERANCE
        per_axis = len(image) // 16
        shares = density.reshape(per_axis, 16, per_axis, 16).sum(axis=(1, 3)).ravel() * (2 / len(image)) ** 2
        stored = block_shares(file, m)
        assert (stored >= shares).all() and (stored <= shares * 1.0626 + 2**-17).all()
    recorded = (images[5][33, 30], images[18][29, 35], images[20][32, 24])
    np.testing.assert_allclose(recorded, values, rtol=1e-5)


@pytest.mark.parametrize("path", sorted(GOLDEN.glob("*.glint")), ids=lambda path: path.stem)
def test_every_dataset_says_what_it_is(path):
    def check(name, item):
        if isinstance(item, h5py.Dataset):
            assert text(item.attrs["long_name"]) and text(item.attrs["units"]), name
            assert len(item.attrs["xxh3_128"]) == 32, name
            assert item.chunks is None and (item.size == 0 or item.id.get_offset() % 64 == 0), name

    with h5py.File(path, "r") as file:
        file.visititems(check)
