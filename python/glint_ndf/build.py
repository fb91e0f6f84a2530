"""Builders: the work of the command-line tools, from arrays and assets, without files of one's own.

Every builder takes `threads` (0: all cores) and `progress`, a function that is called with the units of work that are done and the
total. Results do not depend on the number of threads. Errors are those of the tools.
"""

from __future__ import annotations

import json
import os
from typing import Any, Callable, Sequence

import numpy as np

from . import _glint
from .assets import Asset, PathLike, temporary_file
from .errors import ArgumentError

Progress = Callable[[int, int], None]


def _made(
    function: str,
    options: dict[str, Any],
    source: Asset | np.ndarray | None,
    threads: int,
    progress: Progress | None,
    *arrays: np.ndarray | str,
) -> Asset:
    """Runs a builder of the extension module into a temporary file."""
    options = {name: _checked(name, value) for name, value in options.items()}
    threads = _checked("threads", threads, least=0)
    asset = Asset.__new__(Asset)
    path = temporary_file(asset)
    command = json.dumps({"function": function, **options}, sort_keys=True)
    if isinstance(source, Asset):
        job = _glint.BuildJob(path, command, source.path, source.kind, "", threads, progress)
    elif source is not None:
        job = _glint.BuildJob(path, command, "", "array", _glint.hash_array(source), threads, progress)
    else:
        job = _glint.BuildJob(path, command, "", "", "", threads, progress)
    try:
        report = getattr(_glint, function)(job, *arrays, **options)
    except TypeError as error:
        broken = [name for name, value in options.items() if isinstance(value, float) and value != int(value)]
        raise ArgumentError(f"{', '.join(broken) or function}: must be whole numbers, or of another type") from error
    asset.__init__(path, report)
    return asset


def _checked(name: str, value: Any, least: int = -(2**31)) -> Any:
    """A number as Python has it. Whole numbers must fit the library's: 32 bits, seeds 64."""
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, int) and not isinstance(value, bool):
        low, high = (0, 2**64) if name == "seed" else (least, 2**31)
        if not low <= value < high:
            raise ArgumentError(f"{name}: {value} is out of range; give {low} to {high - 1}")
    return value


def _expect(asset: Asset, name: str) -> Asset:
    if not isinstance(asset, Asset):
        raise ArgumentError(
            f"{name}: is of type {type(asset).__name__}; give an Asset, from a builder or from glint_ndf.load(path)"
        )
    return asset


def ingest(
    image,
    *,
    kind: str = "normal",
    to: str = "normals",
    convention: str = "opengl",
    encoding: str = "auto",
    dequantize: str = "auto",
    boundary: str = "wrap",
    fix_invalid: bool = False,
    allow_constant: bool = False,
    height_scale: float = 1.0,
    no_data: float | None = None,
    texel_size_um: float = 0.0,
    seed: int = 1,
    bottom_row_first: bool = False,
) -> Asset:
    """Makes an asset of kind normals or heights of an image in memory, as ``glint-ingest`` does of a file.

    Args:
        image: [height][width] or [height][width][channels], the top row first as image libraries have it; uint8, uint16 or floats.
        kind: "normal" or "height": what the image holds.
        to: "normals" or "heights". Normals of heights are central differences.
        convention: "opengl": green is up; "directx": green is down.
        encoding: "auto", "unorm" (0 to 1 means -1 to 1) or "snorm".
        dequantize: "auto", "none" or "tpdf": noise that hides the steps of integers.
        boundary: "wrap" or "clamp": slopes of heights at the border.
        fix_invalid: replace texels that cannot be used by the mean of their neighbours.
        allow_constant: accept a map of one value.
        height_scale: height, in texels, of a value of 1 (of integers: of the largest code).
        no_data: number that marks texels without data.
        texel_size_um: size of a texel; 0: unknown.
        bottom_row_first: the image is in the order of `Asset.texels`.

    Returns:
        An asset whose `report` counts the texels that were repaired.

    Raises:
        InvalidInputError: the image holds something else; see ``glint-ingest --help``.
    """
    pixels = np.asarray(image)
    if pixels.ndim == 2:
        pixels = pixels[..., np.newaxis]
    if pixels.ndim != 3 or pixels.size == 0:
        raise ArgumentError(f"image: the shape must be [height][width] or [height][width][channels], and is {pixels.shape}")
    pixels = pixels.astype(pixels.dtype.newbyteorder("="), copy=False)
    if pixels.dtype not in (np.uint8, np.uint16):
        if not (np.issubdtype(pixels.dtype, np.floating)):
            raise ArgumentError(f"image: of type {pixels.dtype}; give uint8, uint16 or floats")
        pixels = pixels.astype(np.float32, copy=False)
    pixels = np.ascontiguousarray(pixels if bottom_row_first else pixels[::-1])
    options = dict(
        kind=kind,
        to=to,
        convention=convention,
        encoding=encoding,
        dequantize=dequantize,
        boundary=boundary,
        fix_invalid=fix_invalid,
        allow_constant=allow_constant,
        height_scale=height_scale,
        no_data=no_data,
        seed=seed,
        texel_size_um=texel_size_um,
    )
    return _made("ingest", options, pixels, 0, None, pixels)


def synth(
    kind: str,
    width: int = 512,
    height: int | None = None,
    *,
    seed: int = 1,
    heights: bool = False,
    texel_size_um: float = 0.0,
    alpha: float | None = None,
    gamma: float | None = None,
    correlation: float | None = None,
    streak: float | None = None,
    feature: float | None = None,
    density: float | None = None,
    slope: float | None = None,
    depth: float | None = None,
    profile: str | None = None,
    flake_size_uv: float | None = None,
    roughness: float | None = None,
    coverage: float | None = None,
) -> Asset:
    """Makes a periodic procedural map, as ``glint-synth``. Options that are None have values typical of the kind.

    Args:
        kind: "isotropic", "anisotropic", "brushed", "flakes", "scratches", "leather", "bumps", "scales", "relief", "structured",
            "wood", "weave", "twill", "silk", "sawtooth", "grating", "flat" or "flake2d".
        heights: make an asset of kind heights instead of normals.
        alpha: Beckmann roughness of the noise, or roughness of the flakes.
        gamma: exponent of the distribution of flakes.
        correlation, streak, feature: lengths in texels. density: scratches in a square of 64 x 64 texels. slope: steepest slope.
        depth: from the lowest to the highest point, texels.
        profile: of a grating, "sine" or "blazed".
        flake_size_uv, roughness, coverage: of flake2d, as MaterialX's node has them; the size in widths of the map.
    """
    numbers = dict(
        alpha=alpha,
        gamma=gamma,
        correlation=correlation,
        streak=streak,
        feature=feature,
        density=density,
        slope=slope,
        depth=depth,
        flake_size_uv=flake_size_uv,
        roughness=roughness,
        coverage=coverage,
    )
    given = {name: _number(name, value) for name, value in numbers.items() if value is not None}
    if profile is not None:
        given["profile"] = profile
    options = dict(
        kind=kind,
        width=width,
        height=width if height is None else height,
        seed=seed,
        heights=heights,
        texel_size_um=texel_size_um,
        given=given,
    )
    return _made("synth", options, None, 0, None)


def pyramid(
    normals: Asset,
    *,
    stride: float = 32.0,
    overlap: float = 2**0.5,
    resolution: int | str = 256,
    sigma_r: float = 0.005,
    surface: str = "flat",
    boundary: str = "wrap",
    levels: int | str = "auto",
    precision: str = "half",
    keep_normals: str = "none",
    threads: int = 0,
    progress: Progress | None = None,
) -> Asset:
    """Computes the NDF images of footprints of every size and position (Deng 2022, section 4.1), as ``glint-pyramid``.

    Args:
        normals: asset of kind normals.
        stride: of the finest level, texels. Its footprints have a deviation of 0.433 strides.
        overlap: footprints in a stride along each axis, 1 to 4.
        resolution: pixels of an NDF image along each axis, a multiple of 16 from 32 to 1024, or "auto".
        sigma_r: intrinsic roughness, disk units.
        levels: levels besides the mean of the map, or "auto".
        precision: "half" or "float", of stored pixels.
        keep_normals: "i16" or "f32": the asset keeps the normals of the map, which answer footprints below the finest level;
            "none": it does not. `compress` keeps what its pyramid keeps.
    """
    options = dict(
        stride=stride,
        overlap=overlap,
        resolution=_auto("resolution", resolution),
        sigma_r=sigma_r,
        surface=surface,
        boundary=boundary,
        levels=_auto("levels", levels),
        precision=precision,
        keep_normals=keep_normals,
    )
    return _made("pyramid", options, _expect(normals, "normals"), threads, progress)


def wave_pyramid(
    heights: Asset,
    *,
    stride: float = 32.0,
    overlap: float = 2**0.5,
    resolution: int = 256,
    levels: int | str = "auto",
    precision: str = "half",
    coherence_um: float = 10.0,
    wavelengths: int | Sequence[float] = 8,
    spectral: bool = False,
    threads: int = 0,
    progress: Progress | None = None,
) -> Asset:
    """Computes NDF images under wave optics (Deng 2022, Eq. 3 and 4), as ``glint-pyramid --optics wave``.

    Args:
        heights: asset of kind heights, with a texel size.
        coherence_um: deviation of the coherence area.
        wavelengths: a number of wavelengths over the visible range, or a rising list of them in micrometres.
        spectral: a channel for each wavelength instead of X, Y and Z.
    """
    waves = (
        _glint.even_wavelengths(wavelengths) if isinstance(wavelengths, (int, np.integer)) else [float(w) for w in wavelengths]
    )
    options = dict(
        stride=stride,
        overlap=overlap,
        resolution=resolution,
        levels=_auto("levels", levels),
        precision=precision,
        coherence_um=coherence_um,
        wavelengths_um=waves,
        spectral=spectral,
    )
    return _made("wave_pyramid", options, _expect(heights, "heights"), threads, progress)


def compress(
    ndf_pyramid: Asset,
    *,
    method: str = "auto",
    rank: int | None = None,
    tolerance: float | None = None,
    metric: str = "seen",
    quantize: str = "auto",
    spots: bool = True,
    regions: int | str = "auto",
    min_improvement: float = 1e-4,
    max_iterations: int = 500,
    keep_normals: str = "auto",
    normals: Asset | None = None,
    threads: int = 0,
    progress: Progress | None = None,
) -> Asset:
    """Compresses a pyramid (Deng 2022, section 4.2), as ``glint-compress``.

    Args:
        ndf_pyramid: asset of kind ndf-pyramid or wave-pyramid; the latter keeps no normals.
        method: "tucker", "pca" or "cp" (the paper's); "auto": tucker, and pca where tucker cannot meet a tolerance.
        rank: columns of every cluster, 1 to 256; 16 unless there is a tolerance.
        tolerance: instead of `rank`: largest error in `metric`; columns and bits are chosen to meet it in few bytes.
        metric: "seen": what a person sees towards each half vector, in every level; "l2": the error of all images together.
        keep_normals: normals of the map in the asset, for footprints below the finest level: "none", "i16" or "f32"; "auto": those that
            the pyramid keeps, or those of `normals` in 16 bits.
        normals: the asset of kind normals that the pyramid was made from, to keep its normals where the pyramid keeps none.

    Returns:
        An asset whose `report` has the errors ("seen", "seen_worst", "bias", "rel_l2") and "total_bytes".

    Raises:
        FailedError: the tolerance cannot be reached; the error names the smallest that can.
    """
    if rank is not None and tolerance is not None:
        raise ArgumentError("rank and tolerance: both are given; give one of them")
    options = dict(
        method=method,
        rank=16 if rank is None else rank,
        tolerance=0.0 if tolerance is None else tolerance,
        metric=metric,
        quantize=quantize,
        spots=spots,
        regions=_auto("regions", regions),
        min_improvement=min_improvement,
        max_iterations=max_iterations,
        keep_normals=keep_normals,
    )
    of_texels = "" if normals is None else _expect(normals, "normals").path
    return _made("compress", options, _expect(ndf_pyramid, "ndf_pyramid"), threads, progress, of_texels)


def bin_map(
    normals: Asset,
    *,
    alpha: float = 0.0070710678,
    alpha_max: float = 0.0,
    leaf_size: int = 16,
    threads: int = 0,
    progress: Progress | None = None,
) -> Asset:
    """Lists the texels of a map by the direction of their normals (Atanasov 2021), as ``glint-binmap``.

    Args:
        alpha: Beckmann roughness of the facets; the smallest, if there is a range. The default is that of sigma_r = 0.005.
        alpha_max: largest roughness that a query may ask for; 0: `alpha`.
    """
    options = dict(alpha=alpha, alpha_max=alpha_max, leaf_size=leaf_size)
    return _made("bin_map", options, _expect(normals, "normals"), threads, progress)


def histogram(
    normals: Asset,
    *,
    theta_bins: int = 9,
    phi_bins: int = 32,
    stride: int = 8,
    threads: int = 0,
    progress: Progress | None = None,
) -> Asset:
    """Accumulates histograms of normals (Gamboa 2018, section 4.1), as ``glint-sat``."""
    options = dict(theta_bins=theta_bins, phi_bins=phi_bins, stride=stride)
    return _made("histogram", options, _expect(normals, "normals"), threads, progress)


def moments(
    map: Asset,
    *,
    finest_level: int = 1,
    boundary: str = "wrap",
    gradient: str = "central",
    threads: int = 0,
    progress: Progress | None = None,
) -> Asset:
    """Filters the moments of the slopes of a map of normals or heights (LEAN mapping), as ``glint-moments``."""
    options = dict(finest_level=finest_level, boundary=boundary, gradient=gradient)
    return _made("moments", options, _expect(map, "map"), threads, progress)


def displace(
    heights: Asset,
    *,
    factors: Sequence[int] = (16,),
    base: str = "diffuse",
    albedo: float = 0.8,
    alpha: float = 0.0,
    eta: float = 1.0,
    k: float = 0.0,
    table: PathLike | None = None,
    lobes: int = 6,
    angular: int = 15,
    spatial: int = 4,
    scale_tolerance: float = 0.0,
    bounces: int = 64,
    seed: int = 1,
    threads: int = 0,
    progress: Progress | None = None,
) -> Asset:
    """Downsamples a displacement map so that it looks the same from afar (Wu 2019), as ``glint-displace``.

    Args:
        heights: asset of kind heights.
        factors: texels along a side of a cell of each level: rising, at most the shorter side of the map.
        base: "diffuse" with `albedo`, "ggx" with roughness `alpha` and a conductor's `eta` and `k`, or "table".
        table: file of an isotropic BRDF in MERL's form, for the base "table". Values below 0, which mark bins without a
            measurement, count as black.
        scale_tolerance: terms are added to the scaling T S until they miss at most this part of it, or are eight; 0: T S alone.
    """
    if (base == "table") != (table is not None):
        raise ArgumentError('table: goes with base="table"; give both, or neither')
    options = dict(
        factors=list(factors),
        base=base,
        albedo=albedo,
        alpha=alpha,
        eta=eta,
        k=k,
        lobes=lobes,
        angular=angular,
        spatial=spatial,
        scale_tolerance=scale_tolerance,
        bounces=bounces,
        seed=seed,
    )
    path = "" if table is None else os.fspath(table)
    return _made("displace", options, _expect(heights, "heights"), threads, progress, path)


def _auto(name: str, value: int | str) -> int:
    """A number, or 0 for "auto"."""
    if value == "auto":
        return 0
    if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < 1:
        raise ArgumentError(f'{name}: {value!r} is no number above 0; give "auto", or 1 or more')
    return int(value)


def _number(name: str, value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        raise ArgumentError(f"{name}: {value!r} is no number") from None
