"""Assets of a map by every method, and pictures of them by glint-render-test."""

import dataclasses
import json
import pathlib
import subprocess
import sys

import numpy as np
import OpenImageIO as oiio

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "pipelines/demo"))

# Map -> arguments of glint-synth.
MAPS = {
    "isotropic": ["isotropic", "--alpha", 0.2, "--seed", 1],
    "brushed": ["brushed", "--seed", 2],
    "scratches": ["scratches", "--seed", 4],
    "flakes": ["flakes", "--flake-size", 6, "--alpha", 0.2, "--seed", 3],
    "weave": ["weave", "--seed", 5],
}


@dataclasses.dataclass(frozen=True)
class Model:
    """A method, and how it is prepared and asked."""

    tool: str  # that makes the asset; empty: the normals
    flags: tuple = ()
    source: str = ""  # the model whose asset is the input; empty: the normals
    takes_normals: bool = False  # footprints below level 0 are answered from the texels
    filter: str = "gaussian"  # footprints that the model answers exactly


REFERENCES = {"Reference": Model(""), "Reference, boxes": Model("", filter="box")}
MODELS = {
    "pyramid": Model("pyramid", takes_normals=True),
    "tucker": Model("compress", ("--method", "tucker", "--tolerance", 0.1), "pyramid", True),
    "cp": Model("compress", ("--method", "cp", "--rank", 16), "pyramid", True),
    "pca": Model("compress", ("--method", "pca", "--tolerance", 0.1), "pyramid", True),
    "bin map": Model("binmap", filter="box"),
    "histograms": Model("sat", filter="box"),
    "moments": Model("moments"),
}


def reference_of(model):
    """The reference that sees the same footprints."""
    return "Reference, boxes" if MODELS[model].filter == "box" else "Reference"


def has_blocks(model):
    """Whether the model's NDF images are stored in blocks of 16x16 pixels."""
    return MODELS[model].takes_normals


@dataclasses.dataclass
class Picture:
    """A picture and how it was made."""

    radiance: list  # [row][column] for each light
    half: np.ndarray  # [row][column][2]: half vector towards the middle of the lights
    sigma: np.ndarray  # deviation of the footprint, texels; 0 where there is no surface
    result: dict  # printed by glint-render-test

    @property
    def covered(self):
        return self.sigma > 0


def read(path):
    """Channels of an OpenEXR file by name. Not ImageBuf: it remembers files by name."""
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise OSError(f"{path}: {oiio.geterror()}")
    names = file.spec().channelnames
    pixels = file.read_image(oiio.FLOAT)
    file.close()
    return {name: pixels[:, :, k] for k, name in enumerate(names)}


class Gallery:
    """The pictures of one map. Files are in `folder`, named after the map; assets of an earlier run are made again."""

    def __init__(self, tools, folder, name, texels, size):
        self.tools, self.folder, self.name, self.texels, self.size = tools, folder, name, texels, size
        folder.mkdir(parents=True, exist_ok=True)
        self.bytes = {}

    def path(self, model=""):
        kind = "" if model in REFERENCES else model.replace(" ", "-")
        return self.folder / (f"{self.name}.{kind}.glint" if kind else f"{self.name}.glint")

    def make(self, models):
        """The assets of some models, in the order of MODELS."""
        image = self.folder / f"{self.name}.exr"
        self.tools.run("synth", *MAPS[self.name], "--size", self.texels, "-o", image)
        self.tools.run("ingest", image, "-o", self.path())
        needed = {*models, *(MODELS[model].source for model in models)}
        for name, model in MODELS.items():
            if name in needed:
                self.tools.run(model.tool, self.path(model.source), "-o", self.path(name), *model.flags)
                self.bytes[name] = self.path(name).stat().st_size

    def draw(self, model, distance, lights, *options, size=None):
        """The picture of a model or a reference under some lights. More options are those of glint-render-test."""
        how = REFERENCES.get(model) or MODELS[model]
        output = self.folder / "picture.exr"
        normals = ["--normals", self.path()] if how.takes_normals else []
        command = [
            self.tools.folder / "glint-render-test",
            self.path(model),
            "-o",
            output,
            *normals,
            "--filter",
            how.filter,
            "--size",
            size or self.size,
            "--distance",
            distance,
            "--light",
            *lights,
            *options,
        ]
        process = subprocess.run([*map(str, command)], capture_output=True, text=True)
        if process.returncode != 0:
            sys.exit(f"failed with exit code {process.returncode}: {' '.join(map(str, command))}\n{process.stderr}")
        channels = read(output)
        output.unlink()
        radiance = [channels[f"radiance.{k}"] for k in range(len(lights))]
        return Picture(
            radiance, np.stack([channels["half.x"], channels["half.y"]], axis=2), channels["sigma"], json.loads(process.stdout)
        )
