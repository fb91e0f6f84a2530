"""glint-shlobes and glint-query light, as a pipeline runs them."""

import json
import math

import h5py
import numpy as np
import pytest

oiio = pytest.importorskip("OpenImageIO")

HEIGHT = 16


def write_exr(path, pixels):
    height, width, channels = pixels.shape
    image = oiio.ImageOutput.create(str(path))
    assert image.open(str(path), oiio.ImageSpec(width, height, channels, "float"))
    image.write_image(np.ascontiguousarray(pixels, dtype=np.float32))
    image.close()


def constant(value, height=HEIGHT, width=None):
    return np.full((height, width or 2 * height, 3), value, dtype=np.float32)


@pytest.fixture
def folder(glint):
    return glint.folder


def test_lobes_and_light_are_valid_assets(glint, folder):
    write_exr(folder / "env.exr", constant(1))
    assert glint("shlobes", "-o", "lobes.glint", "--sigma-r", 0.1, "--order", 12).returncode == 0
    process = glint("shlobes", "--light", "env.exr", "-o", "light.glint", "--order", 12, "--grid", "5x8", "--json")
    assert process.returncode == 0, process.stderr
    result = json.loads(process.stdout)["result"]
    assert (result["kind"], result["order"], result["grid_rows"], result["grid_columns"]) == ("sh-light", 12, 5, 8)
    assert result["table_bytes"] == 5 * 8 * 3 * 13 * 13 * 2
    assert glint("validate", "lobes.glint", "light.glint").returncode == 0
    info = json.loads(glint("info", "lobes.glint", "--json").stdout)["result"]
    assert info["properties"]["order"] == 12


def test_same_bytes_with_any_number_of_threads(glint, folder):
    write_exr(folder / "env.exr", np.random.default_rng(1).uniform(0, 3, (HEIGHT, 2 * HEIGHT, 3)))
    for threads in (1, 2):
        for name, arguments in {"light": ["--light", "env.exr", "--grid", "5x8"], "lobes": ["--sigma-r", 0.05]}.items():
            assert (
                glint("shlobes", *arguments, "--order", 10, "--threads", threads, "-o", f"{name}{threads}.glint").returncode
                == 0
            )
    for name in ("light", "lobes"):
        assert (folder / f"{name}1.glint").read_bytes() == (folder / f"{name}2.glint").read_bytes()


def test_gaussians_are_fitted_to_the_light(glint, folder):
    """Deng 2022, section 5.4: three lobes come back from the image of their light."""
    rows, columns = np.meshgrid(np.arange(64), np.arange(128), indexing="ij")
    theta, phi = math.pi * (rows + 0.5) / 64, 2 * math.pi * (columns + 0.5) / 128  # top row first
    w = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1)
    lobes = [((0.6, 0, 0.8), 40, (5, 4, 3)), ((0, -0.8, 0.6), 15, (1, 2, 6))]
    write_exr(folder / "env.exr", sum(np.exp(s * (w @ np.array(a) - 1))[..., None] * np.array(c) for a, s, c in lobes))
    arguments = ["--light", "env.exr", "--order", 4, "--grid", "5x8", "--gaussians", 2, "--json"]
    process = glint("shlobes", *arguments, "-o", "light.glint")
    assert process.returncode == 0, process.stderr
    fit = json.loads(process.stdout)["result"]["gaussians"]
    assert fit["error"] < 0.03
    for axis, sharpness, amplitude in lobes:
        found = max(fit["lobes"], key=lambda lobe: np.dot(lobe["axis"], axis))
        assert np.dot(found["axis"], axis) > 0.9995
        assert found["sharpness"] == pytest.approx(sharpness, rel=0.06)
        assert found["amplitude"] == pytest.approx(amplitude, rel=0.06)
    assert "add --light" in glint("shlobes", "--sigma-r", 0.1, "--gaussians", 2, "-o", "l.glint").stderr


def ask(glint, *arguments):
    process = glint("query", "light", *arguments, "--json")
    assert process.returncode == 0, process.stderr
    return json.loads(process.stdout)["result"]


def test_bands_that_the_normals_do_not_have_are_left_out(glint, folder):
    """Gamboa 2018, section 4.2: a broad, even distribution of normals has few bands, a single facet all of its lobe's."""
    write_exr(folder / "env.exr", np.random.default_rng(1).uniform(0, 3, (HEIGHT, 2 * HEIGHT, 3)))
    glint("shlobes", "--light", "env.exr", "-o", "light.glint", "--order", 40, "--grid", "5x8")
    glint("synth", "isotropic", "--size", 64, "--alpha", 0.4, "-o", "n.exr")
    glint("ingest", "n.exr", "-o", "n.glint")
    asked = ["n.glint", "--light", "light.glint", "--sigma-r", 0.1, "--wo", 0.2, 0.1, 1, "--uv", 0.4, 0.6]
    whole, few = (ask(glint, *asked, "--sigma", 12, *more) for more in ([], ["--ndf-epsilon", 1e-2]))
    assert whole["order"] == 40 and few["order"] < 30
    assert few["radiance"] == pytest.approx(whole["radiance"], rel=0.02)
    assert ask(glint, *asked, "--sigma", 0.3, "--ndf-epsilon", 1e-6)["order"] == 40


def test_flat_mirror_under_constant_light_reflects_it(glint, folder):
    """A flat map with F = G = 1 reflects constant light L as L cos / cos: the half vectors' 4 (wo . h) over 4 cos(wo)."""
    write_exr(folder / "env.exr", constant(2))
    assert glint("synth", "flat", "-o", "flat.png", "--size", 16).returncode == 0
    assert glint("ingest", "flat.png", "-o", "flat.glint", "--allow-constant").returncode == 0
    assert glint("shlobes", "--light", "env.exr", "-o", "light.glint", "--order", 20).returncode == 0
    for tilt in (0.0, 0.5, 0.9):
        wo = [math.sin(tilt), 0, math.cos(tilt)]
        arguments = ["flat.glint", "--uv", 0.5, 0.5, "--sigma", 2, "--sigma-r", 0.05, "--light", "light.glint", "--wo", *wo]
        result = ask(glint, *arguments)
        # The lobe's blur of half a degree squared, and the ringing of the cut at the horizon, far away.
        assert result["radiance"] == pytest.approx([2, 2, 2], rel=0.02)
        assert result["light_integral"][0] == pytest.approx(8 * math.cos(tilt), rel=0.02)
        assert not result["clamped"]
        half = ask(glint, *arguments, "--fresnel", 1, 0.5, 0, "--shadowing", 0.5)
        assert half["radiance"] == pytest.approx([1, 0.5, 0], rel=0.02)


def bins_of(normals, rings=9, sectors=32):
    ring = np.floor(np.arcsin(np.hypot(normals[..., 0], normals[..., 1])) / (np.pi / 2) * rings).astype(int)
    sector = np.floor(np.arctan2(normals[..., 1], normals[..., 0]) % (2 * np.pi) / (2 * np.pi) * sectors).astype(int)
    return ring * sectors + np.minimum(sector, sectors - 1)


def light_by_quadrature(facets, weights, sigma, wo, light, steps=64):
    """Integral of L(wi) D(h) dwi: directions around every facet, weighted by its lobe.

    light: [height][width][3], image rows from the top.
    """
    theta = (np.arange(steps) + 0.5) / steps * 6 * sigma
    phi = (np.arange(2 * steps) + 0.5) / steps * np.pi
    sine, lobe = np.sin(theta), np.exp(-0.5 * (np.sin(theta) / sigma) ** 2) / (2 * np.pi * sigma**2)
    total = np.zeros(3)
    for (x, y), weight in zip(facets, weights):
        m = np.array([x, y, math.sqrt(1 - x * x - y * y)])
        u = np.cross(m, [0, 1, 0])
        u /= np.linalg.norm(u)
        h = np.cos(theta)[:, None, None] * m + sine[:, None, None] * (
            np.cos(phi)[:, None] * u + np.sin(phi)[:, None] * np.cross(m, u)
        )
        ho = h @ wo
        wi = 2 * ho[..., None] * h - wo
        above = (ho > 0) & (wi[..., 2] > 0)
        rows = np.clip((np.arccos(np.clip(wi[..., 2], -1, 1)) / np.pi * light.shape[0]).astype(int), 0, light.shape[0] - 1)
        columns = (np.arctan2(wi[..., 1], wi[..., 0]) % (2 * np.pi) / (2 * np.pi) * light.shape[1]).astype(int) % light.shape[1]
        share = weight / m[2] * above * 4 * ho * (lobe * sine)[:, None] * (6 * sigma / steps) * (np.pi / steps)
        total += (share[..., None] * light[rows, columns]).sum(axis=(0, 1))
    return total


def test_histograms_reflect_what_a_quadrature_over_their_normals_does(glint, folder):
    """The whole chain on an asset of kind histogram-sat, against numpy: counts of the texels' bins, mean normals, and the lobes
    around them."""
    sigma, wo = 0.08, np.array([0.3, -0.2, 0.9])
    wo /= np.linalg.norm(wo)
    random = np.random.default_rng(5)
    env = random.uniform(0.2, 1, (32, 64, 3)) + 20 * (random.uniform(size=(32, 64, 1)) > 0.97)
    write_exr(folder / "env.exr", env)
    for command in (
        ["synth", "isotropic", "--size", 64, "--alpha", 0.3, "-o", "map.exr"],
        ["ingest", "map.exr", "-o", "n.glint"],
        ["sat", "n.glint", "-o", "s.glint", "--stride", 4],
        ["shlobes", "--light", "env.exr", "-o", "light.glint", "--order", 50, "--grid", "17x32"],
    ):
        assert glint(*command).returncode == 0
    with h5py.File(folder / "n.glint") as file:
        normals = file["normals"][...].astype(float)
    ids = bins_of(normals)
    # Texels 10 to 40 along u, 7 to 29 along v.
    counts = np.bincount(ids[7:29, 10:40].ravel(), minlength=288)
    seen = np.flatnonzero(counts)
    means = [normals[ids == b].mean(axis=0) for b in seen]
    expected = light_by_quadrature(means, counts[seen] / counts.sum(), sigma, wo, env)
    arguments = [
        "s.glint",
        "--uv",
        25 / 64,
        18 / 64,
        "--box",
        15,
        0,
        0,
        11,
        "--sigma-r",
        sigma,
        "--light",
        "light.glint",
        "--wo",
        *wo,
    ]
    result = ask(glint, *arguments)
    # Order 50 of lobes of 4.6 degrees, and the blend between outgoing directions.
    assert result["light_integral"] == pytest.approx(expected, rel=0.03)
    assert result["light_integral"][0] != pytest.approx(env[..., 0].mean() * 4 * wo[2], rel=0.03)
    lobes = ["shlobes", "--sigma-r", sigma, "--order", 50, "--grid", "none", "-o", "lobes.glint"]
    assert glint(*lobes).returncode == 0
    assert ask(glint, *arguments[:9], *arguments[11:], "--lobes", "lobes.glint")["light_integral"] == pytest.approx(
        result["light_integral"], rel=1e-5
    )


def test_optics_of_the_surface(glint, folder):
    """--ior, --eta with --k, and --smith are Fresnel and G of the mirror direction; 4 % at normal incidence for 1.5."""
    write_exr(folder / "env.exr", constant(1))
    for command in (
        ["synth", "isotropic", "--size", 32, "--alpha", 0.4, "-o", "map.exr"],
        ["ingest", "map.exr", "-o", "n.glint"],
        ["sat", "n.glint", "-o", "s.glint"],
        ["shlobes", "--light", "env.exr", "-o", "light.glint", "--order", 10, "--grid", "5x8"],
    ):
        assert glint(*command).returncode == 0
    common = ["--uv", 0.5, 0.5, "--box", 16, 0, 0, 16, "--sigma-r", 0.1, "--light", "light.glint"]
    up, slanted = ["--wo", 0, 0, 1], ["--wo", 0.8, 0, 0.6]
    assert ask(glint, "s.glint", *common, *up, "--ior", 1.5)["transfer"] == pytest.approx([0.04 / 4] * 3, rel=1e-5)
    metal = ask(glint, "s.glint", *common, *up, "--eta", 0.2, 0.4, 1.4, "--k", 3, 2, 1)["transfer"]
    assert metal == pytest.approx(
        [((n - 1) ** 2 + k**2) / ((n + 1) ** 2 + k**2) / 4 for n, k in ((0.2, 3), (0.4, 2), (1.4, 1))], rel=1e-5
    )
    smith = ask(glint, "s.glint", *common, *slanted, "--smith")["transfer"]
    assert 0.5 / (4 * 0.6) < smith[0] < 0.999 / (4 * 0.6)
    # The map's slopes are the same, stored or taken from the texels.
    assert ask(glint, "n.glint", *common, *slanted, "--smith")["transfer"] == pytest.approx(smith, rel=1e-5)
    assert glint("query", "light", "s.glint", *common, *up, "--eta", 1, 1, 1).returncode == 1
    assert glint("query", "light", "s.glint", *common, *up, "--ior", 1.5, "--fresnel", 1, 1, 1).returncode == 1
    assert glint("query", "light", "s.glint", *common, *up, "--smith", "--shadowing", 0.5).returncode == 1


def test_light_comes_from_where_the_image_says(glint, folder):
    """Bright towards +x (first column), seen by a facet that mirrors it from -x."""
    pixels = constant(0)
    pixels[HEIGHT // 4 : HEIGHT // 2, 0, :] = pixels[HEIGHT // 4 : HEIGHT // 2, -1, :] = (
        100  # image rows from the top: upper half
    )
    write_exr(folder / "env.exr", pixels)
    glint("synth", "flat", "-o", "flat.png", "--size", 16)
    glint("ingest", "flat.png", "-o", "flat.glint", "--allow-constant")
    assert glint("shlobes", "--light", "env.exr", "-o", "light.glint", "--order", 30, "--grid", "17x32").returncode == 0
    values = [
        ask(glint, "flat.glint", "--uv", 0.5, 0.5, "--sigma", 2, "--sigma-r", 0.1, "--light", "light.glint", "--wo", x, y, 0.5)[
            "radiance"
        ][0]
        for x, y in ((-0.8, 0), (0.8, 0), (0, 0.8), (0, -0.8))
    ]
    assert values[0] > 5
    assert max(values[1:]) < 0.05 * values[0]


def test_clamped_light_says_so(glint, folder):
    pixels = constant(0, 64)
    pixels[2, 5, :] = 1e5
    write_exr(folder / "env.exr", pixels)
    glint("synth", "flat", "-o", "flat.png", "--size", 16)
    glint("ingest", "flat.png", "-o", "flat.glint", "--allow-constant")
    glint("shlobes", "--light", "env.exr", "-o", "light.glint", "--order", 20, "--grid", "9x16")
    clamped = 0
    for tilt in np.linspace(0.2, 1.2, 8):
        process = glint(
            "query",
            "light",
            "flat.glint",
            "--uv",
            0.5,
            0.5,
            "--sigma",
            2,
            "--light",
            "light.glint",
            "--wo",
            math.sin(tilt),
            0,
            math.cos(tilt),
            "--json",
        )
        document = json.loads(process.stdout)
        result = document["result"]
        assert result["clamped"] == ("clamped" in process.stderr)
        assert min(result["light_integral"]) >= 0
        assert (
            result["clamped"] == (min(result["signed_light_integral"]) < 0) == any("clamped" in w for w in document["warnings"])
        )
        clamped += result["clamped"]
    assert clamped > 0


def test_area_lights(glint, folder):
    write_exr(folder / "checks.exr", np.ones((2, 2, 3)))
    lights = {
        "lights": [
            {
                "type": "rectangle",
                "centre": [0, 0, 2],
                "axis_u": [1, 0, 0],
                "axis_v": [0, -1, 0],
                "radiance": [4, 4, 4],
                "texture": "checks.exr",
            },
            {"type": "sphere", "centre": [3, 0, 1], "radius": 0.5, "radiance": [9, 0, 0]},
        ]
    }
    (folder / "lights.json").write_text(json.dumps(lights))
    process = glint(
        "shlobes", "--light", "lights.json", "-o", "light.glint", "--order", 20, "--grid", "9x16", "--depfile", "light.d"
    )
    assert process.returncode == 0, process.stderr
    assert "checks.exr" in (folder / "light.d").read_text()
    glint("synth", "flat", "-o", "flat.png", "--size", 16)
    glint("ingest", "flat.png", "-o", "flat.glint", "--allow-constant")
    up = ask(glint, "flat.glint", "--uv", 0.5, 0.5, "--sigma", 2, "--sigma-r", 0.05, "--light", "light.glint", "--wo", 0, 0, 1)
    assert up["radiance"] == pytest.approx([4, 4, 4], rel=0.1)


BAD_LIGHTS = {
    "not JSON": "{",
    "no list": "{}",
    "unknown type": '{"lights": [{"type": "disk"}]}',
    "unknown member": '{"lights": [{"type": "sphere", "centre": [0,0,2], "radius": 1, "radiance": [1,1,1], "colour": 1}]}',
    "missing member": '{"lights": [{"type": "sphere", "centre": [0,0,2], "radiance": [1,1,1]}]}',
    "around the point": '{"lights": [{"type": "sphere", "centre": [0,0,1], "radius": 2, "radiance": [1,1,1]}]}',
    "negative": '{"lights": [{"type": "sphere", "centre": [0,0,2], "radius": 1, "radiance": [1,-1,1]}]}',
    "no area": '{"lights": [{"type": "rectangle", "centre": [0,0,2], "axis_u": [1,0,0], "axis_v": [2,0,0], "radiance": [1,1,1]}]}',
    "wrong vector": '{"lights": [{"type": "sphere", "centre": [0,0], "radius": 1, "radiance": [1,1,1]}]}',
}


def radiance_of(glint, light):
    """Of a flat mirror that looks up."""
    if not (glint.folder / "flat.glint").exists():
        glint("synth", "flat", "-o", "flat.png", "--size", 16)
        glint("ingest", "flat.png", "-o", "flat.glint", "--allow-constant")
    footprint = ["--uv", 0.5, 0.5, "--sigma", 2, "--sigma-r", 0.05]
    return ask(glint, "flat.glint", *footprint, "--light", light, "--wo", 0, 0, 1)["radiance"]


def test_the_lights_of_the_help_text_shine(glint, folder):
    text = glint("shlobes", "--help").stdout
    begin = text.index('{"lights"')
    example, _ = json.JSONDecoder().raw_decode(text[begin:])
    for light in example["lights"]:
        light.pop("texture", None)
    turned = {"lights": [dict(example["lights"][0], axis_v=[-v for v in example["lights"][0]["axis_v"]])]}
    above = {"lights": [dict(example["lights"][0], centre=[0, 0, 3])]}
    for name, lights in {"example": example, "turned": turned, "above": above}.items():
        (folder / f"{name}.json").write_text(json.dumps(lights))
        process = glint("shlobes", "--light", f"{name}.json", "-o", f"{name}.glint", "--order", 12, "--grid", "5x8")
        assert process.returncode == 0
        if name == "turned":
            assert "light 0 faces away" in process.stderr and "axis_u x axis_v" in process.stderr
            assert "no light comes from above" in process.stderr
        else:
            assert process.stderr == ""
    assert radiance_of(glint, "turned.glint") == [0, 0, 0]
    assert min(radiance_of(glint, "above.glint")) > 1


def test_a_black_environment_is_warned_of(glint, folder):
    below = constant(1)
    below[: HEIGHT // 2] = 0  # image rows are from the top
    write_exr(folder / "below.exr", below)
    process = glint("shlobes", "--light", "below.exr", "-o", "below.glint", "--order", 8, "--grid", "5x8")
    assert process.returncode == 0 and "no light comes from above" in process.stderr


@pytest.mark.parametrize(
    ("text", "words"), [('{"lights": [{"radius": 1e400}]}', "1e400"), ('{"lights": [{"radius": NaN}]}', "line 1, column 24")]
)
def test_files_of_lights_that_are_no_json_say_where(glint, folder, text, words):
    (folder / "bad.json").write_text(text)
    process = glint("shlobes", "--light", "bad.json", "-o", "x.glint")
    assert process.returncode == 3
    assert "is no JSON" in process.stderr and words in process.stderr and "finite numbers only" in process.stderr


@pytest.mark.parametrize("name", BAD_LIGHTS)
def test_bad_area_lights_are_refused(glint, folder, name):
    (folder / "bad.json").write_text(BAD_LIGHTS[name])
    process = glint("shlobes", "--light", "bad.json", "-o", "x.glint", "--order", 4)
    assert process.returncode == 3
    assert "bad.json" in process.stderr or "light" in process.stderr or "sphere" in process.stderr
    assert not (folder / "x.glint").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda e: e.__setitem__((3, 4, 1), np.nan), "not finite"),
        (lambda e: e.__setitem__((3, 4, 1), np.inf), "not finite"),
        (lambda e: e.__setitem__((3, 4, 1), -1), "negative"),
    ],
)
def test_bad_pixels_are_refused(glint, folder, change, words):
    pixels = constant(1)
    change(pixels)
    write_exr(folder / "env.exr", pixels)
    process = glint("shlobes", "--light", "env.exr", "-o", "x.glint", "--order", 4)
    assert process.returncode == 3
    assert "env.exr" in process.stderr and "1 pixel " in process.stderr and words in process.stderr
    assert "column 4, row 3 from the top" in process.stderr
    assert not (folder / "x.glint").exists()


def test_other_shapes_and_types_are_refused(glint, folder):
    write_exr(folder / "square.exr", constant(1, 8, 8))
    process = glint("shlobes", "--light", "square.exr", "-o", "x.glint")
    assert process.returncode == 3 and "8 x 8" in process.stderr
    (folder / "empty.exr").write_bytes(b"")
    assert glint("shlobes", "--light", "empty.exr", "-o", "x.glint").returncode == 3
    glint("synth", "flat", "-o", "flat.png", "--size", 16)
    process = glint("shlobes", "--light", "flat.png", "-o", "x.glint")
    assert process.returncode == 3 and "integers" in process.stderr
    assert glint("shlobes", "--light", "missing.exr", "-o", "x.glint").returncode == 2


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["--sigma-r", 0],
        ["--sigma-r", 0.1, "--order", -1],
        ["--sigma-r", 0.1, "--order", 1001],
        ["--sigma-r", 0.1, "--grid", "1x8"],
        ["--sigma-r", 0.1, "--grid", "8"],
        ["--sigma-r", 0.1, "--grid", "8x9x"],
        ["--light", "env.exr", "--sigma-r", 0.1],
        ["--light", "env.exr", "--order", 1000],
        ["--light", "env.exr", "--grid", "none"],
        ["--light", "env.exr", "--order", 10, "--band-limit", 5],
    ],
)
def test_wrong_arguments_are_usage_errors(glint, folder, arguments):
    write_exr(folder / "env.exr", constant(1))
    process = glint("shlobes", *arguments, "-o", "x.glint")
    assert process.returncode == 1, process.stderr
    assert not (folder / "x.glint").exists()


def test_order_1000_says_how_much_memory_it_needs(glint):
    process = glint("shlobes", "--sigma-r", 0.1, "--order", 1000, "--max-memory", "4G", "-o", "x.glint")
    assert process.returncode == 4
    assert "15.6 GB" in process.stderr and "4.00 GB may be used; order 507 fits" in process.stderr
    assert glint("shlobes", "--sigma-r", 0.1, "--order", 1000, "--grid", "none", "-o", "x.glint").returncode == 0


@pytest.mark.parametrize("order", [0, 1])
def test_lowest_orders(glint, folder, order):
    write_exr(folder / "env.exr", constant(1))
    assert glint("shlobes", "--sigma-r", 0.1, "--order", order, "-o", "lobes.glint").returncode == 0
    assert glint("shlobes", "--light", "env.exr", "--order", order, "-o", "light.glint").returncode == 0
    assert glint("validate", "lobes.glint", "light.glint").returncode == 0
    for command in (
        ["synth", "isotropic", "--size", 32, "-o", "map.exr"],
        ["ingest", "map.exr", "-o", "n.glint"],
        ["sat", "n.glint", "-o", "s.glint"],
    ):
        assert glint(*command).returncode == 0
    asked = ["s.glint", "--uv", 0.5, 0.5, "--sigma", 4, "--light", "light.glint", "--lobes", "lobes.glint", "--wo", 0.2, 0, 0.9]
    result = ask(glint, *asked)
    assert result["order"] == order and min(result["radiance"]) > 0


def test_light_of_other_models_and_kinds_is_refused(glint, folder):
    write_exr(folder / "env.exr", constant(1))
    glint("synth", "flakes", "-o", "flakes.png", "--size", 64)
    glint("ingest", "flakes.png", "-o", "flakes.glint")
    glint("pyramid", "flakes.glint", "-o", "pyramid.glint")
    glint("shlobes", "--light", "env.exr", "-o", "light.glint", "--order", 4, "--grid", "3x4")
    asked = ["--uv", 0.5, 0.5, "--sigma", 20, "--light", "light.glint", "--wo", 0, 0, 1]
    assert glint("query", "light", "flakes.glint", *asked).returncode == 0
    assert glint("query", "light", "flakes.glint", *asked, "--surface", "smooth").returncode == 1
    refused = glint("query", "light", "pyramid.glint", *asked)
    assert refused.returncode == 5 and "normals or histogram-sat" in refused.stderr
    assert glint("query", "light", "flakes.glint", *asked[:-5], "flakes.glint", "--wo", 0, 0, 1).returncode == 5
    assert glint("query", "light", "flakes.glint", *asked[:-1], -1).returncode == 1
    assert glint("query", "light", "flakes.glint", *asked[:-4]).returncode == 1
    assert "glint-query ASSET --uv" in glint("query", "light", "flakes.glint", *asked, "--half", 0, 0).stderr
    # The command is a word of its own: without it, options of light are shown where they belong.
    for command in (
        ["flakes.glint", *asked],
        ["flakes.glint", *asked[:5], "--wo", 0, 0, 1],
        ["--json", "light", "flakes.glint", *asked],
    ):
        process = glint("query", *command)
        assert process.returncode == 1
        assert "glint-query light ASSET --light TABLE" in process.stderr
