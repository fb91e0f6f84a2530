"""What an image file says about its pixels: window, orientation, alpha, parts, layers, channels."""

import struct

import h5py
import numpy
import pytest
from image_writer import CODE, HALF, codes, data, ingest, oiio, refused, surface, unorm, write, write_parts

Image = pytest.importorskip("PIL.Image")


# --- the window that is shown


@pytest.mark.parametrize("name", ["w.exr", "w.tif"])
def test_missing_pixels_of_the_display_window_are_refused(glint, name):
    write(glint.folder / name, unorm(surface(40, 32)), window=(10, 6), display=(64, 48))
    missing = 64 * 48 - 40 * 32
    refused(glint, name, f"{missing} are missing", "column 10, row 6", "--window data")
    ingest(glint, name, "--window", "data")
    assert data(glint) == pytest.approx(surface(40, 32)[..., :2], abs=HALF)


def test_overscan_is_cut_off_and_told(glint):
    write(glint.folder / "w.exr", unorm(surface(40, 32)), window=(-4, -2), display=(34, 27))
    assert "display window" in ingest(glint, "w.exr").stderr
    assert data(glint) == pytest.approx(surface(40, 32)[2:29, 4:38, :2], abs=HALF)


def test_environment_that_was_cropped_is_refused(glint):
    write(glint.folder / "env.exr", numpy.ones((16, 32, 3), numpy.float32), window=(16, 8), display=(64, 32))
    process = glint("shlobes", "--light", "env.exr", "-o", "o.glint", "--order", 4)
    assert process.returncode == 3
    assert "env.exr" in process.stderr and "missing" in process.stderr


# --- orientation

TURNS = {
    1: lambda a: a,
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.transpose(1, 0, 2),
    6: lambda a: numpy.rot90(a, -1),
    7: lambda a: numpy.rot90(a, 2).transpose(1, 0, 2),
    8: lambda a: numpy.rot90(a),
}


@pytest.mark.parametrize("orientation", TURNS)
@pytest.mark.parametrize("name", ["a.exr", "a.tif", "a.png", "a.jpg", "a.webp"])
def test_orientation_is_that_of_a_viewer(glint, name, orientation):
    stored, path = surface(), glint.folder / name
    if name.endswith((".png", ".jpg", ".webp")):
        exif = Image.Exif()
        exif[274] = orientation
        exact = {"a.jpg": {"quality": 100, "subsampling": 0}, "a.webp": {"lossless": True}}
        Image.fromarray(codes(stored)).save(path, exif=exif, **exact.get(name, {}))
    else:
        write(path, unorm(stored), Orientation=orientation)
    ingest(glint, name)
    jpeg_error = 0.03  # rounding of frequencies, in components
    assert data(glint) == pytest.approx(TURNS[orientation](stored)[..., :2], abs=jpeg_error)


# --- alpha


def with_alpha(values, alpha, multiply=True):
    values = values * alpha if multiply else values
    return numpy.concatenate([values, numpy.broadcast_to(alpha, values.shape[:2] + (1,))], axis=-1).astype(numpy.float32)


def varying_alpha(width=48, height=40):
    return 0.55 + 0.45 * numpy.linspace(0, 1, width * height).reshape(height, width, 1)


@pytest.mark.parametrize(
    "name, kind, error",
    [("a.exr", "float", HALF), ("a.exr", "half", 4e-3), ("a.tif", "uint16", HALF), ("a.tif", "uint8", 3 * CODE)],
)
def test_colours_are_divided_by_associated_alpha(glint, name, kind, error):
    write(glint.folder / name, with_alpha(unorm(surface()), varying_alpha()), kind)
    ingest(glint, name)
    assert data(glint) == pytest.approx(surface()[..., :2], abs=error)


@pytest.mark.parametrize("name", ["a.tif", "a.png", "a.tga"])
def test_straight_alpha_leaves_colours_alone(glint, name):
    pixels = with_alpha(unorm(surface()), varying_alpha(), multiply=False)
    write(glint.folder / name, pixels, "uint8", **{"oiio:UnassociatedAlpha": 1})
    ingest(glint, name)
    assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)


def test_formats_that_are_multiplied_while_they_are_read_are_divided(glint):
    pixels = numpy.round(255 * with_alpha(unorm(surface()), varying_alpha(), multiply=False)).astype(numpy.uint8)
    Image.fromarray(pixels).save(glint.folder / "a.webp", lossless=True)
    ingest(glint, "a.webp")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=3 * CODE)


def test_a_webp_whose_alpha_takes_bits_of_colours_is_refused(glint):
    """OpenImageIO multiplies colours of a WebP by alpha in 8 bits: an alpha of 8 would leave five levels."""
    alpha = numpy.ones((40, 48, 1))
    alpha[3, 5] = 8 / 255
    pixels = numpy.round(255 * with_alpha(unorm(surface()), alpha, multiply=False)).astype(numpy.uint8)
    Image.fromarray(pixels).save(glint.folder / "a.webp", lossless=True, exact=True)
    refused(glint, "a.webp", "1 pixel has an alpha below a half", "column 5, row 3 from the top", "PNG")
    Image.fromarray(pixels).save(glint.folder / "a.png")
    ingest(glint, "a.png")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)


def test_transparent_pixels_are_refused_or_filled(glint):
    alpha = numpy.ones((40, 48, 1))
    alpha[3, 5] = 0
    write(glint.folder / "a.exr", with_alpha(unorm(surface()), alpha))
    refused(glint, "a.exr", "1 pixel is transparent", "column 5, row 3 from the top", "--fix-invalid")
    ingest(glint, "a.exr", "--fix-invalid")
    assert numpy.isfinite(data(glint)).all()


def test_alpha_that_is_something_else_is_refused_with_a_remedy(glint):
    alpha = varying_alpha()
    alpha[3, 5] = 0
    write(glint.folder / "a.exr", with_alpha(unorm(surface()), alpha, multiply=False))
    refused(glint, "a.exr", "column 5, row 3 from the top", "alpha is 0 and the colour is not", "--alpha ignore")
    ingest(glint, "a.exr", "--alpha", "ignore")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=HALF)


def test_base_colours_are_divided_by_associated_alpha(glint):
    """A grey of .604 (sRGB code 204) under an alpha of one half."""
    assert glint("synth", "leather", "--size", "32", "--height", "-o", "h.exr").returncode == 0
    assert glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "-o", "h.glint").returncode == 0
    code, alpha = 204, 128
    associated = round(code * alpha / 255)
    pixels = numpy.empty((32, 32, 4), numpy.uint8)
    pixels[...] = [associated, associated, associated, alpha]
    write(glint.folder / "c.tif", pixels, "uint8")
    straight = numpy.full((32, 32, 3), code, numpy.uint8)
    write(glint.folder / "d.png", straight, "uint8")
    for image in ("c.tif", "d.png"):
        process = glint("displace", "h.glint", "-o", "d.glint", "--factor", "32", "--base", "diffuse:1", "--base-color", image)
        assert process.returncode == 0, process.stderr
        with h5py.File(glint.folder / "d.glint") as file:
            colours = file["level_00/lobe_colors"][...]
        half_a_code = 0.006  # of the associated value
        assert colours[colours > 0] == pytest.approx(0.604, abs=half_a_code), image


def test_remedies_name_options_of_the_tool_that_reads_the_image(glint):
    assert glint("synth", "leather", "--size", "32", "--height", "-o", "h.exr").returncode == 0
    assert glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "-o", "h.glint").returncode == 0
    alpha = numpy.zeros((32, 32, 1))
    write(glint.folder / "c.exr", with_alpha(numpy.full((32, 32, 3), 0.5, numpy.float32), alpha))
    process = glint("displace", "h.glint", "-o", "d.glint", "--factor", "32", "--base-color", "c.exr")
    assert process.returncode == 3
    assert "export the image without alpha" in process.stderr and "--fix-invalid" not in process.stderr, process.stderr


# --- several images in one file


def test_the_first_of_several_parts_is_read_with_a_warning(glint):
    first, second = surface(), surface(steepness=0.2)
    write_parts(glint.folder / "p.exr", [unorm(first), unorm(second)], names=("rough", "smooth"))
    process = ingest(glint, "p.exr")
    assert "0 (rough), 1 (smooth)" in process.stderr and "--subimage" in process.stderr
    assert data(glint) == pytest.approx(first[..., :2], abs=HALF)
    for chosen in ("1", "smooth"):
        assert ingest(glint, "p.exr", "--subimage", chosen).stderr == ""
        assert data(glint) == pytest.approx(second[..., :2], abs=HALF)
    (glint.folder / "o.glint").unlink()
    refused(glint, "p.exr", "smooth", options=["--subimage", "2"])


def test_pages_of_a_tiff_are_named(glint):
    first, second = surface(), surface(steepness=0.2)
    write_parts(glint.folder / "p.tif", [codes(first), codes(second)], "uint8")
    assert "holds 2 images" in ingest(glint, "p.tif").stderr
    ingest(glint, "p.tif", "--subimage", "1")
    assert data(glint) == pytest.approx(second[..., :2], abs=CODE)


def test_layers_are_chosen_by_name(glint):
    pixels = numpy.concatenate([numpy.full((40, 48, 3), 0.3, numpy.float32), unorm(surface())], axis=-1)
    names = ("R", "G", "B", "bumps.X", "bumps.Y", "bumps.Z")
    write(glint.folder / "l.exr", pixels, names=names)
    process = glint("ingest", "l.exr", "-o", "o.glint", "--allow-constant")
    assert "bumps" in process.stderr
    for options in (["--layer", "bumps"], ["--channels", "bumps.X,bumps.Y,bumps.Z"]):
        assert ingest(glint, "l.exr", *options).stderr == ""
        assert data(glint) == pytest.approx(surface()[..., :2], abs=HALF)
    alpha = varying_alpha()
    pixels = numpy.concatenate([pixels[..., :3], unorm(surface()) * alpha, alpha], axis=-1).astype(numpy.float32)
    write(glint.folder / "a.exr", pixels, names=(*names, "bumps.A"))
    ingest(glint, "a.exr", "--layer", "bumps")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=HALF)
    (glint.folder / "o.glint").unlink()
    refused(glint, "l.exr", "bumps.X", options=["--layer", "bump"])
    refused(glint, "l.exr", "bumps.X", options=["--layer", "bumps", "--channels", "xya"])


def test_layers_are_found_in_any_part(glint):
    """A renderer writes each layer as a part: its channels have the layer's name, or only the part has."""
    first, second = unorm(surface()), unorm(surface(steepness=0.2))
    write_parts(glint.folder / "p.exr", [first, second], names=("beauty", "bumps"))
    write_parts(glint.folder / "q.exr", [first, second], names=("a", "b"), channels=(None, ("bumps.X", "bumps.Y", "bumps.Z")))
    for image in ("p.exr", "q.exr"):
        assert ingest(glint, image, "--layer", "bumps").stderr == ""
        assert data(glint) == pytest.approx(surface(steepness=0.2)[..., :2], abs=HALF)
    (glint.folder / "o.glint").unlink()
    refused(glint, "p.exr", "1 (bumps)", options=["--layer", "dents"])
    refused(glint, "q.exr", "bumps", options=["--layer", "bumps", "--subimage", "0"])


def test_channels_that_a_reader_does_not_name_are_read(glint):
    """OpenImageIO names one channel of a FITS file, however many there are."""
    write(glint.folder / "r.fits", surface())
    ingest(glint, "r.fits", "--encoding", "snorm")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=HALF)
    ingest(glint, "r.fits", "--encoding", "snorm", "--channels", "rg", "--force")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=HALF)
    for channels in (2, 4):
        pixels = numpy.zeros((40, 48, channels))
        pixels[..., :2] = surface()[..., :2]
        write(glint.folder / "c.fits", pixels)
        ingest(glint, "c.fits", "--encoding", "snorm", "--channels", "rg", "--force")
        assert data(glint) == pytest.approx(surface()[..., :2], abs=HALF)
    light = glint("shlobes", "--light", "r.fits", "-o", "l.glint", "--order", 4)
    assert light.returncode in (0, 3), light.stderr


# --- conventions for two channels


def test_constant_blue_is_not_taken_for_z(glint):
    for blue in (255, 128, 0):
        pixels = codes(surface())
        pixels[..., 2] = blue
        Image.fromarray(pixels).save(glint.folder / "b.png")
        assert "blue is constant" in ingest(glint, "b.png").stderr
        assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)
        assert ingest(glint, "b.png", "--channels", "rg").stderr == ""
        assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)


def test_constant_blue_that_is_z_stays(glint):
    """So gentle that all z round to 255: nothing contradicts."""
    gentle = surface(steepness=0) * [0.1, 0.1, 1]
    gentle /= numpy.linalg.norm(gentle, axis=-1, keepdims=True)
    pixels = codes(gentle)
    assert (pixels[..., 2] == 255).all()
    Image.fromarray(pixels).save(glint.folder / "b.png")
    assert ingest(glint, "b.png").stderr == ""


def test_occlusion_in_blue_is_refused_with_a_remedy_that_works(glint):
    pixels = codes(surface())
    x, y = numpy.meshgrid(numpy.arange(48), numpy.arange(40))
    pixels[..., 2] = 255 - 40 * ((x * 7 + y * 13) % 5 == 0)
    Image.fromarray(pixels).save(glint.folder / "b.png")
    refused(glint, "b.png", "occlusion", "--channels rg")
    ingest(glint, "b.png", "--channels", "rg")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)


@pytest.mark.parametrize("red, blue", [(255, 255), (0, 0), (255, None)])
def test_x_in_alpha_is_recognised(glint, red, blue):
    n = codes(surface())
    pixels = numpy.empty((40, 48, 4), numpy.uint8)
    pixels[..., 0], pixels[..., 1], pixels[..., 3] = red, n[..., 1], n[..., 0]
    pixels[..., 2] = n[..., 1] if blue is None else blue
    Image.fromarray(pixels).save(glint.folder / "d.png")
    assert "alpha" in ingest(glint, "d.png").stderr
    assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)


@pytest.mark.parametrize("grey, alpha, option", [(1, 0, "ag"), (0, 1, "ra")])
def test_x_and_y_in_grey_and_alpha_need_a_word(glint, grey, alpha, option):
    n = codes(surface())
    pixels = numpy.stack([n[..., grey], n[..., grey], n[..., grey], n[..., alpha]], axis=-1)
    Image.fromarray(pixels).save(glint.folder / "d.png")
    refused(glint, "d.png", "--channels ag", "--channels ra")
    ingest(glint, "d.png", "--channels", option)
    assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)


@pytest.mark.parametrize("name, kind", [("d.png", "uint8"), ("d.png", "uint16"), ("d.tif", "float")])
@pytest.mark.parametrize("grey, alpha, option", [(1, 0, "ag"), (0, 1, "ra")])
def test_grey_and_alpha_of_two_channels_need_the_same_word(glint, name, kind, grey, alpha, option):
    """Optimisers store an image whose red, green and blue are the same as grey and alpha."""
    n = unorm(surface())
    pixels = n[..., [grey, alpha]]
    write(glint.folder / name, pixels, kind, names=["Y", "A"], alpha=1, **{"oiio:UnassociatedAlpha": 1})
    refused(glint, name, "--channels ag", "--channels ra")
    ingest(glint, name, "--channels", option)
    assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)


def test_grey_without_alpha_is_no_normal_map(glint):
    grey = numpy.stack([unorm(surface())[..., 0], numpy.ones((40, 48), numpy.float32)], axis=-1)
    write(glint.folder / "d.png", grey, "uint8", names=["Y", "A"])
    refused(glint, "d.png", "--kind height")
    ingest(glint, "d.png", "--kind", "height")


def test_two_channels_without_alpha_are_x_and_y(glint):
    for name, kind in (("d.exr", "float"), ("d.tif", "uint16")):
        write(glint.folder / name, unorm(surface())[..., :2], kind, names=["R", "G"])
        ingest(glint, name, "--force")
        assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)


def test_x_in_red_or_in_alpha_needs_a_word(glint):
    """Red and blue of one value say nothing of where x is; the z of grooves along x varies."""
    n = codes(surface())
    half = numpy.full_like(n[..., 0], 128)
    Image.fromarray(numpy.stack([half, n[..., 1], half, n[..., 0]], axis=-1)).save(glint.folder / "d.png")
    refused(glint, "d.png", "--channels ag", "--channels rg")
    ingest(glint, "d.png", "--channels", "ag")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=CODE)
    grooves = surface()
    grooves[..., 0] = 0
    grooves /= numpy.linalg.norm(grooves, axis=-1, keepdims=True)
    Image.fromarray(numpy.concatenate([codes(grooves), n[..., :1]], axis=-1)).save(glint.folder / "g.png")
    ingest(glint, "g.png", "--channels", "rgb")
    plain = data(glint)
    ingest(glint, "g.png", "--alpha", "ignore")
    assert numpy.array_equal(data(glint), plain)


def dds(path, code, dxgi=None):
    """Four blocks of two channels, 8 x 8 pixels."""
    block = bytes([200, 100, 0, 0, 0, 0, 0, 0, 60, 20, 1, 2, 3, 4, 5, 6])
    header = b"DDS " + struct.pack("<7I", 124, 0x1007, 8, 8, 0, 0, 0) + bytes(44)
    header += struct.pack("<2I4s5I", 32, 4, code, 0, 0, 0, 0, 0) + struct.pack("<5I", 0x1000, 0, 0, 0, 0)
    if dxgi is not None:
        header += struct.pack("<5I", dxgi, 3, 0, 1, 0)
    path.write_bytes(header + 4 * block)


@pytest.mark.parametrize("code, dxgi", [(b"BC5S", None), (b"DX10", 84)])
def test_signed_two_channel_dds_is_refused_with_a_remedy(glint, code, dxgi):
    dds(glint.folder / "s.dds", code, dxgi)
    refused(glint, "s.dds", "BC5_UNORM")


@pytest.mark.parametrize("length", [0.8, 1.2])
def test_vectors_far_from_unit_length_are_refused_however_many(glint, length):
    write(glint.folder / "v.exr", length * surface().astype(numpy.float32))
    refused(glint, "v.exr", "off unit length", "--channels rgb", options=["--encoding", "snorm"])
    ingest(glint, "v.exr", "--encoding", "snorm", "--channels", "rgb")
    assert data(glint) == pytest.approx(surface()[..., :2], abs=HALF)


def test_vectors_of_filtered_maps_are_normalised(glint):
    write(glint.folder / "v.exr", 0.92 * surface().astype(numpy.float32))
    process = ingest(glint, "v.exr", "--encoding", "snorm")
    assert "off by more than 0.080" in process.stderr


@pytest.mark.parametrize("name", ["tiled.exr", "tiled.tif"])
def test_tiled_images_larger_than_the_memory_are_read(glint, name):
    """Pixels, normals and bounds take 25 MB, and the limit is 16."""
    pixels = numpy.ascontiguousarray(unorm(surface(1024, 1000)), numpy.float32)
    write(glint.folder / "rows.exr", pixels)
    spec = oiio.ImageSpec(1024, 1000, 3, "float")
    spec.tile_width = spec.tile_height = 64
    output = oiio.ImageOutput.create(str(glint.folder / name))
    assert output.open(str(glint.folder / name), spec) and output.write_image(pixels), output.geterror()
    output.close()
    ingest(glint, "rows.exr")
    rows = data(glint)
    ingest(glint, name, "--force", "--max-memory", "16M")
    assert numpy.array_equal(data(glint), rows)
