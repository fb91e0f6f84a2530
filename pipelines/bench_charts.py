"""Writes the charts of a page of glint-bench as SVG and PNG files, without a window.

    glint-bench --report results.json -o report.html
    python3 pipelines/bench_charts.py report.html --out charts --metric flip --shape plane --size 32

The charts are drawn by a library of JavaScript inside the page, so a browser is needed: Chromium, which $CHROMIUM may name.
"""

import argparse
import html
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

SCALE = 2  # pixels of the PNG for one of the page


def browser():
    """The program of Chromium."""
    for name in filter(None, (os.environ.get("CHROMIUM"), "chromium", "chromium-browser", "google-chrome")):
        if found := shutil.which(name):
            return found
    sys.exit("bench_charts.py: error: Chromium was not found; install it, or name its program in $CHROMIUM")


def browse(program, profile, *arguments):
    command = [
        program,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-dev-shm-usage",
        "--hide-scrollbars",
        "--virtual-time-budget=4000",
        "--window-size=1280,1400",
        f"--user-data-dir={profile}",
        *arguments,
    ]  # of a repeated flag the last counts
    process = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    if process.returncode != 0:
        sys.exit(f"bench_charts.py: error: {program} failed: {process.stderr.strip()[-500:]}")
    return process.stdout


def attribute(text, name):
    """A document of JSON in an attribute of the page; nothing if it has none."""
    found = re.search(rf'data-{name}="([^"]*)"', text)
    return json.loads(html.unescape(found.group(1))) if found else None


def charts_of(program, profile, page, choices):
    """{name: SVG} of a page, which must show what was chosen."""
    address = f"{page.resolve().as_uri()}#{urllib.parse.urlencode(choices | {'charts': 'all'})}"
    text = browse(program, profile, "--dump-dom", address)
    charts, state = attribute(text, "charts"), attribute(text, "choices")
    if not charts or not state:
        sys.exit(
            f"bench_charts.py: error: {page}: has no charts of measurements; give a page of glint-bench --report RESULTS.json"
        )
    for name, choice in choices.items():
        if choice != state["shown"][name]:
            offered = ", ".join(f"{value:g}" if name == "size" else value for value in state["offered"][name])
            sys.exit(f"bench_charts.py: error: --{name} {choice}: the page has no such {name} here; it has {offered}")
    return charts


def write(program, profile, svg, path):
    """Writes NAME.svg, and NAME.png by the browser."""
    file = path.with_suffix(".svg")
    file.write_text(svg, encoding="utf-8")
    width, height = (re.search(rf'<svg[^>]* {side}="([\d.]+)"', svg).group(1) for side in ("width", "height"))
    browse(
        program,
        profile,
        f"--window-size={width},{height}",
        f"--force-device-scale-factor={SCALE}",
        f"--screenshot={path.with_suffix('.png').resolve()}",
        file.resolve().as_uri(),
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("page", type=pathlib.Path, help="of glint-bench --report, HTML")
    parser.add_argument("--out", type=pathlib.Path, default="charts", help="folder for NAME.svg and NAME.png")
    parser.add_argument("--map", help="name of a map of the page; else the first")
    parser.add_argument("--metric", help="error: seen, seen_worst, bias, rel_l2, tv, energy, rmse or flip")
    parser.add_argument("--shape", help="round, stretched or box; of rmse and flip plane or sphere")
    parser.add_argument("--size", type=float, help="of footprints, texels")
    arguments = parser.parse_args()
    if not arguments.page.is_file():
        sys.exit(f"bench_charts.py: error: {arguments.page}: is no file")
    choices = {name: value for name in ("map", "metric", "shape", "size") if (value := getattr(arguments, name)) is not None}
    program = browser()
    with tempfile.TemporaryDirectory() as profile:
        charts = charts_of(program, profile, arguments.page, choices)
        arguments.out.mkdir(parents=True, exist_ok=True)
        for name, svg in charts.items():
            write(program, profile, svg, arguments.out / name)
    print("\n".join(str(arguments.out / f"{name}.{ending}") for name in charts for ending in ("svg", "png")))


if __name__ == "__main__":
    main()
