"""Renders the pictures of the gallery with Mitsuba 3 and the plugins of glint_ndf.

Normally run by `make gallery`. Writes pictures, and an index README.md with what is seen, how, with how many samples, and in what time.
"""

import argparse
import dataclasses
import importlib
import json
import pathlib
import sys
import textwrap
import time

import numpy as np

import kit as kits
import pictures

# In the order of the index. Each module has draw(gallery).
SCENES = (
    "car_paint",
    "kettle",
    "cutlery",
    "bent_quad",
    "cloth",
    "diffraction",
    "plane",
    "environment",
    "zoom",
    "models",
    "animation",
)
QUICK_SCENES = ("car_paint", "kettle", "cutlery")  # of `make demo`
PASSES = 8
OUTLIER = 4.0  # times the median of the passes at a pixel, at which a pass is cut
WIDTH = 150  # characters of a line of the index
TONE = "Khronos PBR Neutral tone curve, sRGB"


@dataclasses.dataclass
class Picture:
    """A rendering: linear light, and how it was made."""

    linear: np.ndarray
    seconds: float  # of processor time, of all threads
    spp: int
    exposure: float

    def srgb(self):
        return kits.tone(self.linear, self.exposure)


def combined(passes):
    """The mean of renderings [n][height][width][3], of which each is cut at OUTLIER times the median.

    A glint is in every pass, because its footprint is that of the pixel, and stays. Light that a rough surface gets by way of a glint is in few passes,
    and would be white dots for thousands of samples: most of it is lost.
    """
    if len(passes) < 4:
        return passes.mean(axis=0).astype(np.float32)
    light = passes.max(axis=-1, keepdims=True)
    limit = OUTLIER * np.median(light, axis=0) + 0.1 * float(np.median(light))
    return (passes * np.minimum(1, limit / np.maximum(light, 1e-9))).mean(axis=0).astype(np.float32)


class Gallery:
    """Renders, writes, and keeps what the index says."""

    def __init__(self, kit, out):
        self.kit, self.out, self.entries = kit, out, []
        out.mkdir(parents=True, exist_ok=True)

    def scaled(self, size, spp):
        """(size, samples) of a picture; both are smaller in a quick run."""
        return (tuple(2 * n // 3 for n in size), max(8, spp // 4)) if self.kit.quick else (size, spp)

    def render(self, label, description, exposure=1.0, seed=0, quiet=False):
        """Renders a scene's dictionary in passes, with a line of progress for each."""
        import mitsuba as mi

        scene = mi.load_dict(description)
        spp = description["camera"]["sampler"]["sample_count"]
        passes = []
        start, started, told = time.perf_counter(), time.process_time(), -1
        for index in range(min(PASSES, spp)):
            passes.append(np.array(mi.render(scene, spp=max(1, spp // PASSES), seed=seed + index)))
            tenth = 10 * len(passes) // min(PASSES, spp)
            if tenth != told and not (quiet and tenth < 10):
                told = tenth
                print(f"{label}: {10 * tenth} %, {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
        seconds = time.process_time() - started
        return Picture(combined(np.array(passes)), seconds, len(passes) * max(1, spp // PASSES), exposure)

    def detail(self, label, scene, size, spp, frame, magnified, exposure=1.0):
        """An inset for `save`: a part of a picture, rendered larger.

        @param scene  (size, spp, crop) -> dictionary of the scene
        @param frame  (left, top, width, height) in pixels of the picture
        """
        crop = tuple(magnified * n for n in frame)
        large = tuple(magnified * n for n in size)
        return self.render(f"{label}, detail", scene(large, spp, crop), exposure), frame

    def enter(self, name, file, seen, **facts):
        """Adds a line to the index."""
        self.entries.append({"name": name, "file": file.name, **seen, **facts})

    def save(self, name, picture, inset=None, corner=(1, 1), **seen):
        """Writes one picture.

        @param inset   from `detail`
        @param corner  of the inset: 1 is right, 1 is below
        @param seen    title, text, alt and method for the index
        """
        file = self.out / f"{name}.png"
        pixels = picture.srgb()
        pictures.save(pictures.with_inset(pixels, inset[0].srgb(), inset[1], corner) if inset else pixels, file)
        self.enter(name, file, seen, spp=picture.spp, seconds=picture.seconds)
        return file

    def sheet(self, name, sheet, columns, notes=None, **seen):
        """Writes pictures with titles as one. @param sheet  title -> Picture or sRGB array"""
        file = self.out / f"{name}.png"
        rendered = [p for p in sheet.values() if isinstance(p, Picture)]
        pictures.save(
            pictures.sheet(
                {title: p.srgb() if isinstance(p, Picture) else p for title, p in sheet.items()}, columns, notes or {}
            ),
            file,
        )
        self.enter(name, file, seen, spp=max(p.spp for p in rendered), seconds=sum(p.seconds for p in rendered))
        return file


def index_text(entries, pictures_folder=""):
    """The entries as Markdown."""
    lines = []
    for entry in entries:
        lines += [
            f"## {entry['title']}",
            "",
            f"![{entry['alt']}]({pictures_folder}{entry['file']})",
            "",
            textwrap.fill(entry["text"], WIDTH),
            "",
        ]
        if entry.get("table"):
            lines += [*entry["table"], ""]
        lines += [f"*{entry['method']}; {entry['spp']} samples a pixel; {entry['seconds']:.0f} s of processor time.*", ""]
    return "\n".join(lines)


HEAD = f"""# Gallery

Rendered by Mitsuba 3 with the BSDF `glint` and the integrator `glint_path` of the package glint_ndf. `make gallery` renders all pictures again, from
maps of `glint-synth` to files in `gallery/`; the scenes are small programs in `pipelines/scenes/`. Pictures are not denoised; each is the mean of
{PASSES} renderings, of which a pixel is cut at {OUTLIER:g} times the median, so rare paths from rough surfaces over glints are lost. All are shown through the
{TONE}. Times are seconds of processor time of the rendering, of all threads together, without the preparation of
maps.
"""

BALL = """
The copper ball first, by another program (`docs/pictures/ball.py`): one texel for each pixel; one roughness for all pixels; glint; and the slow sum over
all texels under each pixel, which the third has to match.

![A copper ball with flakes, four times: a few lonely dots; three smooth highlights without a sparkle; sparkling highlights; the same sparkling highlights](pictures/ball.png)
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bin", type=pathlib.Path, default="build/bin", help="folder of the programs")
    parser.add_argument("--out", type=pathlib.Path, default="gallery", help="folder to make")
    parser.add_argument("--only", action="append", choices=SCENES, help="draw this scene; may be given again")
    parser.add_argument("--quick", action="store_true", help=f"small and with few samples: {', '.join(QUICK_SCENES)}")
    parser.add_argument("--index", action="store_true", help="render nothing; write the index of the pictures that are there")
    parser.add_argument("--docs", type=pathlib.Path, help="also write DOCS/GALLERY.md and DOCS/pictures/gallery")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="of Mitsuba")
    arguments = parser.parse_args()
    if arguments.quick and arguments.docs:
        parser.error("--docs needs pictures of full size: leave out --quick")
    if not arguments.index:
        kits.start_mitsuba(arguments.variant)
    gallery = Gallery(kits.Kit(arguments.bin, arguments.out / "assets", arguments.quick), arguments.out)
    names = () if arguments.index else arguments.only or (QUICK_SCENES if arguments.quick else SCENES)
    start = time.perf_counter()
    for name in names:
        importlib.import_module(name).draw(gallery)
        write_index(gallery, arguments.docs)
    write_index(gallery, arguments.docs)
    print(f"{len(gallery.entries)} pictures in {time.perf_counter() - start:.0f} s; index: {arguments.out}/README.md")


def write_index(gallery, docs):
    """Writes the index of all pictures that are there: those of this run, and those of earlier runs with the same folder."""
    record = gallery.out / "index.json"
    kept = {entry["name"]: entry for entry in (json.loads(record.read_text()) if record.exists() else [])}
    kept |= {entry["name"]: entry for entry in gallery.entries}
    order = [name.replace("_", "-") for name in SCENES]
    entries = sorted(kept.values(), key=lambda entry: order.index(entry["name"]))
    record.write_text(json.dumps(entries, indent=1) + "\n")
    (gallery.out / "README.md").write_text(HEAD + "\n" + index_text(entries))
    if docs:
        folder = docs / "pictures" / "gallery"
        folder.mkdir(parents=True, exist_ok=True)
        shown = [entry | {"file": pictures.for_documents(gallery.out / entry["file"], folder).name} for entry in entries]
        (docs / "GALLERY.md").write_text(HEAD + BALL + "\n" + index_text(shown, "pictures/gallery/"))


if __name__ == "__main__":
    main()
