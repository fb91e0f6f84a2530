"""A picture of surfaces without end and of diffraction: `make demo` draws it."""

import numpy as np
import OpenImageIO as oiio

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

MAP_TEXELS = 256
PLANE_TEXELS = 768
FAR = 2**40  # texels from the origin: planes do not end
SIGMA = 40
WHITE = 0.993  # quantile of the light that is shown as white


def read(path):
    """[height][width][channels], top row first."""
    return np.nan_to_num(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT))


def shaded(normals):
    """Normals as brightness under a light from the upper left."""
    n = 2 * normals[..., :3] - 1
    light = np.array([-0.5, 0.5, 0.7])
    return np.clip(n @ (light / np.linalg.norm(light)), 0, 1) ** 2


def screen(linear, white):
    """Linear light as a screen shows it."""
    x = np.clip(linear / white, 0, 1)
    return np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)


def normals_of(asset):
    """An asset of normals as an image: colours of a normal map."""
    import h5py

    with h5py.File(asset) as file:
        n = file["normals"][...][::-1]
    z = np.sqrt(np.maximum(0, 1 - (n**2).sum(-1)))
    return 0.5 * (np.dstack([n, z]) + 1)


def planes(tools, folder):
    """Title -> picture of a map, and of planes that are made from it and from another one."""
    path = lambda name: folder / f"planes.{name}"

    def part(title, tool, source, asset, origin, *flags):
        tools.run(tool, path(source), "-o", path(asset), *flags)
        tools.run(
            tool,
            path(asset),
            "--explicit",
            PLANE_TEXELS,
            PLANE_TEXELS,
            "--origin",
            *origin,
            "-o",
            path("part.glint"),
            "--force",
        )
        pictures[title] = shaded(normals_of(path("part.glint")))

    for kind, flags in (("scratches", ("--density", 2, "--feature-size", 3, "--seed", 4)), ("leather", ("--feature-size", 20))):
        tools.run("synth", kind, "-o", path(f"{kind}.exr"), "--size", MAP_TEXELS, *flags)
        tools.run("ingest", path(f"{kind}.exr"), "-o", path(f"{kind}.glint"))
    path("turns.json").write_text('{"rotation_deg": [0, 360], "scale": [0.8, 1.3]}')
    pictures = {f"a map of {MAP_TEXELS} texels": shaded(read(path("scratches.exr")))}
    wang = ("--size", 128, "--tiles", 32, "--boundary", "wrap")
    part(f"Wang tiles of it, {PLANE_TEXELS} texels, 2^40 away", "wang", "scratches.glint", "wang.glint", (FAR, 0), *wang)
    part(
        "32 texels of it, scattered",
        "tiny",
        "scratches.glint",
        "tiny.glint",
        (FAR // 1024, 0),
        "--cut",
        32,
        "--at",
        100,
        120,
        "--mode",
        "scattered",
        "--density",
        2,
        "--transforms",
        path("turns.json"),
    )
    part("Wang tiles of leather", "wang", "leather.glint", "leather.wang.glint", (FAR, 0), *wang)
    return pictures


def diffraction(tools, folder):
    """Title -> NDF image of heights as mirrors and as waves."""
    pictures = {}
    for kind, title, flags in (
        ("grating", "a grating", ("--feature-size", 8, "--depth-um", 0.25)),
        ("brushed", "brushed metal", ("--depth-um", 0.4)),
    ):
        path = lambda name: folder / f"waves.{kind}.{name}"
        tools.run("synth", kind, "-o", path("exr"), "--height", "--size", 128, "--texel-size-um", 1, *flags)
        for to, asset in (("heights", "heights.glint"), ("normals", "glint")):
            tools.run(
                "ingest",
                path("exr"),
                "-o",
                path(asset),
                "--kind",
                "height",
                "--to",
                to,
                "--height-scale-um",
                1,
                "--texel-size-um",
                1,
            )
        tools.run(
            "pyramid",
            path("heights.glint"),
            "-o",
            path("wave.glint"),
            "--optics",
            "wave",
            "--coherence-um",
            16,
            "--wavelengths",
            24,
        )
        for asset, name in (("glint", "mirrors"), ("wave.glint", "waves, 24 wavelengths")):
            image = path(f"{asset}.exr")  # one name for each: reads are cached
            roughness = ("--sigma-r", 0.01) if asset == "glint" else ()
            tools.run("query", path(asset), "--uv", 0.5, 0.5, "--sigma", SIGMA, *roughness, "--image", image, "--force")
            pictures[f"{title}: {name}"] = read(image)
    return pictures


def cut(image):
    """The middle of an NDF image, where the light is."""
    height = image.shape[0]
    middle = image[3 * height // 8 : 5 * height // 8, 3 * height // 8 : 5 * height // 8]
    return np.repeat(middle, 3, axis=2) if middle.shape[2] == 1 else middle[..., :3]


def draw(tools, folder, path):
    """Writes the picture."""
    figure, rows = plt.subplots(2, 4, figsize=(14, 7.4), layout="constrained")
    for axes in rows.flat:
        axes.set_axis_off()
    for axes, (title, image) in zip(rows[0], planes(tools, folder).items()):
        axes.imshow(image, cmap="gray", vmin=0, vmax=1)
        axes.set_title(title, fontsize=11)
    for axes, (title, image) in zip(rows[1], diffraction(tools, folder).items()):
        part = cut(image)
        axes.imshow(screen(part, np.quantile(part.max(axis=2), WHITE)), interpolation="nearest")
        axes.set_title(title, fontsize=11)
    figure.savefig(path, dpi=80, metadata={"Software": None})
    plt.close(figure)
