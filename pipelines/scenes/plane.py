"""A small map that repeats, and endless planes of Wang tiles that are cut from the same map (Deng 2022, section 5.5)."""

import dataclasses

import bent_quad

MAP = bent_quad.MAPS["flakes"][0] | {"flake_size": 12}
SIZE = 512  # texels: small enough to be seen repeating
TILE = 128  # texels
COUNTS = (16, 64)
STRIDE = 16  # of all pyramids, texels
FOV = 26.0  # degrees: the map repeats some thirty times across the picture


def prepared(kit, count):
    """The map that is as wide as the asset's uv, and the asset: of so many tiles, or 0: of the map itself."""
    of = kit.map(**MAP, size=SIZE, texel_um=bent_quad.TEXEL_UM)
    if count == 0:
        return of, of.pyramid(STRIDE)
    tiles = of.made("wang", f"wang{count}", "--size", TILE, "--tiles", count, "--boundary", "wrap")
    asset = of.made(
        "pyramid", f"plane{count}", "--stride", STRIDE, "--sigma-r", of.sigma_r, "--resolution", "auto", source=tiles
    )
    return dataclasses.replace(of, size=TILE), asset


def scene(kit, count=COUNTS[0], size=(400, 360), spp=64):
    return bent_quad.sheet(kit, *prepared(kit, count), size, spp, fov=FOV)


def draw(gallery):
    kit = gallery.kit
    sheet, notes = {}, {}
    for count in (0, *COUNTS):
        title = f"{count} tiles of the map" if count else "the map, repeated"
        sheet[title] = gallery.render(f"plane, {title}", scene(kit, count, *gallery.scaled((400, 360), 16)))
        notes[title] = f"{prepared(kit, count)[1].stat().st_size / 1e6:.0f} MB, {sheet[title].seconds:.0f} s"
    gallery.sheet(
        "plane",
        sheet,
        columns=3,
        notes=notes,
        title="A plane without end",
        method="pyramids of the map and of its tiles",
        alt="A bent sheet of flakes, three times: sparkles in a lattice; patches of a lattice; sparkles without order",
        text=f"A map of {SIZE} x {SIZE} texels repeats some thirty times across the sheet, and its brightest flakes make a lattice. Tiles of {TILE} x {TILE} "
        "texels are cut from the same map, and each cell of the plane takes one by a hash of its corners. Of 16 tiles, one for each combination of "
        "two colours at four corners, the same tile often lies beside itself. Of 64, four for each combination, it seldom does. Notes give the "
        "size of the asset and the processor time of the rendering.",
    )
