"""Draws bench.png and bench-pictures.png: the head of a page of glint-bench, and its pictures. Needs the tools and Chromium.

    python3 docs/pictures/bench_page.py --bin build/bin [--only bench.png|bench-pictures.png]

The head is of all settings of isotropic noise, and takes minutes; the pictures are of flakes, one setting of each method.
"""

import argparse
import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "pipelines"))
from bench_charts import browse, browser  # noqa: E402

SIZE = 1024
HEAD, PICTURES_OF_FLAKES = (1240, 1330), (960, 1125)  # pixels
# Chooses a method among the pictures, and leaves nothing else on the page.
PICTURES = """<script>
const candidate = document.getElementById("candidate");
candidate.value = "tucker, tolerance 0.1";
candidate.dispatchEvent(new Event("change"));
const pictures = document.getElementById("picture").closest("section");
for (const other of [...document.body.children]) if (other !== pictures && other.tagName !== "SCRIPT") other.remove();
</script>"""


def page_of(bin, kind, folder, *flags):
    """A page of one map."""
    image, asset, measured, page = (folder / f"{kind}{end}" for end in (".exr", ".glint", ".json", ".html"))
    subprocess.run([bin / "glint-synth", kind, "-o", image, "--size", str(SIZE)], check=True)
    subprocess.run([bin / "glint-ingest", image, "-o", asset, "--quiet"], check=True)
    subprocess.run([bin / "glint-bench", asset, "-o", measured, *flags], check=True)
    subprocess.run([bin / "glint-bench", "--report", measured, "-o", page], check=True)
    return page


def shoot(program, folder, address, size, name):
    browse(program, folder / "profile", f"--window-size={size[0]},{size[1]}", f"--screenshot={HERE / name}", address)


def draw_head(bin, program, folder):
    shoot(program, folder, f"{page_of(bin, 'isotropic', folder).as_uri()}#size=32", HEAD, "bench.png")


def draw_pictures(bin, program, folder):
    page = page_of(bin, "flakes", folder, "--quick")
    page.write_text(page.read_text(encoding="utf-8").replace("</body>", f"{PICTURES}</body>"), encoding="utf-8")
    shoot(program, folder, f"{page.as_uri()}#size=32&shape=plane", PICTURES_OF_FLAKES, "bench-pictures.png")


def main():
    drawn = {"bench.png": draw_head, "bench-pictures.png": draw_pictures}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bin", type=pathlib.Path, default="build/bin", help="folder of the programs")
    parser.add_argument("--only", choices=drawn, help="draw one of the two")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        for picture, draw in drawn.items():
            if arguments.only in (None, picture):
                draw(arguments.bin, browser(), pathlib.Path(name))


if __name__ == "__main__":
    main()
