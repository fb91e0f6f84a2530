"""One surface at five distances: a pixel sees from one texel of the map to hundreds (Deng 2022; Xing 2024)."""

import ball

WIDTHS_CM = (0.35, 1.0, 4.0, 11.0, 30.0)


def draw(gallery):
    size, spp = gallery.scaled((208, 208), 16)
    sheet = {}
    for width in WIDTHS_CM:
        texels = width / size[0] / (ball.TEXEL_UM * 1e-4)
        title = f"{10 * width:g} mm: {texels:.1f} texels a pixel"
        sheet[title] = gallery.render(f"zoom, {10 * width:g} mm", ball.scene(gallery.kit, width, size, spp))
    gallery.sheet(
        "zoom",
        sheet,
        columns=len(sheet),
        title="Five distances",
        method="pyramid, and the map's own normals below its finest level",
        alt="One ball of flakes at five distances: single flakes, a field of glints, glints over the highlight, and a small ball that still sparkles",
        text="One ball and one asset, magnified up to 86 times. Near, single flakes are seen; far away, thousands lie under each pixel and sparkle "
        "still. Titles say how wide the picture is, and how many texels a pixel sees.",
    )
