"""Draws bench.png and bench-pictures.png: the head of a page of glint-bench, and its pictures. Needs the tools and Chromium, and takes some minutes:

    python3 docs/pictures/bench_page.py build/bin
"""

import pathlib
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(HERE.parents[1] / "pipelines"))
from bench_charts import browse, browser  # noqa: E402

SIZE = 1024
WIDTH, HEAD_HEIGHT, PICTURES_HEIGHT = 1240, 1330, 1010
# Chooses a method among the pictures, and leaves nothing else on the page.
PICTURES = """<script>
const candidate = document.getElementById("candidate");
candidate.value = "tucker, tolerance 0.1";
candidate.dispatchEvent(new Event("change"));
const pictures = document.getElementById("picture").closest("section");
for (const other of [...document.body.children]) if (other !== pictures && other.tagName !== "SCRIPT") other.remove();
</script>"""


def results(bin, kind, folder):
    """A page of one map."""
    image, asset, measured, page = (folder / f"{kind}{end}" for end in (".exr", ".glint", ".json", ".html"))
    subprocess.run([bin / "glint-synth", kind, "-o", image, "--size", str(SIZE)], check=True)
    subprocess.run([bin / "glint-ingest", image, "-o", asset, "--quiet"], check=True)
    subprocess.run([bin / "glint-bench", asset, "-o", measured], check=True)
    subprocess.run([bin / "glint-bench", "--report", measured, "-o", page], check=True)
    return page


def shoot(program, folder, address, height, name):
    browse(program, folder / "profile", f"--window-size={WIDTH},{height}", f"--screenshot={HERE / name}", address)


def main():
    bin = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "build/bin")
    program = browser()
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        page = results(bin, "flakes", folder)
        shoot(program, folder, f"{page.as_uri()}#size=32", HEAD_HEIGHT, "bench.png")
        only = folder / "pictures.html"
        only.write_text(page.read_text(encoding="utf-8").replace("</body>", f"{PICTURES}</body>"), encoding="utf-8")
        shoot(program, folder, f"{only.as_uri()}#size=32&shape=plane", PICTURES_HEIGHT, "bench-pictures.png")


if __name__ == "__main__":
    main()
