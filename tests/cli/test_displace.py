"""glint-displace."""

import json

import h5py
import numpy
import pytest
from conftest import run_once


@pytest.fixture
def heights(glint):
    run_once(glint, "synth weave --size 64x96 -o h.exr --height", "ingest h.exr --kind height --to heights -o h.glint")
    return "h.glint"


QUICK = ["--angular", "5", "--spatial", "2"]


def test_levels_are_written_and_valid(glint, heights):
    process = glint("displace", heights, "-o", "d.glint", "--factors", "4,16", "--json", *QUICK)
    assert process.returncode == 0, process.stderr
    levels = json.loads(process.stdout)["result"]["levels"]
    assert [(level["factor"], level["columns"], level["rows"]) for level in levels] == [(4, 16, 24), (16, 4, 6)]
    assert all(level["interreflected_share"] > 0.01 for level in levels)
    assert glint("validate", "d.glint").returncode == 0
    info = json.loads(glint("info", "d.glint", "--json").stdout)["result"]
    assert info["kind"] == "displacement"
    assert [level["factors"] for level in info["properties"]["levels"]] == [4, 16]


def test_same_bytes_for_any_number_of_threads(glint, heights):
    for threads in (1, 2):
        assert glint("displace", heights, "-o", f"{threads}.glint", "--threads", threads, "--quiet", *QUICK).returncode == 0
    assert (glint.folder / "1.glint").read_bytes() == (glint.folder / "2.glint").read_bytes()


def test_specification_is_enough_to_read_the_model(glint, heights):
    glint("displace", heights, "-o", "d.glint", "--factor", "8", "--base", "ggx:0.3", "--quiet", *QUICK)
    with h5py.File(glint.folder / "d.glint") as file:
        assert file.attrs["base"] == b"ggx"
        level = file["level_00"]
        lobes = level["lobes"][...]
        assert lobes.shape == (12, 8, 6, 4)
        # The area of the surface over its projected area, from the heights themselves.
        with h5py.File(glint.folder / "h.glint") as source:
            h = source["heights"][...].astype(float)
        right, up = numpy.roll(h, -1, 1), numpy.roll(h, -1, 0)
        both = numpy.roll(right, -1, 0)
        area = numpy.mean(
            0.5 * (numpy.hypot(1, numpy.hypot(right - h, up - h)) + numpy.hypot(1, numpy.hypot(both - up, both - right)))
        )
        assert lobes[..., 3].sum(axis=-1).mean() == pytest.approx(area, rel=1e-4)
        assert level["angular_scale"].shape == (25 * 26 // 2, 1)
        assert level["heights"][...].mean() == pytest.approx(h.mean(), abs=1e-3)


def test_shadowing_alone_is_darker_than_interreflections(glint, heights):
    scale = {}
    for bounces in ("1", "auto"):
        glint("displace", heights, "-o", f"{bounces}.glint", "--base", "diffuse:1", "--bounces", bounces, "--quiet", *QUICK)
        with h5py.File(glint.folder / f"{bounces}.glint") as file:
            scale[bounces] = file["level_00/angular_scale"][...].astype(float).mean()
    assert scale["1"] < 0.97 * scale["auto"]


def test_warns_of_distant_interreflections(glint):
    """The paper's failure (Fig. 19): relief that is deep compared with a cell."""
    glint("synth", "sawtooth", "--size", "64", "--feature-size", "32", "--slope", "3", "-o", "deep.exr", "--height")
    glint("ingest", "deep.exr", "--kind", "height", "--to", "heights", "-o", "deep.glint")
    process = glint("displace", "deep.glint", "-o", "d.glint", "--factor", "4", *QUICK)
    assert process.returncode == 0
    assert "hops farther than a cell" in process.stderr
    glint("synth", "isotropic", "--size", "64", "--alpha", "0.3", "-o", "shallow.exr", "--height")
    glint("ingest", "shallow.exr", "--kind", "height", "--to", "heights", "-o", "shallow.glint")
    assert "hops" not in glint("displace", "shallow.glint", "-o", "d.glint", "--factor", "32", *QUICK).stderr


@pytest.mark.parametrize(
    "options, code, message",
    [
        (["--factor", "65"], 3, "is larger than the map of 64 x 96"),
        (["--angular", "46"], 1, ""),
        (["--scale-tolerance", "2"], 1, ""),
        (["--factor", "1"], 1, ""),
        (["--factors", "16,4"], 1, "--factors: is not 2 or more and ascending"),
        (["--factors", "43,50"], 1, "the factors 43 and 50 have the same cells on this map"),
        (["--factor", "4", "--factors", "4,8"], 1, ""),
        (["--base", "diffuse:1.5"], 1, "gain"),
        (["--base", "diffuse:0"], 1, "absorb"),
        (["--base", "diffuse"], 1, "diffuse:RHO"),
        (["--base", "ggx:0.3:1.5"], 1, "ETA,K"),
        (["--base", "ggx:0.001"], 1, "roughness"),
        (["--base", "velvet:1"], 1, "no known reflectance"),
        (["--bounces", "0"], 1, "auto"),
        (["--bounces", "many"], 1, "auto"),
        (["--lobes", "7"], 1, ""),
        (["--base-table", "no.binary"], 2, "no.binary"),
        (["--base-table", "h.glint"], 3, "h.glint: the first 12 bytes say"),
        (["--base-table", "h.glint", "--base", "ggx:0.3"], 1, "--base"),
    ],
)
def test_wrong_use_is_refused_and_leaves_nothing(glint, heights, options, code, message):
    process = glint("displace", heights, "-o", "d.glint", *options)
    assert process.returncode == code, process.stderr
    assert message in process.stderr
    assert not (glint.folder / "d.glint").exists()


def write_image(path, pixels, kind="uint8"):
    """pixels: [height][width][channels], top row first."""
    oiio = pytest.importorskip("OpenImageIO")
    pixels = numpy.ascontiguousarray(pixels)
    height, width, channels = pixels.shape
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), oiio.ImageSpec(width, height, channels, kind))
    assert output.write_image(pixels)
    output.close()


@pytest.fixture
def two_colours(glint):
    """A sawtooth, red (sRGB) where it falls towards +u, blue where it rises."""
    run_once(
        glint,
        "synth sawtooth --size 64x32 --feature-size 16 --slope 1 -o s.exr --height",
        "ingest s.exr --kind height --to heights -o s.glint",
    )
    with h5py.File(glint.folder / "s.glint") as file:
        h = file["heights"][...]
    falls = (numpy.roll(h, -1, 1) < h)[::-1]
    rgb = numpy.where(falls[..., None], (230, 30, 30), (30, 30, 230)).astype(numpy.uint8)
    write_image(glint.folder / "colour.png", rgb)
    return "s.glint"


def test_colours_of_the_base_follow_the_normals(glint, two_colours):
    process = glint("displace", two_colours, "-o", "d.glint", "--base-color", "colour.png", "--depfile", "d.d", *QUICK)
    assert process.returncode == 0, process.stderr
    assert "colour.png" in (glint.folder / "d.d").read_text()
    assert glint("validate", "d.glint").returncode == 0
    with h5py.File(glint.folder / "d.glint") as file:
        assert (file.attrs["rgb"], file.attrs["has_lobe_colors"], file.attrs["has_lobe_alphas"]) == (1, 1, 0)
        assert file.attrs["albedo"] == 1  # the image is the albedo unless --base says more
        assert b"colour.png" in b"".join(file.attrs["inputs"])
        level = file["level_00"]
        assert level["angular_scale"].shape == (25 * 26 // 2, 3)
        lobes, colours = level["lobes"][...], level["lobe_colors"][...]
        right = (lobes[..., 3] > 0) & (lobes[..., 0] > 0.1)
        left = (lobes[..., 3] > 0) & (lobes[..., 0] < -0.1)
        linear = ((230 / 255 + 0.055) / 1.055) ** 2.4
        # A facet at the edge of a wall has some of the other colour.
        assert colours[right][:, 0] == pytest.approx(linear, abs=0.25)
        assert colours[left][:, 2] == pytest.approx(linear, abs=0.25)
        assert (colours[right][:, 0] > 2 * colours[right][:, 2]).all() and (colours[left][:, 2] > 2 * colours[left][:, 0]).all()
    info = json.loads(glint("info", "d.glint", "--json").stdout)
    assert (info["result"]["properties"]["rgb"], info["result"]["properties"]["has_lobe_colors"]) == (1, 1)

    def reflected(x):
        run = glint(
            "query", "reflectance", "d.glint", "--uv", 0.3, 0.6, "--level", 0, "--wi", x, 0, 1, "--wo", x, 0, 1, "--json"
        )
        assert run.returncode == 0, run.stderr
        return json.loads(run.stdout)["result"]["reflected"]

    right, left = reflected(1), reflected(-1)
    assert right[0] > 2 * right[2] and left[2] > 2 * left[0]


def test_grey_images_keep_one_channel_and_linear_ones_their_values(glint, heights):
    for value, space, wanted in ((128, "auto", 0.2158605), (128, "linear", 128 / 255)):
        write_image(glint.folder / "grey.png", numpy.full((96, 64, 3), value, numpy.uint8))
        process = glint(
            "displace",
            heights,
            "-o",
            "d.glint",
            "--base-color",
            "grey.png",
            "--color-space",
            space,
            "--base",
            "diffuse:0.5",
            *QUICK,
        )
        assert process.returncode == 0, process.stderr
        with h5py.File(glint.folder / "d.glint") as file:
            assert file.attrs["rgb"] == 0 and file.attrs["albedo"] == 0.5
            assert file["level_00/lobe_colors"][...].max() == pytest.approx(wanted, rel=1e-4)
    write_image(glint.folder / "grey.exr", numpy.full((96, 64, 1), 0.25, numpy.float32), "float")
    assert glint("displace", heights, "-o", "d.glint", "--base-color", "grey.exr", *QUICK).returncode == 0
    with h5py.File(glint.folder / "d.glint") as file:
        assert file["level_00/lobe_colors"][...].max() == pytest.approx(0.25, rel=1e-4)


def test_roughness_of_the_base_is_that_of_the_image(glint, heights):
    roughness = numpy.full((96, 64, 1), 0.25, numpy.float32)
    roughness[:48] = 0.75
    write_image(glint.folder / "r.exr", roughness, "float")
    process = glint(
        "displace", heights, "-o", "d.glint", "--factor", "8", "--base", "ggx:0.8", "--base-roughness", "r.exr", *QUICK
    )
    assert process.returncode == 0, process.stderr
    assert glint("validate", "d.glint").returncode == 0
    with h5py.File(glint.folder / "d.glint") as file:
        alphas, lobes = file["level_00/lobe_alphas"][...], file["level_00/lobes"][...]
        used = lobes[..., 3] > 0
        assert alphas[1][used[1]] == pytest.approx(0.2, rel=1e-3)  # bottom row first
        assert alphas[-2][used[-2]] == pytest.approx(0.6, rel=1e-3)


@pytest.mark.parametrize(
    "shape, value, options, message",
    [
        ((64, 64, 3), 0.5, [], "64 x 64 pixels, the map 64 x 96"),
        ((96, 64, 3), 1.5, [], "not in 0..1"),
        ((96, 64, 3), -0.1, [], "not in 0..1"),
        ((96, 64, 3), float("nan"), [], "not in 0..1"),
        ((96, 64, 3), 0.0, [], "all black"),
    ],
)
def test_colours_that_no_surface_has_are_refused(glint, heights, shape, value, options, message):
    pixels = numpy.full(shape, 0.0 if value == 0 else 0.5, numpy.float32)
    pixels[2, 7, 1] = value
    write_image(glint.folder / "c.exr", pixels, "float")
    process = glint("displace", heights, "-o", "d.glint", "--base-color", "c.exr", *options)
    assert process.returncode == 3, process.stderr
    assert message in process.stderr
    if "0..1" in message:
        assert "column 7, row 2 from the top" in process.stderr and "c.exr" in process.stderr
    assert not (glint.folder / "d.glint").exists()


def test_roughness_needs_a_glossy_base_and_enough_of_it(glint, heights):
    write_image(glint.folder / "r.exr", numpy.full((96, 64, 1), 0.1, numpy.float32), "float")
    process = glint("displace", heights, "-o", "d.glint", "--base-roughness", "r.exr")
    assert process.returncode == 1 and "ggx" in process.stderr
    process = glint("displace", heights, "-o", "d.glint", "--base-roughness", "r.exr", "--base", "ggx:0.3")
    assert process.returncode == 3 and "0.05 to 1" in process.stderr
    assert glint("displace", heights, "-o", "d.glint", "--base-color", "missing.exr").returncode == 2


@pytest.fixture
def displaced(glint, heights):
    run_once(glint, f"displace {heights} -o d.glint --factors 4,16 --base ggx:0.4 --quiet {' '.join(QUICK)}")
    return "d.glint"


def reflected(glint, *arguments):
    process = glint("query", "reflectance", "d.glint", *arguments, "--json")
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)["result"]


POINT = ["--uv", 0.3, 0.7]
LIGHT = ["--wi", 0.3, 0.1, 1, "--wo", -0.4, 0, 1]


def test_query_reflects_light(glint, displaced):
    process = glint("query", "reflectance", displaced, *POINT, "--level", 0, *LIGHT)
    assert process.returncode == 0, process.stderr
    values = {
        variant: reflected(glint, *POINT, "--level", 0, *LIGHT, "--variant", variant)["reflected"][0]
        for variant in ("full", "lobes", "single")
    }
    assert float(process.stdout) == pytest.approx(values["full"], rel=1e-6)
    assert len(set(values.values())) == 3 and min(values.values()) > 0
    # Directions of any length are the same.
    assert reflected(glint, *POINT, "--level", 0, "--wi", 0.6, 0.2, 2, "--wo", -4, 0, 10)["reflected"][0] == pytest.approx(
        values["full"], rel=1e-5
    )
    assert "ns per query" in glint("query", "reflectance", displaced, *POINT, "--level", 0, *LIGHT, "--repeat", 300).stdout


def test_query_blends_levels_by_the_footprint(glint, displaced):
    fine, coarse = (reflected(glint, *POINT, "--level", level, *LIGHT)["reflected"][0] for level in (0, 1))
    middle = reflected(glint, *POINT, "--sigma", 8 / 12**0.5, *LIGHT)  # as wide as a cell of 8 texels, between 4 and 16
    assert middle["levels"] == [0, 1] and middle["level_weight"] == pytest.approx(0.5, abs=1e-5)
    assert middle["reflected"][0] == pytest.approx((fine + coarse) / 2, rel=1e-5)


def test_query_tables_and_samples_of_a_displacement(glint, displaced):
    (glint.folder / "q.csv").write_text(
        "u,v,level,wix,wiy,wiz,wox,woy,woz,name\n0.3,0.7,0,0.3,0.1,1,-0.4,0,1,a\n0.3,0.7,1,0.3,0.1,1,-0.4,0,1,b\n"
    )
    process = glint("query", "reflectance", displaced, "--csv", "q.csv", "-o", "-")
    assert process.returncode == 0, process.stderr
    rows = process.stdout.splitlines()
    assert rows[0].endswith("name,reflected")
    for level in (0, 1):
        assert float(rows[1 + level].split(",")[-1]) == pytest.approx(
            reflected(glint, *POINT, "--level", level, *LIGHT)["reflected"][0], rel=1e-6
        )
    for footprint in (["--level", 0], ["--sigma", 2]):  # one level, and between two
        process = glint("query", "reflectance", displaced, *POINT, *footprint, "--wo", -0.4, 0, 1, "--samples", 50, "-o", "-")
        table = numpy.array([[float(field) for field in row.split(",")] for row in process.stdout.splitlines()[1:]])
        drawn = table[table[:, 3] > 0]
        assert len(drawn) > 30
        assert numpy.linalg.norm(drawn[:, :3], axis=1) == pytest.approx(1, abs=1e-4)
        first = reflected(glint, *POINT, *footprint, "--wi", *drawn[0, :3], "--wo", -0.4, 0, 1)
        assert first["pdf"] == pytest.approx(drawn[0, 3], rel=1e-3)
    told = glint("query", "reflectance", displaced, "--csv", "q.csv", "-o", "a.csv", "--json")
    assert json.loads(told.stdout)["result"] == {"queries": 2}
    told = glint(
        "query", "reflectance", displaced, *POINT, "--level", 0, "--wo", 0, 0, 1, "--samples", 7, "-o", "s.csv", "--json"
    )
    assert json.loads(told.stdout)["result"] == {"samples": 7}


def test_query_normals_of_a_displacement_integrate_to_one(glint, displaced):
    n = 24
    centres = (numpy.arange(n) + 0.5) * 2 / n - 1
    grid = [(x, y) for x in centres for y in centres]
    (glint.folder / "h.csv").write_text("u,v,level,hx,hy\n" + "".join(f"0.3,0.7,1,{x},{y}\n" for x, y in grid))
    process = glint("query", "reflectance", displaced, "--csv", "h.csv", "-o", "-")
    assert process.returncode == 0, process.stderr
    densities = [float(row.split(",")[-1]) for row in process.stdout.splitlines()[1:]]
    assert sum(densities) * (2 / n) ** 2 == pytest.approx(1, abs=0.05)  # 24 x 24 points of broad lobes
    assert (
        glint("query", "reflectance", displaced, *POINT, "--level", 1, "--half", *grid[40]).stdout.strip()
        == f"{densities[40]:.9g}"
    )
    assert (
        glint("query", "reflectance", displaced, *POINT, "--level", 1, "--image", "lobes.png", "--image-size", 64).returncode
        == 0
    )
    assert (glint.folder / "lobes.png").stat().st_size > 500


@pytest.mark.parametrize(
    "arguments, message",
    [
        ([*POINT, *LIGHT], "--sigma S or --level L"),
        ([*POINT, "--box", 1, 0, 0, 1, *LIGHT], "unknown option --box"),
        ([*POINT, "--level", 0, "--sigma", 3, *LIGHT], "excludes"),
        ([*POINT, "--level", 2, *LIGHT], "no level 2"),
        ([*POINT, "--level", 0, "--wi", 0, 0, 1], "--wi requires --wo"),
        ([*POINT, "--level", 0, "--samples", 3, "-o", "s.csv"], "--samples requires --wo"),
        ([*POINT, "--level", 0, "--wi", 0, 0, 0, "--wo", 0, 0, 1], "no direction"),
        ([*POINT, "--level", 0], "nothing was asked"),
        ([*POINT, "--level", 0, "--range", 0, 0, 0.1, 0.1], "glint-query ASSET --uv U V"),
        ([*POINT, "--level", 0, "--light", "l.glint"], "glint-query light ASSET"),
        ([*POINT, "--level", 0, "--half", 0, 0, *LIGHT], "excludes"),
        (["--level", 0, *LIGHT], "--uv"),
        (["--csv", "q.csv", "-o", "a.csv", *POINT], "excludes"),
    ],
)
def test_questions_that_a_displacement_cannot_answer(glint, displaced, arguments, message):
    process = glint("query", "reflectance", displaced, *arguments)
    assert process.returncode == 1, process.stderr
    assert message in process.stderr


def test_light_is_not_asked_of_distributions(glint):
    glint("synth", "flakes", "--size", "32", "-o", "n.png")
    glint("ingest", "n.png", "-o", "n.glint")
    process = glint("query", "reflectance", "n.glint", *POINT, "--sigma", 3, *LIGHT)
    assert process.returncode == 5
    assert "kind normals" in process.stderr and "glint-displace" in process.stderr and "glint-query light" in process.stderr


@pytest.mark.parametrize(
    "arguments, code",
    [
        (["--level", 0, *LIGHT], 1),
        (["--sigma", 3, *LIGHT], 1),
        (["--level", 0, "--half", 0, 0], 1),
        (["--sigma", 3, "--half", 0, 0], 5),
        (["--sigma", 3, "--image", "a.png"], 5),
    ],
)
def test_questions_without_the_command_are_shown_how_to_ask(glint, displaced, arguments, code):
    process = glint("query", displaced, *POINT, *arguments)
    assert process.returncode == code
    assert "glint-query reflectance" in process.stderr and "--wi X Y Z --wo X Y Z" in process.stderr


def test_factors_need_not_divide_the_map(glint, heights):
    process = glint("displace", heights, "-o", "d.glint", "--factors", "10,50", "--json", *QUICK)
    assert process.returncode == 0, process.stderr
    levels = json.loads(process.stdout)["result"]["levels"]
    assert [(level["columns"], level["rows"]) for level in levels] == [(6, 10), (1, 2)]
    assert glint("validate", "d.glint").returncode == 0


def test_terms_are_added_to_a_tolerance_and_singular_values_told(glint):
    """Fig. 6 and 10: relief in one half of the map, which no single product T S can follow."""
    glint("synth", "sawtooth", "--size", "64", "--feature-size", "8", "--slope", "1.5", "-o", "saw.exr", "--height")
    glint("synth", "isotropic", "--size", "64", "--alpha", "0.2", "-o", "noise.exr", "--height")
    halves = []
    for name in ("saw", "noise"):
        glint("ingest", f"{name}.exr", "--kind", "height", "--to", "heights", "-o", f"{name}.glint")
        with h5py.File(glint.folder / f"{name}.glint") as file:
            halves.append(file["heights"][...][:, :32, None])
    write_image(glint.folder / "both.exr", numpy.hstack(halves), "float")
    glint("ingest", "both.exr", "--kind", "height", "--to", "heights", "-o", "both.glint")
    quick = ["--factor", "8", "--angular", "7", "--spatial", "2", "--bounces", "1", "--json"]
    one = json.loads(glint("displace", "both.glint", "-o", "one.glint", *quick).stdout)["result"]["levels"][0]
    more = json.loads(glint("displace", "both.glint", "-o", "more.glint", "--scale-tolerance", "0.01", *quick).stdout)[
        "result"
    ]["levels"][0]
    assert one["scale_terms"] == 1 and more["scale_terms"] > 1
    assert more["scale_residual"] <= 0.01 < one["scale_residual"] == one["rank1_residual"]
    assert one["singular_shares"][0] == one["rank1_energy"] and one["singular_shares"] == sorted(
        one["singular_shares"], reverse=True
    )
    assert more["scale_bytes"] == more["scale_terms"] * one["scale_bytes"]
    info = json.loads(glint("info", "more.glint", "--json").stdout)
    assert info["result"]["statistics"]["levels"][0]["singular_shares"] == more["singular_shares"]


def test_slopes_beyond_80_degrees_are_refused(glint):
    glint("synth", "isotropic", "--size", "32", "--alpha", "1", "-o", "h.exr", "--height")
    glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "--height-scale", "50", "-o", "h.glint")
    process = glint("displace", "h.glint", "-o", "d.glint", "--factor", "8")
    assert process.returncode == 3
    assert "steeper than 80 degrees" in process.stderr


def test_flat_maps_are_left_alone(glint):
    glint("synth", "flat", "--size", "32", "-o", "h.exr", "--height")
    assert glint("ingest", "h.exr", "--kind", "height", "--to", "heights", "-o", "h.glint", "--allow-constant").returncode == 0
    assert glint("displace", "h.glint", "-o", "d.glint", "--factor", "8", *QUICK).returncode == 0
    with h5py.File(glint.folder / "d.glint") as file:
        assert numpy.allclose(file["level_00/angular_scale"][...], 1, atol=2e-3)
        assert numpy.allclose(file["level_00/spatial_scale"][...], 1, atol=1e-4)


def write_merl(path, brdf, bins=(12, 16, 20)):
    """A table in MERL's form: brdf(theta_half, theta_diff, phi_diff) of each channel at the middles of bins, 1/sr."""
    half, difference, azimuth = (numpy.arange(n) + 0.5 for n in bins)
    angles = numpy.meshgrid(
        numpy.pi / 2 * (half / bins[0]) ** 2, numpy.pi / 2 * difference / bins[1], numpy.pi * azimuth / bins[2], indexing="ij"
    )
    planes = [numpy.broadcast_to(f, bins) / scale for f, scale in zip(brdf(*angles), [1 / 1500, 1.15 / 1500, 1.66 / 1500])]
    path.write_bytes(numpy.array(bins, "<i4").tobytes() + numpy.array(planes, "<f8").tobytes())


def test_a_table_of_a_lambert_is_a_lambert(glint, heights):
    write_merl(glint.folder / "grey.binary", lambda *_: 3 * [0.6 / numpy.pi])
    process = glint("displace", heights, "-o", "t.glint", "--factor", "8", "--base-table", "grey.binary", *QUICK)
    assert process.returncode == 0 and "grey.binary" not in process.stderr, process.stderr
    assert glint("validate", "t.glint").returncode == 0
    glint("displace", heights, "-o", "d.glint", "--factor", "8", "--base", "diffuse:0.6", *QUICK)
    with h5py.File(glint.folder / "t.glint") as table, h5py.File(glint.folder / "d.glint") as diffuse:
        assert table.attrs["base"] == b"table"
        assert b"grey.binary" in b"".join(table.attrs["inputs"])
        assert table["base_table"].shape == (14, 32, 48, 48, 1)
        # Table 13 is f, at every node.
        assert table["base_table"][13] == pytest.approx(0.6 / numpy.pi, rel=1e-5)
        # The means over lobes of a Lambert come from a formula, those of a table from its nodes.
        means = [file["level_00/angular_scale"][...].astype(float).mean() for file in (table, diffuse)]
        assert means[0] == pytest.approx(means[1], rel=0.03)


@pytest.mark.parametrize(
    "change, message",
    [
        (lambda b: b"", "0 bytes are too few for a table"),
        (lambda b: b[:-1], "bytes are too few for 12 x 16 x 20 bins, which take 92172"),
        (lambda b: b + b"\0", "bytes are too many for 12 x 16 x 20 bins"),
        (lambda b: b"\x89PNG\r\n\x1a\n" + b[8:], "the first 12 bytes say"),
        (lambda b: b[:12] + numpy.float64("nan").tobytes() + b[20:], "bin red, theta_half 0, theta_diff 0, phi_diff 0"),
        (lambda b: b[:12] + 1000 * numpy.float64("inf").tobytes() + b[8012:], "1000 values are not finite"),
    ],
)
def test_files_that_are_no_table_are_refused(glint, heights, change, message):
    write_merl(glint.folder / "a.binary", lambda *_: [0.2, 0.2, 0.2])
    (glint.folder / "a.binary").write_bytes(change((glint.folder / "a.binary").read_bytes()))
    process = glint("displace", heights, "-o", "t.glint", "--base-table", "a.binary")
    assert process.returncode == 3
    assert "a.binary: " in process.stderr and len(process.stderr.splitlines()) == 1
    assert message in process.stderr
    assert not (glint.folder / "t.glint").exists()


def test_bins_without_a_measurement_are_counted(glint, heights):
    write_merl(glint.folder / "a.binary", lambda half, *_: 3 * [numpy.where(half > 1.3, -1, 0.2)])
    process = glint("displace", heights, "-o", "t.glint", "--factor", "8", "--base-table", "a.binary", *QUICK)
    assert process.returncode == 0
    assert "a.binary: 960 of 11520 values are negative" in process.stderr
