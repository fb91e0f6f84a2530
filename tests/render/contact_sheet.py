"""A sheet of all pictures of a map: a row for each model, a column for each light and distance."""

import pathlib

import matplotlib
import numpy as np
from PIL import Image, ImageDraw, ImageFont

import measures

LABELS = 116  # pixels at the left
TITLES = 34  # pixels above
GAP = 2
ZOOM = 2  # pixels of the sheet for a pixel of a picture
GREYS = 16  # enough for the eye, and a third of the bytes of 256
FONT = ImageFont.truetype(str(pathlib.Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf"), 12)


def grey(radiance, covered, exposure):
    """As a screen shows it; where there is no surface, light."""
    levels = np.round(measures.shown(radiance, exposure) * (GREYS - 2)) * (255 / (GREYS - 1))
    tile = Image.fromarray(np.where(covered, levels, 255).astype(np.uint8))
    return tile.resize((ZOOM * tile.width, ZOOM * tile.height), Image.NEAREST)


def contact_sheet(comparison, path):
    """Draws every picture of a comparison."""
    models = [*comparison.references, *comparison.models]
    columns = [(light, distance) for light in comparison.lights for distance in comparison.distances]
    side = ZOOM * comparison.gallery.size
    sheet = Image.new("L", (LABELS + len(columns) * (side + GAP), TITLES + len(models) * (side + GAP)), 255)
    draw = ImageDraw.Draw(sheet)
    for c, (light, distance) in enumerate(columns):
        left = LABELS + c * (side + GAP)
        draw.text(
            (left + side // 2, 2), f"light {light:g}°\ndistance {distance:g}", fill=0, font=FONT, anchor="ma", align="center"
        )
        exposure = comparison.exposure(light)
        for r, model in enumerate(models):
            picture = comparison.pictures[model, distance]
            tile = grey(picture.radiance[comparison.lights.index(light)], picture.covered, exposure)
            sheet.paste(tile, (left, TITLES + r * (side + GAP)))
    for r, model in enumerate(models):
        draw.text(
            (LABELS - 6, TITLES + r * (side + GAP) + side // 2),
            model.replace(", ", ",\n"),
            fill=0,
            font=FONT,
            anchor="rm",
            align="right",
        )
    sheet.quantize(GREYS).save(path, optimize=True)
