"""The digest of an asset, computed with h5py by formats/SPEC.md, section 3, alone."""

import ctypes
import ctypes.util
import pathlib
import shutil
import struct

import h5py
import numpy as np
import pytest

GOLDEN = pathlib.Path(__file__).parent.parent / "golden" / "v1.0"
FILES = sorted(GOLDEN.glob("*.glint"))
INTEGERS = {f"{sign}{8 * size}": np.dtype(f"<{sign}{size}") for sign in "iu" for size in (1, 2, 4, 8)}
NAMES = {dtype: name for name, dtype in INTEGERS.items()} | {np.dtype("<f2"): "f16", np.dtype("<f4"): "f32"}


class Hash128(ctypes.Structure):
    _fields_ = [("low", ctypes.c_uint64), ("high", ctypes.c_uint64)]


def xxh3_128(data):
    library = ctypes.CDLL(ctypes.util.find_library("xxhash") or "libxxhash.so.0")
    library.XXH3_128bits.restype = Hash128
    library.XXH3_128bits.argtypes = [ctypes.c_char_p, ctypes.c_size_t]
    hashed = library.XXH3_128bits(data, len(data))
    return f"{hashed.high:016x}{hashed.low:016x}"


def u64(value):
    return struct.pack("<Q", value)


def text(value):
    return value.encode() + b"\0"


def type_name(dtype):
    if dtype.kind == "S":
        return "text"
    return "ndf_cluster" if dtype.kind == "V" else NAMES.get(dtype, "unknown")


def attributes(item):
    names = sorted((name for name in item.attrs if not (item.name == "/" and name == "digest")), key=str.encode)
    yield u64(len(names))
    for name in names:
        dtype, shape = item.attrs.get_id(name).dtype, item.attrs.get_id(name).shape
        value = np.ravel(item.attrs[name]) if np.prod(shape) > 0 else []
        yield text(name) + text(type_name(dtype)) + u64(2**64 - 1 if shape == () else shape[0])
        for element in value:
            yield bytes(element) + b"\0" if dtype.kind == "S" else struct.pack("<d", element)


def digest(file):
    items = {"/": file}
    file.visititems(lambda name, item: items.__setitem__("/" + name, item))
    data = b""
    for path in sorted(items, key=str.encode):
        item = items[path]
        data += text(path) + text("dataset" if isinstance(item, h5py.Dataset) else "group")
        if isinstance(item, h5py.Dataset):
            data += text(type_name(item.dtype)) + u64(item.ndim) + b"".join(map(u64, item.shape))
        data += b"".join(attributes(item))
    return xxh3_128(data)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_digest_is_that_of_the_specification(path):
    with h5py.File(path, "r") as file:
        assert file.attrs["digest"].decode() == digest(file)


def changed(path, tmp_path, change):
    """A copy of a file that h5py changed: its checksums are right, its digest is the old one."""
    copy = tmp_path / "changed.glint"
    shutil.copy(path, copy)
    with h5py.File(copy, "r+") as file:
        change(file)
    return copy


CHANGES = {
    "value": lambda file: file.attrs.modify("width", np.int32(file.attrs["width"]))
    or file.attrs.modify("texel_size_um", np.float32(9)),
    "generator": lambda file: file.attrs.modify("generator", np.bytes_("sample_assets 1.1")),
    "long_name": lambda file: file["heights"].attrs.modify("long_name", np.bytes_("depths")),
    "group": lambda file: file.create_group("hidden") and None,
    "attribute": lambda file: file["heights"].attrs.__setitem__("note", np.bytes_("hidden")),
}


@pytest.mark.parametrize("change", CHANGES)
def test_validate_finds_what_the_digest_is_not_of(glint, tmp_path, change):
    process = glint("validate", changed(GOLDEN / "heights.glint", tmp_path, CHANGES[change]))
    assert process.returncode == 3
    assert "file.digest" in process.stdout + process.stderr


def test_a_file_without_a_digest_is_valid(glint, tmp_path):
    assert (
        glint("validate", changed(GOLDEN / "heights.glint", tmp_path, lambda file: file.attrs.__delitem__("digest"))).returncode
        == 0
    )
