"""The chain of tools on the sample maps: assets, a table of time, bytes and error, a picture before and after compression,
one of all models, and one of planes without end and of diffraction.

Normally run by `make demo`.
"""

import argparse
import dataclasses
import json
import pathlib
import sys

import numpy as np
import OpenImageIO as oiio

import picture
import planes
from processes import Tools, readable_bytes, readable_time

SAMPLES = pathlib.Path(__file__).parents[2] / "data-samples"
STRIDE = 32
# Images of the finest level along each axis of a region: as many as 8 x 8 regions of a 2K^2 map have (Deng 2022, section 4.2).
IMAGES_PER_REGION = 8
PICTURE_LEVELS = (0, 1, 3)
# Columns of the picture of all models -> kind in the file's name, in groups that answer the same footprint exactly. Bin maps and histograms
# know boxes; they are asked for the box that has the second moments of the Gaussian.
GAUSSIAN_MODELS = {
    "Reference, Gaussian": "",
    "pyramid": "pyramid",
    "cp, rank 16": "cp",
    "tucker, 10 %": "tucker10",
    "pca, rank 16": "pca",
    "moments": "moments",
}
BOX_MODELS = {"Reference, box": "", "bin map": "binmap", "histograms": "sat"}
ASKED_SIGMA_R = {"", "moments"}  # kinds that have no roughness of their own
NOT_DRAWN = {"flakes_256"}  # flakes_1k is


@dataclasses.dataclass
class Row:
    map: str
    step: str
    seconds: float
    bytes: int
    error: float | None = None


@dataclasses.dataclass
class Footprint:
    """A round footprint."""

    u: float
    v: float
    sigma: float
    is_box: bool = False

    def options(self):
        """As glint-query is asked."""
        half_axis = 3**0.5 * self.sigma  # of the box with the same second moments
        size = ["--box", half_axis, 0, 0, half_axis] if self.is_box else ["--sigma", self.sigma]
        return ["--uv", self.u, self.v, *size]


class Chain:
    """Everything that is made of one map. Files are in `folder`, named after the map."""

    def __init__(self, tools, image, folder, ingest_flags=()):
        self.tools, self.image, self.folder, self.ingest_flags = tools, image, folder, ingest_flags
        self.name = image.stem
        self.rows = []

    def path(self, kind=""):
        return self.folder / (f"{self.name}.{kind}.glint" if kind else f"{self.name}.glint")

    def add(self, step, run, path, error=None):
        self.rows.append(Row(self.name, step, run.wall_s, path.stat().st_size, error))

    def run(self):
        kind = ["--kind", "height"] if "height" in self.name else []
        ingest = self.tools.run("ingest", self.image, "-o", self.path(), *kind, *self.ingest_flags)
        self.add("ingest", ingest, self.path())
        pyramid = self.tools.run("pyramid", self.path(), "-o", self.path("pyramid"), "--stride", STRIDE)
        self.levels = [level for level in pyramid.result["levels"] if not level["is_mean"]]
        self.size = self.texels()
        self.sigma_r = pyramid.result["sigma_r"]
        self.add("pyramid", pyramid, self.path("pyramid"), self.error("pyramid"))
        regions = max(1, round(max(self.size) / STRIDE / IMAGES_PER_REGION))
        cp = self.compress("cp", "cp, rank 16", "--method", "cp", "--rank", 16, "--regions", regions)
        self.compress("tucker", "tucker, rank 25", "--method", "tucker", "--rank", 25)
        self.compress("pca", "pca, rank 16", "--method", "pca", "--rank", 16)
        self.compress(
            "tolerance",
            "tucker, error of cp",
            "--method",
            "tucker",
            "--metric",
            "l2",
            "--tolerance",
            cp.result["total"]["rel_l2"],
        )
        self.compress("tucker10", "tucker, seen error 10 %", "--method", "tucker", "--tolerance", 0.1)
        self.make("bin map", "binmap", "--alpha", self.sigma_r * 2**0.5)
        self.make("histograms", "sat")
        self.make("moments", "moments")
        if kind:
            heights = self.path("heights")
            self.tools.run("ingest", self.image, "-o", heights, *kind, "--to", "heights", *self.ingest_flags)
            self.make("displacement, 1 / 16", "displace", "--factor", 16, "--base", "diffuse:0.8", source=heights)
        return self

    def make(self, step, tool, *flags, source=None):
        self.add(step, self.tools.run(tool, source or self.path(), "-o", self.path(tool), *flags), self.path(tool))

    def compress(self, kind, step, *flags):
        run = self.tools.run("compress", self.path("pyramid"), "-o", self.path(kind), *flags)
        self.add(step, run, self.path(kind), run.result["total"]["rel_l2"])
        return run

    def compress_to_bytes_of(self, kind, like, method, searches=8):
        """The smallest error that a method reaches in at most the bytes of another asset, by bisection of the tolerance."""
        budget = self.path(like).stat().st_size
        high = next(row.error for row in self.rows if row.step.startswith(like))
        low = 0.02 * high
        best = None
        for _ in range(searches):
            middle = (low * high) ** 0.5
            run = self.tools.run(
                "compress",
                self.path("pyramid"),
                "-o",
                self.path("try"),
                "--method",
                method,
                "--metric",
                "l2",
                "--tolerance",
                middle,
            )
            if self.path("try").stat().st_size <= budget:
                high = middle
                self.path("try").replace(self.path(kind))
                best = run
            else:
                low = middle
        self.path("try").unlink(missing_ok=True)
        if best:
            self.add(f"{method}, bytes of {like}", best, self.path(kind), best.result["total"]["rel_l2"])
        return best

    def texels(self):
        spec = oiio.ImageBuf(str(self.image)).spec()
        return spec.width, spec.height

    def footprint(self, level):
        """A third of the way across the map, of a size between a level and the next, as a renderer asks."""
        return Footprint(1 / 3, 1 / 3, 1.3 * 1.5 * self.levels[level]["stride_texels"] / 12**0.5)

    def ndf(self, kind, footprint):
        """NDF image of one asset, top row first, by glint-query."""
        path = self.folder / "query.exr"
        sigma_r = ["--sigma-r", self.sigma_r] if kind in ASKED_SIGMA_R else []
        self.tools.run("query", self.path(kind), *footprint.options(), "--image", path, *sigma_r)
        # Not ImageBuf: it remembers files by name.
        image = oiio.ImageInput.open(str(path))
        pixels = image.read_image(oiio.FLOAT)[:, :, 0]
        image.close()
        path.unlink()
        return pixels

    def nanoseconds(self, kind, footprint, half):
        """Time of a density query."""
        sigma_r = ["--sigma-r", self.sigma_r] if kind in ASKED_SIGMA_R else []
        run = self.tools.run("query", self.path(kind), *footprint.options(), "--half", *half, "--repeat", 3000, *sigma_r)
        return run.result["nanoseconds"]

    def error(self, kind):
        """Against the Reference, mean over two sizes above those of the two finest levels."""
        return float(
            np.mean(
                [
                    picture.relative(self.ndf(kind, p), self.ndf("", p))
                    for p in map(self.footprint, range(min(2, len(self.levels))))
                ]
            )
        )


def brightest(image):
    """The half vector of the largest density of an NDF image, top row first."""
    row, column = np.unravel_index(np.argmax(image), image.shape)
    return (2 * column + 1) / image.shape[1] - 1, 1 - (2 * row + 1) / image.shape[0]


def table_text(rows):
    lines = [f"{'map':<22} {'step':<22} {'seconds':>8} {'bytes':>11} {'error':>8}"]
    previous = ""
    for row in rows:
        name = "" if row.map == previous else row.map
        if name and previous:
            lines.append("")
        previous = row.map
        error = "" if row.error is None else f"{row.error:.4f}"
        lines.append(f"{name:<22} {row.step:<22} {row.seconds:>8.2f} {readable_bytes(row.bytes):>11} {error:>8}")
    lines += [
        "",
        "seconds: the whole process. bytes: the file. error of the pyramid: relative L2 distance of its answers at two sizes of",
        "footprints from brute force over the texels; of the others: of all images from the pyramid's.",
    ]
    return "\n".join(lines) + "\n"


def draw_footprints(chain, path):
    """The chain's images at three footprint sizes, before and after compression."""
    chain.compress_to_bytes_of("tucker-same", "cp", "tucker")
    levels = sorted({min(level, len(chain.levels) - 1) for level in PICTURE_LEVELS})
    footprints = [chain.footprint(level) for level in levels]
    sizes = {
        kind: readable_bytes(chain.path(kind).stat().st_size)
        for kind in ("pyramid", "cp", "tucker-same")
        if chain.path(kind).exists()
    }
    titles = {"": "Reference", "pyramid": f"Pyramid\n{sizes['pyramid']}", "cp": f"CP, rank 16\n{sizes['cp']}"}
    if "tucker-same" in sizes:
        titles["tucker-same"] = f"Tucker and spots\n{sizes['tucker-same']}"
    images = {title: [chain.ndf(kind, p) for p in footprints] for kind, title in titles.items()}
    picture.draw_footprints(images, [f"footprint {p.sigma:.0f} texels" for p in footprints], path)


def draw_models(chains, path):
    """The NDF of a footprint a little larger than those of the finest level, from every model: of a Gaussian, or of the box of its second moments."""
    maps = {}
    for chain in chains:
        gaussian = chain.footprint(0)
        half = brightest(chain.ndf("", gaussian))
        maps[chain.name.replace("_", "\n")] = [
            answers(chain, models, footprint, half)
            for models, footprint in ((GAUSSIAN_MODELS, gaussian), (BOX_MODELS, dataclasses.replace(gaussian, is_box=True)))
        ]
    picture.draw_models(maps, path)


def answers(chain, models, footprint, half):
    """Title of a column -> (image, bytes and time of a query)."""
    note = (
        lambda kind: f"{readable_bytes(chain.path(kind).stat().st_size)}, {readable_time(chain.nanoseconds(kind, footprint, half))}"
    )
    return {title: (chain.ndf(kind, footprint), note(kind)) for title, kind in models.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, default="build/bin", help="folder of the programs")
    parser.add_argument("--out", type=pathlib.Path, default="demo", help="folder to make")
    parser.add_argument("--map", type=pathlib.Path, help="an image of yours; heights if its name says so")
    parser.add_argument("--ingest-flags", default="", help="for --map, for example '--convention directx'")
    arguments = parser.parse_args()
    if arguments.map and not arguments.map.is_file():
        sys.exit(f"{arguments.map}: no such file")
    tools = Tools(arguments.bin)
    assets = arguments.out / "assets"
    assets.mkdir(parents=True, exist_ok=True)

    large = assets / "flakes_1k.exr"
    tools.run("synth", "flakes", "-o", large, "--size", 1024, "--flake-size", 6, "--seed", 7)
    maps = sorted(p for p in SAMPLES.iterdir() if p.suffix in {".png", ".exr"}) + [large]
    chains = []
    for image in [*maps, *([arguments.map] if arguments.map else [])]:
        print(f"{image}", file=sys.stderr, flush=True)
        chains.append(Chain(tools, image, assets, arguments.ingest_flags.split() if image == arguments.map else ()).run())
    draw_footprints(chains[-1], arguments.out / "ndf-before-after.png")
    draw_models([chain for chain in chains if chain.name not in NOT_DRAWN], arguments.out / "ndf-models.png")

    planes.draw(tools, assets, arguments.out / "planes-and-waves.png")

    rows = [row for chain in chains for row in chain.rows]
    text = table_text(rows)
    (arguments.out / "table.txt").write_text(text)
    (arguments.out / "table.json").write_text(json.dumps([dataclasses.asdict(row) for row in rows], indent=1) + "\n")
    print(
        f"\n{text}\nassets: {assets}/   table: {arguments.out}/table.txt, .json   pictures: {arguments.out}/ndf-before-after.png, ndf-models.png, planes-and-waves.png"
    )


if __name__ == "__main__":
    main()
