"""What the values of pixels mean: codes, holes, cliffs, seams; and the names of files."""

import json
import os
import struct

import h5py
import numpy
import pytest
from image_writer import CODE, codes, data, ingest, refused, surface, tiff, unorm, write

Image = pytest.importorskip("PIL.Image")
oiio = pytest.importorskip("OpenImageIO")


# --- codes


@pytest.mark.parametrize("kind", ["uint8", "uint16"])
def test_white_that_is_zero_is_inverted(glint, kind):
    full = numpy.iinfo(kind).max
    heights = (numpy.arange(48 * 40).reshape(40, 48) % 251 * (full // 255)).astype(kind)
    tiff(glint.folder / "w.tif", full - heights, photometric=0)
    ingest(glint, "w.tif", "--kind", "height", "--to", "heights")
    assert data(glint, "heights") == pytest.approx(heights / full, abs=1e-6)


def test_white_that_is_zero_in_floats_is_refused(glint):
    tiff(glint.folder / "w.tif", numpy.random.default_rng(1).random((8, 8), numpy.float32), photometric=0, sample_format=3)
    refused(glint, "w.tif", "PhotometricInterpretation", options=["--kind", "height"], code=5)


def stored(pixels, form):
    """8-bit codes as somebody's tool scales them: file name, pixels, type."""
    k = pixels.astype(numpy.float64)
    if form == "257":
        return "c.png", (pixels.astype(numpy.uint16) * 257), "uint16"
    if form == "<<8":
        return "c.tif", (pixels.astype(numpy.uint16) << 8), "uint16"
    if form == "photoshop":
        return "c.tif", numpy.round(numpy.round(k * 32768 / 255) * 65535 / 32768).astype(numpy.uint16), "uint16"
    if form == "snorm":
        return "c.exr", (2 * k / 255 - 1).astype(numpy.float32), "float"
    return "c.exr", (k / 255).astype(numpy.float32), form


@pytest.mark.parametrize("form", ["257", "<<8", "photoshop", "half", "float", "snorm"])
def test_codes_of_eight_bits_are_recognised_in_wider_types(glint, form):
    pixels = codes(surface(256, 256))
    Image.fromarray(pixels).save(glint.folder / "8.png")
    name, wide, kind = stored(pixels, form)
    write(glint.folder / name, wide, kind)
    results = {}
    for image in ("8.png", name):
        process = glint("ingest", image, "-o", f"{image}.glint", "--json")
        results[image] = json.loads(process.stdout)["result"]
        assert results[image]["coarse_codes"] and results[image]["dequantized"], image
    scaling = 2 / 256 if form == "<<8" else CODE / 4  # 255 << 8 is not the largest code: slopes shrink by 1/256
    assert data(glint, asset=f"{name}.glint") == pytest.approx(data(glint, asset="8.png.glint"), abs=scaling)


def test_codes_are_recognised_beside_a_computed_z(glint):
    """What a texture of two channels becomes when its z is computed."""
    xy = codes(surface(256, 256))[..., :2] / 127.5 - 1
    pixels = numpy.concatenate([xy, numpy.sqrt(1 - (xy**2).sum(axis=-1, keepdims=True))], axis=-1)
    write(glint.folder / "z.exr", unorm(pixels))
    process = glint("ingest", "z.exr", "-o", "o.glint", "--json")
    assert json.loads(process.stdout)["result"]["dequantized"]


@pytest.mark.parametrize("name, kind", [("c.png", "uint16"), ("c.exr", "half"), ("c.exr", "float")])
def test_real_precision_is_left_alone(glint, name, kind):
    write(glint.folder / name, unorm(surface(256, 256)), kind)
    process = glint("ingest", name, "-o", "o.glint", "--json")
    result = json.loads(process.stdout)["result"]
    assert not result["coarse_codes"] and not result["dequantized"]


@pytest.mark.parametrize("length", [1e-30, 1e-20, 1e30, 3e38])
def test_vectors_of_any_length_are_normalised(glint, length):
    pixels = surface(32, 32).astype(numpy.float32)
    pixels[4, 5] = numpy.array([1, 0, 1]) * length
    write(glint.folder / "v.exr", pixels)
    ingest(glint, "v.exr", "--encoding", "snorm")
    assert data(glint)[4, 5] == pytest.approx([0.5**0.5, 0], abs=1e-6)


def test_a_few_texels_that_point_down_are_repaired_and_counted(glint):
    pixels = codes(surface(64, 64))
    for column in (5, 9, 30, 50):
        pixels[7, column, 2] = 100
    Image.fromarray(pixels).save(glint.folder / "d.png")
    assert "4 texels point below the surface, of 4096" in ingest(glint, "d.png").stderr
    (glint.folder / "o.glint").unlink()
    pixels[8, 8, 2] = 100  # one more than one in 1000
    Image.fromarray(pixels).save(glint.folder / "d.png")
    refused(glint, "d.png", "column 5, row 7 from the top", "--fix-invalid")
    ingest(glint, "d.png", "--fix-invalid")


def test_blue_that_holds_z_from_0_to_1_is_recognised(glint):
    """x and y from -1 to 1, z from 0 to 1: a convention of some bakers."""
    n = surface()
    pixels = numpy.concatenate([unorm(n[..., :2]), n[..., 2:]], axis=-1)
    for name, kind in (("b.png", "uint8"), ("b.exr", "float")):
        write(glint.folder / name, pixels, kind)
        assert "blue holds z from 0 to 1" in ingest(glint, name).stderr
        assert data(glint) == pytest.approx(n[..., :2], abs=CODE)
    flat = surface(steepness=0.05)
    write(glint.folder / "f.png", unorm(flat), "uint8")
    assert "blue" not in ingest(glint, "f.png").stderr
    assert data(glint) == pytest.approx(flat[..., :2], abs=CODE)


@pytest.mark.parametrize("kind, options, factor", [("isotropic", ["--alpha", ".25"], 8), ("twill", [], 8), ("silk", [], 4)])
def test_the_blue_of_filtered_maps_is_z(glint, kind, options, factor):
    """A box filter makes vectors shorter, as downscaled textures have them."""
    size = 512
    glint("synth", kind, "--size", size, *options, "-o", "n.exr")
    n = oiio.ImageBuf(str(glint.folder / "n.exr")).get_pixels(oiio.FLOAT)[..., :3]
    small = n.reshape(size // factor, factor, size // factor, factor, 3).mean(axis=(1, 3))
    write(glint.folder / "s.png", small, "uint8")
    assert "blue" not in ingest(glint, "s.png").stderr
    vectors = 2 * small - 1
    assert data(glint) == pytest.approx((vectors / numpy.linalg.norm(vectors, axis=-1, keepdims=True))[..., :2], abs=2 * CODE)


# --- heights


@pytest.mark.parametrize("channels, end", [(1, "<"), (1, ">"), (3, "<")])
def test_tiles_of_doubles_are_refused_and_strips_read(glint, channels, end):
    """OpenImageIO 2.4 leaves such tiles unread and says that it has read them."""
    kind = ["--kind", "height", "--to", "heights"] if channels == 1 else ["--encoding", "snorm"]
    pixels = surface() if channels == 3 else numpy.random.default_rng(1).random((40, 48, 1)) * 100
    spec = oiio.ImageSpec(48, 40, channels, "double")
    spec.attribute("tiff:endian", {"<": "little", ">": "big"}[end])
    for tile in (16, 0):
        spec.tile_width = spec.tile_height = tile
        output = oiio.ImageOutput.create("d.tif")
        assert output.open(str(glint.folder / "d.tif"), spec) and output.write_image(pixels), output.geterror()
        output.close()
        if tile > 0:
            refused(glint, "d.tif", "64 bits", "float32", "strips", options=kind, code=5)
    ingest(glint, "d.tif", *kind)
    values = data(glint, "heights" if channels == 1 else "normals")
    assert values == pytest.approx(pixels[..., 0] if channels == 1 else pixels[..., :2], abs=1e-4)


def test_a_tiff_that_does_not_say_its_bits_is_refused(glint):
    """Pillow leaves out the tag where its default, 1, is right; OpenImageIO takes 8 for the default."""
    bits = numpy.random.default_rng(1).random((40, 48)) > 0.5
    image = Image.fromarray(bits.astype(numpy.uint8) * 255)
    image.convert("1").save(glint.folder / "b.tif")
    heights = ["--kind", "height", "--to", "heights"]
    refused(glint, "b.tif", "tag 258", "8 bits", options=heights, code=5)
    for remedy in ("8.tif", "b.png"):
        (image if remedy == "8.tif" else image.convert("1")).save(glint.folder / remedy)
        ingest(glint, remedy, *heights, "--force")
        assert numpy.array_equal(data(glint, "heights") > 0.5, bits)


def test_cliffs_are_moved_to_the_rim_and_counted(glint):
    heights = numpy.zeros((32, 32, 1), numpy.uint16)
    heights[10:20, 12:22] = 65535
    write(glint.folder / "s.png", heights, "uint16")
    process = ingest(glint, "s.png", "--kind", "height", "--height-scale", "65535")
    with h5py.File(glint.folder / "o.glint") as file:
        n = file["normals"][...]
    lengths = numpy.hypot(n[..., 0], n[..., 1])
    assert (lengths > 0.999).sum() == 76  # two texels at each side of 10, less the corners, which have one
    assert "76 texels are at cliffs" in process.stderr


def test_cliffs_of_any_height_are_cliffs(glint):
    heights = numpy.zeros((16, 16, 1), numpy.float32)
    heights[4:9, 4:9] = 3e38
    heights[12, 12] = -3e38
    write(glint.folder / "s.exr", heights)
    ingest(glint, "s.exr", "--kind", "height", "--nodata", "none")
    n = data(glint)
    assert numpy.hypot(n[3, 6, 0], n[3, 6, 1]) > 0.999
    assert numpy.hypot(n[0, 0, 0], n[0, 0, 1]) == 0


def test_steep_sawtooth_is_valid(glint):
    assert glint("synth", "sawtooth", "--height", "--slope", "10", "--size", "64", "-o", "s.exr").returncode == 0
    assert "cliffs" in ingest(glint, "s.exr", "--kind", "height", "--height-scale", "1000").stderr


@pytest.mark.parametrize("number", [-9999, -32768, -3.4028234663852886e38, -3.4e38, 1e20, -1234567])
def test_numbers_that_stand_for_no_data_are_refused_with_a_remedy(glint, number):
    rng = numpy.random.default_rng(3)
    heights = rng.random((24, 24, 1)).astype(numpy.float32)
    heights[:3, :4] = number
    write(glint.folder / "h.exr", heights)
    options = ["--kind", "height", "--to", "heights"]
    process = glint("ingest", "h.exr", "-o", "o.glint", *options)
    assert process.returncode == 3
    assert "--nodata none" in process.stderr
    remedy = process.stderr.split("--nodata ")[1].split(",")[0]
    assert "12 texels hold no data" in ingest(glint, "h.exr", *options, "--nodata", remedy).stderr
    filled = data(glint, "heights")
    assert filled.min() >= 0 and filled.max() <= 1
    assert filled[5:, 5:] == pytest.approx(heights[5:, 5:, 0])
    ingest(glint, "h.exr", *options, "--nodata", "none")
    assert data(glint, "heights")[0, 0] == numpy.float32(number)


@pytest.mark.parametrize(
    "kind, number, text",
    [
        ("float32", -9999, "-9999"),
        ("int16", -32768, "-32768"),
        ("uint8", 0, "0"),
        ("uint16", 7, "7 "),
        ("float32", numpy.nan, "nan"),
        ("float64", -1.7976931348623157e308, "-1.7976931348623157e+308"),
    ],
)
def test_the_tag_of_a_geotiff_names_its_holes(glint, kind, number, text):
    rng = numpy.random.default_rng(3)
    heights = (rng.random((24, 24)) * 100 + 20).astype(kind)
    heights[2:5, 3:7] = number
    sample_format = {"f": 3, "i": 2, "u": 1}[heights.dtype.kind]
    tiff(glint.folder / "g.tif", heights, sample_format=sample_format, extra=[(42113, text)])
    process = ingest(glint, "g.tif", "--kind", "height", "--to", "heights")
    assert "12 texels hold no data" in process.stderr
    full = numpy.iinfo(kind).max if heights.dtype.kind in "iu" else 1
    filled = data(glint, "heights") * full
    assert filled.min() > 19 and filled.max() < 121
    assert filled[6:] == pytest.approx(heights[6:], rel=1e-5)


@pytest.mark.parametrize("kind", ["uint8", "uint16"])
@pytest.mark.parametrize("options", [(), ("--nodata", "0")], ids=["tag", "option"])
def test_the_number_for_no_data_is_that_of_the_file_where_zero_is_white(glint, kind, options):
    full = numpy.iinfo(kind).max
    heights = numpy.random.default_rng(3).integers(20, 120, (24, 24)).astype(kind)
    stored = full - heights
    stored[2:5, 3:7] = 0
    stored[10, 10] = full  # what 0 becomes when 0 is white
    tiff(glint.folder / "g.tif", stored, photometric=0, extra=() if options else [(42113, "0")])
    process = ingest(glint, "g.tif", "--kind", "height", "--to", "heights", *options)
    assert "12 texels hold no data (0)" in process.stderr
    filled = data(glint, "heights") * full
    assert filled.max() < 121 and filled[10, 10] == 0


def test_a_number_for_no_data_that_no_texel_holds_hides_no_other(glint):
    heights = numpy.random.default_rng(3).random((24, 24, 1)).astype(numpy.float32)
    options = ["--kind", "height", "--to", "heights", "--nodata", "-1"]
    holed = heights.copy()
    holed[:3, :4] = -32768
    write(glint.folder / "holed.exr", holed)
    refused(glint, "holed.exr", "-32768", "--nodata -32768", options=options)
    write(glint.folder / "whole.exr", heights)
    assert "no texel holds -1" in ingest(glint, "whole.exr", *options).stderr


def test_the_tag_is_found_in_big_tiffs_of_either_byte_order(glint):
    heights = numpy.linspace(0, 50, 24 * 24, dtype=numpy.float32).reshape(24, 24)
    heights[2:5, 3:7] = -1000
    body = heights.astype(">f4").tobytes()
    tags = {
        256: (4, 24),
        257: (4, 24),
        258: (3, 32),
        259: (3, 1),
        262: (3, 1),
        273: (4, 16),
        277: (3, 1),
        278: (4, 24),
        279: (4, len(body)),
        339: (3, 3),
    }
    entries = b"".join(
        struct.pack(">HHQ", n, kind, 1) + (struct.pack(">HHI", v, 0, 0) if kind == 3 else struct.pack(">II", v, 0))
        for n, (kind, v) in sorted(tags.items())
    )
    entries += struct.pack(">HHQ", 42113, 2, 6) + b"-1000\0\0\0"
    header = b"MM\0\x2b\0\x08\0\0" + struct.pack(">Q", 16 + len(body))
    (glint.folder / "g.tif").write_bytes(header + body + struct.pack(">Q", len(tags) + 1) + entries + bytes(8))
    process = ingest(glint, "g.tif", "--kind", "height", "--to", "heights")
    assert "12 texels hold no data (-1000)" in process.stderr
    assert data(glint, "heights").min() >= 0


def test_heights_that_do_not_tile_are_warned_of_and_clamped(glint):
    heights = numpy.repeat(numpy.arange(32, dtype=numpy.float32)[None, :, None], 32, axis=0)
    write(glint.folder / "r.exr", heights)
    process = ingest(glint, "r.exr", "--kind", "height")
    assert (
        "left and right borders" in process.stderr and "31.0 times" in process.stderr and "--boundary clamp" in process.stderr
    )
    assert "upper and lower" not in process.stderr
    assert "borders" not in ingest(glint, "r.exr", "--kind", "height", "--boundary", "clamp").stderr
    assert data(glint)[..., 0] == pytest.approx(-numpy.sqrt(0.5), abs=1e-6)  # a slope of 1 everywhere


@pytest.mark.parametrize("kind", ["isotropic", "brushed", "leather", "weave", "sawtooth", "scratches"])
def test_heights_that_tile_are_not_warned_of(glint, kind):
    assert glint("synth", kind, "--height", "--size", "96", "-o", "h.exr").returncode == 0
    assert "borders" not in ingest(glint, "h.exr", "--kind", "height").stderr


def test_numbers_for_no_data_are_checked(glint):
    write(glint.folder / "r.exr", surface().astype(numpy.float32))
    process = glint("ingest", "r.exr", "-o", "o.glint", "--nodata", "nought")
    assert process.returncode == 1 and "--nodata" in process.stderr


# --- names and pipes


def test_a_pipe_is_called_a_pipe(glint):
    os.mkfifo(glint.folder / "pipe.png")
    for command in (["ingest", "pipe.png"], ["shlobes", "--light", "pipe.png"], ["pyramid", "pipe.png"]):
        process = glint(*command, "-o", "o.glint")
        assert process.returncode == 2, process.stderr
        assert "pipe.png: is a pipe, not a file" in process.stderr


def test_names_that_are_no_text_are_named(glint):
    name = b"wei\xdf.png"
    Image.fromarray(codes(surface())).save(glint.folder / "w.png")
    os.rename(glint.folder / "w.png", os.path.join(os.fsencode(glint.folder), name))
    process = glint("ingest", os.fsdecode(name), "-o", "o.glint")
    assert process.returncode == 2
    assert r"wei\xdf.png" in process.stderr and "UTF-8" in process.stderr
    assert not (glint.folder / "o.glint").exists()


@pytest.mark.parametrize("name", ["a?b.tif", "a?b=c.exr", "q?/x.EXR", "p?.png", "wrong?.hdr", "none?x"])
def test_a_question_mark_is_part_of_a_name(glint, name):
    """OpenImageIO takes the text after it for options of a reader."""
    path = glint.folder / name
    path.parent.mkdir(exist_ok=True)
    kind = path.suffix if path.suffix in (".png", ".tif") else ".exr"
    write(glint.folder / f"plain{kind}", unorm(surface()), "uint8" if kind == ".png" else "float")
    os.rename(glint.folder / f"plain{kind}", path)
    ingest(glint, name)
    assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)
    path.write_bytes(b"no image")
    (glint.folder / "o.glint").unlink()
    refused(glint, name, "image")


def test_a_question_mark_is_part_of_the_name_of_an_output(glint):
    assert glint("synth", "flakes", "--size", "16", "-o", "o?p.exr").returncode == 0
    assert (glint.folder / "o?p.exr").exists()
    ingest(glint, "o?p.exr")


def test_the_longest_names_work(glint):
    name = "n" * 251 + ".png"
    Image.fromarray(codes(surface())).save(glint.folder / name)
    ingest(glint, name)


@pytest.mark.parametrize("quality", [50, 80])
@pytest.mark.parametrize("kind, options", [("leather", []), ("isotropic", ["--alpha", "0.3"])])
def test_maps_that_jpeg_has_compressed_are_read(glint, kind, options, quality):
    """The noise of JPEG in blue is no occlusion: blue still goes with z."""
    assert glint("synth", kind, "--size", "256", *options, "-o", "map.png").returncode == 0
    Image.open(glint.folder / "map.png").convert("RGB").save(glint.folder / "map.jpg", quality=quality)
    process = glint("ingest", "map.jpg", "-o", "map.glint")
    assert process.returncode == 0, process.stderr
    assert "not of unit length" in process.stderr
    assert glint("validate", "map.glint").returncode == 0
