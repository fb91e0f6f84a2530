"""Pictures as files: sheets with titles, insets, animations. Pixels are sRGB, 0..1, [height][width][3], top row first."""

import io

import numpy as np
import PIL.Image
import PIL.ImageDraw
import PIL.ImageFont

TITLE_PIXELS = 15
GAP = 4
PAPER = (255, 255, 255)
INK = (40, 40, 40)
JPEG_QUALITY = 88
JPEG_FROM_BYTES = 250_000  # documents show a larger PNG as JPEG


def to_image(pixels):
    return PIL.Image.fromarray(np.round(255 * np.clip(pixels, 0, 1)).astype(np.uint8))


def save(pixels, path):
    (pixels if isinstance(pixels, PIL.Image.Image) else to_image(pixels)).save(path, optimize=True)


def font(size=TITLE_PIXELS):
    return PIL.ImageFont.load_default(size)


def sheet(titled, columns, notes):
    """Pictures of one size in rows, each with its title above and perhaps a note in its lower corner."""
    images = {title: to_image(pixels) for title, pixels in titled.items()}
    width, height = next(iter(images.values())).size
    strip = TITLE_PIXELS + 10
    rows = -(-len(images) // columns)
    page = PIL.Image.new("RGB", (columns * (width + GAP) - GAP, rows * (height + strip + GAP) - GAP), PAPER)
    draw = PIL.ImageDraw.Draw(page)
    for index, (title, image) in enumerate(images.items()):
        x, y = index % columns * (width + GAP), index // columns * (height + strip + GAP)
        draw.text((x + width / 2, y + strip / 2), title, INK, font(), anchor="mm")
        page.paste(image, (x, y + strip))
        if title in notes:
            draw.multiline_text(
                (x + width - 6, y + strip + height - 6),
                notes[title],
                (255, 255, 255),
                font(13),
                anchor="rd",
                align="right",
                stroke_width=2,
                stroke_fill=(0, 0, 0),
            )
    return page


def framed(pixels, frame):
    """A picture with a frame round a part of it: (left, top, width, height) in pixels."""
    page = to_image(pixels)
    left, top, width, height = frame
    PIL.ImageDraw.Draw(page).rectangle((left - 1, top - 1, left + width, top + height), outline=(255, 255, 255))
    return np.asarray(page) / 255


def with_inset(pixels, detail, frame, corner):
    """A picture with a detail of it, rendered larger, in a corner.

    @param frame   (left, top, width, height) of the detail in the picture
    @param corner  of the detail: 1 is right, 1 is below
    """
    page, piece = to_image(pixels), to_image(detail)
    draw = PIL.ImageDraw.Draw(page)
    margin = 12
    x, y = (
        (room - margin if side else margin)
        for room, side in zip((page.width - piece.width, page.height - piece.height), corner)
    )
    left, top, width, height = frame
    draw.rectangle((left, top, left + width, top + height), outline=(255, 255, 255), width=2)
    draw.rectangle((x - 2, y - 2, x + piece.width + 1, y + piece.height + 1), fill=(255, 255, 255))
    page.paste(piece, (x, y))
    return page


def animation(frames, path, milliseconds=80):
    """An animated PNG or GIF, as the name says, that runs for ever."""
    images = [to_image(frame) for frame in frames]
    if path.suffix == ".gif":
        # One palette for all frames: colours must not change between them.
        tall = PIL.Image.new("RGB", (images[0].width, images[0].height * len(images)))
        for index, image in enumerate(images):
            tall.paste(image, (0, index * image.height))
        palette = tall.quantize(128)
        images = [image.quantize(palette=palette, dither=PIL.Image.Dither.NONE) for image in images]
    images[0].save(path, save_all=True, append_images=images[1:], duration=milliseconds, loop=0, optimize=True)


def for_documents(path, folder):
    """Copies a picture, as JPEG if it is large."""
    if path.suffix == ".gif" or path.stat().st_size < JPEG_FROM_BYTES:
        copy = folder / path.name
        copy.write_bytes(path.read_bytes())
    else:
        copy = folder / f"{path.stem}.jpg"
        PIL.Image.open(path).convert("RGB").save(copy, quality=JPEG_QUALITY, optimize=True, progressive=True)
    return copy
