"""The first picture of docs/MITSUBA.md."""

import pathlib
import re

import mitsuba as mi
import numpy as np

GUIDE = pathlib.Path(__file__).parents[3] / "docs" / "MITSUBA.md"


def test_the_first_picture_shows_glints(tmp_path, monkeypatch):
    program = re.search(r"```python\n(.*?)```", GUIDE.read_text(encoding="utf-8"), re.DOTALL).group(1)
    # A quarter of the size, for time.
    small = program.replace('"width": 512, "height": 384', '"width": 128, "height": 96').replace("spp=16", "spp=4")
    # Pictures of screens end at white.
    small = small.replace("flakes.png", "flakes.exr").replace("spp=4)", "spp=4), write_async=False")
    assert small.count('"width": 128') == 1 and small.count("spp=4") == 1
    monkeypatch.chdir(tmp_path)
    exec(compile(small, str(GUIDE), "exec"), {})
    image = np.array(mi.Bitmap("flakes.exr").convert(mi.Bitmap.PixelFormat.Y, mi.Struct.Type.Float32, False))
    assert image.mean() > 0.01
    # A few pixels hold the light: most are dark, the brightest outshine the mean.
    assert np.median(image) < 0.2 * image.mean()
    assert image.max() > 5 * image.mean()
