"""Images that tests write, and how they are ingested. Everything is top row first."""

import struct

import h5py
import numpy
import pytest

oiio = pytest.importorskip("OpenImageIO")

# Normals of codes of 8 bits are off by half a code of each component, which normalising can double.
CODE = 2 / 255
# Normals of floats are off by rounding, those of half precision by a unit in the last of 11 bits.
HALF = 2e-3


def surface(width=48, height=40, steepness=0.6):
    """A smooth map that tiles and looks different after every turn: [height][width][3], top row first, components -1..1."""
    x, y = numpy.meshgrid(numpy.arange(width) / width, numpy.arange(height) / height)
    p = steepness * numpy.sin(2 * numpy.pi * x) + 0.2 * numpy.cos(2 * numpy.pi * (x + 2 * y))
    q = steepness * numpy.cos(2 * numpy.pi * y) - 0.1 * numpy.sin(4 * numpy.pi * x)
    n = numpy.stack([-p, -q, numpy.ones_like(p)], axis=-1)
    return n / numpy.linalg.norm(n, axis=-1, keepdims=True)


def unorm(normals):
    return (0.5 + 0.5 * normals).astype(numpy.float32)


def codes(normals):
    return numpy.round(255 * unorm(normals)).astype(numpy.uint8)


def write(path, pixels, kind="float", names=None, window=None, display=None, alpha=-1, **attributes):
    """Writes pixels [height][width][channels]; window: column and row of the first pixel; display: width and height;
    alpha: number of that channel."""
    pixels = numpy.ascontiguousarray(pixels)
    height, width, channels = pixels.shape
    spec = oiio.ImageSpec(width, height, channels, kind)
    if names:
        spec.channelnames = names
    if alpha >= 0:
        spec.alpha_channel = alpha
    if window:
        spec.x, spec.y = window
        spec.full_width, spec.full_height = display
    for name, value in attributes.items():
        spec.attribute(name, value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(pixels), output.geterror()
    output.close()


def write_parts(path, parts, kind="float", names=("", ""), channels=(None, None)):
    output = oiio.ImageOutput.create(str(path))
    specs = []
    for pixels, name, channel_names in zip(parts, names, channels):
        spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
        if channel_names:
            spec.channelnames = channel_names
        if name:
            spec.attribute("oiio:subimagename", name)
        specs.append(spec)
    if names[0]:
        assert output.open(str(path), tuple(specs)), output.geterror()
    else:
        assert output.open(str(path), specs[0]), output.geterror()
    for k, pixels in enumerate(parts):
        if k > 0:
            assert output.open(str(path), specs[k], "AppendSubimage"), output.geterror()
        assert output.write_image(numpy.ascontiguousarray(pixels)), output.geterror()
    output.close()


def data(glint, name="normals", asset="o.glint"):
    """A dataset of an asset as an image: top row first."""
    with h5py.File(glint.folder / asset) as file:
        return file[name][...][::-1]


def ingest(glint, image, *options):
    process = glint("ingest", image, "-o", "o.glint", "--dequantize", "none", *options)
    assert process.returncode == 0, process.stderr
    assert glint("validate", "o.glint").returncode == 0
    return process


def refused(glint, image, *words, options=(), code=3):
    process = glint("ingest", image, "-o", "o.glint", *options)
    assert process.returncode == code, process.stderr
    for word in (str(image), *words):
        assert word in process.stderr
    assert not (glint.folder / "o.glint").exists()


def tiff(path, pixels, photometric=1, sample_format=1, extra=()):
    """A TIFF of one channel, written by hand: what Pillow and OpenImageIO do not write. extra: tags with texts."""
    height, width = pixels.shape
    bits = pixels.dtype.itemsize * 8
    body = pixels.tobytes()
    tags = {
        256: (4, width),
        257: (4, height),
        258: (3, bits),
        259: (3, 1),
        262: (3, photometric),
        273: (4, 8),
        277: (3, 1),
        278: (4, height),
        279: (4, len(body)),
        339: (3, sample_format),
    }
    tags.update({number: (2, text.encode() + b"\0") for number, text in extra})
    entries, values = b"", b""
    after = 8 + len(body) + 2 + 12 * len(tags) + 4
    for number in sorted(tags):
        kind, value = tags[number]
        if kind == 2:
            place = value.ljust(4, b"\0") if len(value) <= 4 else struct.pack("<I", after + len(values))
            entries += struct.pack("<HHI", number, kind, len(value)) + place
            values += value if len(value) > 4 else b""
        else:
            entries += struct.pack("<HHI", number, kind, 1) + struct.pack(
                "<HH" if kind == 3 else "<I", *([value, 0] if kind == 3 else [value])
            )
    path.write_bytes(
        b"II*\0" + struct.pack("<I", 8 + len(body)) + body + struct.pack("<H", len(tags)) + entries + bytes(4) + values
    )
