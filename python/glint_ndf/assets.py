"""Assets: files, and assets that were built in this process."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
import weakref
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import _glint
from .errors import ArgumentError, FileError

PathLike = str | os.PathLike[str]


@dataclass(frozen=True)
class Finding:
    """One broken rule at one place of a file."""

    rule: str
    severity: str  #: "error", "warning" or "info"
    object: str  #: path in the file
    message: str
    remedy: str


@dataclass(frozen=True)
class Validation:
    """What a check of one file found."""

    kind: str  #: empty if it could not be read
    findings: tuple[Finding, ...]

    @property
    def valid(self) -> bool:
        """Whether readers accept the file."""
        return all(f.severity != "error" for f in self.findings)


class Asset:
    """An asset: a file, or what a builder of this package made, which lives in a temporary file until `save`.

    Temporary files are in the folder that ``TMPDIR`` names, and go when the object does.
    """

    def __init__(self, path: PathLike, report: dict[str, Any] | None = None):
        self.path = os.fspath(path)  #: file of the asset
        self.report = report or {}  #: counts and errors that the builder found
        self.kind = _glint.kind_of(self.path)  #: such as ``"ndf-pyramid"``

    def save(self, path: PathLike, overwrite: bool = False) -> None:
        """Writes the asset to a file, which appears whole or not at all.

        Raises:
            FileError: the file exists and `overwrite` is false, or it cannot be written.
        """
        target = Path(path)
        if target.exists() and not overwrite:
            raise FileError(f"{target}: exists; give overwrite=True to replace it", path=str(target))
        _glint.copy_file(self.path, str(target), overwrite)

    def info(self) -> dict[str, Any]:
        """Kind, sizes, parts, provenance and statistics: the result of ``glint-info --json``."""
        return json.loads(_glint.summary(self.path))

    def texels(self) -> np.ndarray:
        """Kind normals: [height][width][2] float32 normals on the disk; kind heights: [height][width] float32 heights in texels.

        The bottom row comes first. A copy.
        """
        if self.kind not in ("normals", "heights"):
            raise ArgumentError(f"{self.path}: kind {self.kind} has no texels; take the asset of kind normals or heights")
        return _glint.texels(self.path)

    def open(self, **options):
        """The model that answers from this asset: `glint_ndf.open` with the same options."""
        from .ndf import open as open_ndf

        return open_ndf(self, **options)

    def __repr__(self) -> str:
        return f"<glint_ndf.Asset of kind {self.kind}, {os.path.getsize(self.path)} bytes>"


def temporary_file(owner: object, suffix: str = ".glint") -> str:
    """Name of a file in a new folder of its own, which goes with the object."""
    folder = tempfile.mkdtemp(prefix="glint-ndf-")
    weakref.finalize(owner, shutil.rmtree, folder, ignore_errors=True)
    return os.path.join(folder, "asset" + suffix)


def load(path: PathLike) -> Asset:
    """An asset that a file holds, to build from or to look at.

    Raises:
        FileError: the file cannot be opened.
        InvalidInputError: it breaks a rule of the format.
        UnsupportedError: it is of a newer version.
    """
    return Asset(path)


def save(asset: Asset, path: PathLike, overwrite: bool = False) -> None:
    """`Asset.save` as a function."""
    asset.save(path, overwrite)


def info(path: PathLike | Asset) -> dict[str, Any]:
    """What a file is: the result of ``glint-info --json``."""
    return json.loads(_glint.summary(path.path if isinstance(path, Asset) else os.fspath(path)))


def validate(path: PathLike | Asset, hashes: bool = True, data: bool = True) -> Validation:
    """Checks a file against every rule of the format, as ``glint-validate`` does. Broken files do not raise: see the findings.

    Args:
        hashes: compare every array with its hash.
        data: check values: finite, in the disk, integrals.
    """
    kind, findings = _glint.validate(path.path if isinstance(path, Asset) else os.fspath(path), hashes, data)
    return Validation(kind, tuple(Finding(*f) for f in findings))
