"""Descriptions of materials: one JSON file that says which asset lies on a surface, how, and between which layers.

The schema is `material.schema.json` beside this file. Renderers read the same file: the Mitsuba BSDF `glint` takes it as its
parameter `description`.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

from .errors import FileError, InvalidInputError

#: Version of the descriptions that this package reads.
VERSION = 1

_SCHEMA = Path(__file__).with_name("material.schema.json")

#: Parameters of the Mitsuba BSDF for the members of "asset", "placement" and "facets".
_ASSET = ("normals", "sigma_r", "alpha", "surface", "boundary", "interpolation", "pixels", "variant")
_PLACEMENT = ("uv_scale", "texels_per_unit", "rotation")
_OPTICS = ("material", "eta", "k", "specular_reflectance")


def schema() -> dict[str, Any]:
    """The JSON Schema of descriptions."""
    return json.loads(_SCHEMA.read_text(encoding="utf-8"))


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """A description, checked against the schema.

    Raises:
        FileError: the file cannot be read.
        InvalidInputError: it is no JSON, or breaks the schema: the message says where.
    """
    name = os.fspath(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except OSError as error:
        raise FileError(f"{name}: cannot be read: {error.strerror or error}", path=name) from error
    except UnicodeDecodeError as error:
        raise InvalidInputError(f"{name}: is no text in UTF-8: {error}", path=name) from error
    try:
        description = json.loads(text)
    except json.JSONDecodeError as error:
        raise InvalidInputError(f"{name}: is no JSON: {error}", path=name) from error
    _check(description, schema(), schema(), "", name)
    return description


def load(path: str | os.PathLike[str]) -> dict[str, Any]:
    """A description as a dictionary for Mitsuba's `mi.load_dict`. Files that it names are relative to its folder.

    Import `glint_ndf.mitsuba` before `mi.load_dict`. Raises as `read`.
    """
    return {"type": "glint", **parameters(read(path), Path(path).parent)}


def parameters(description: dict[str, Any], folder: str | os.PathLike[str] = ".") -> dict[str, Any]:
    """The parameters of the Mitsuba BSDF `glint` for a description that was checked."""
    folder = Path(folder)
    out = _of_asset(description["asset"], folder, "")
    out.update({name: description["placement"][name] for name in _PLACEMENT if name in description.get("placement", {})})
    optics = description.get("optics", {})
    out.update({name: _colour(optics[name]) for name in _OPTICS if name in optics})
    if "facets" in optics:
        out["facets"] = optics["facets"]
    layers = description.get("layers", {})
    if "coat" in layers:
        coat = layers["coat"]
        out["coat"] = coat["ior"]
        if "alpha" in coat:
            out["coat_alpha"] = coat["alpha"]
        if "asset" in coat:
            out.update(_of_asset(coat["asset"], folder, "coat_"))
            out.update({"coat_" + name: coat["placement"][name] for name in _PLACEMENT if name in coat.get("placement", {})})
    if "base" in layers:
        out["base"] = _base(layers["base"])
        out["transparency"] = _texture(layers["transparency"], folder)
    return out


def _of_asset(asset: dict[str, Any], folder: Path, prefix: str) -> dict[str, Any]:
    out = {prefix + "asset": str(folder / asset["file"])}
    for name in _ASSET:
        if name in asset:
            out[prefix + name] = str(folder / asset[name]) if name == "normals" else asset[name]
    return out


def _colour(value: Any) -> Any:
    return {"type": "rgb", "value": value} if isinstance(value, list) else value


def _texture(value: Any, folder: Path) -> Any:
    if not isinstance(value, str):
        return value
    return {"type": "bitmap", "filename": str(folder / value), "raw": True}


def _base(base: dict[str, Any]) -> dict[str, Any]:
    """A base: diffuse, or with a rough dielectric surface of its own where "alpha" is given."""
    if "alpha" not in base:
        return {"type": "diffuse", "reflectance": _colour(base["reflectance"])}
    return {
        "type": "roughplastic",
        "diffuse_reflectance": _colour(base["reflectance"]),
        "alpha": base["alpha"],
        "int_ior": base.get("ior", 1.5),
        "ext_ior": 1.0,
    }


def _check(value: Any, rule: dict[str, Any], root: dict[str, Any], where: str, name: str) -> None:
    """Checks a value against the part of JSON Schema that `material.schema.json` uses."""
    if "$ref" in rule:
        rule = root["$defs"][rule["$ref"].rsplit("/", 1)[-1]]
    if "oneOf" in rule:
        return _check_one(value, rule["oneOf"], root, where, name)
    place = where or "the description"
    if "const" in rule and value != rule["const"]:
        _refuse(name, place, f"must be {rule['const']!r}, and is {value!r}")
    if "enum" in rule and value not in rule["enum"]:
        _refuse(name, place, f"must be one of {', '.join(map(str, rule['enum']))}, and is {value!r}")
    if "type" in rule and not _is(value, rule["type"]):
        _refuse(name, place, f"must be of type {rule['type']}, and is {value!r}")
    if _is(value, "number"):
        _check_range(value, rule, place, name)
    if isinstance(value, list):
        if not rule.get("minItems", 0) <= len(value) <= rule.get("maxItems", len(value)):
            _refuse(name, place, f"must have {rule['minItems']} members, and has {len(value)}")
        for k, member in enumerate(value):
            _check(member, rule.get("items", {}), root, f"{where}[{k}]", name)
    if isinstance(value, dict):
        _check_members(value, rule, root, where, name)


def _check_one(value: Any, rules: list[dict[str, Any]], root: dict[str, Any], where: str, name: str) -> None:
    for rule in rules:
        if "type" not in rule or _is(value, rule["type"]):
            return _check(value, rule, root, where, name)
    _refuse(name, where, f"must be of type {' or '.join(rule['type'] for rule in rules)}, and is {value!r}")


def _check_range(value: float, rule: dict[str, Any], place: str, name: str) -> None:
    if value < rule.get("minimum", value) or value > rule.get("maximum", value):
        _refuse(name, place, f"must be from {rule.get('minimum', 'any')} to {rule.get('maximum', 'any')}, and is {value}")
    if "exclusiveMinimum" in rule and value <= rule["exclusiveMinimum"]:
        _refuse(name, place, f"must be above {rule['exclusiveMinimum']}, and is {value}")


def _check_members(value: dict[str, Any], rule: dict[str, Any], root: dict[str, Any], where: str, name: str) -> None:
    known = rule.get("properties", {})
    for member in rule.get("required", ()):
        if member not in value:
            _refuse(name, where or "the description", f"lacks '{member}'")
    for member, others in rule.get("dependentRequired", {}).items():
        for other in others:
            if member in value and other not in value:
                _refuse(name, where or "the description", f"has '{member}' and lacks '{other}'")
    excluded = rule.get("not", {}).get("required", ())
    if excluded and all(member in value for member in excluded):
        _refuse(
            name,
            where or "the description",
            f"has {' and '.join(map(repr, excluded))}, which exclude each other; give one of them",
        )
    for member, content in value.items():
        if member not in known:
            if rule.get("additionalProperties", True):
                continue
            _refuse(name, where or "the description", f"has an unknown member '{member}'. Known: {', '.join(sorted(known))}")
        _check(content, known[member], root, f"{where}.{member}" if where else member, name)


def _is(value: Any, kind: str) -> bool:
    if kind == "number":
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    if kind == "integer":
        return isinstance(value, int) and not isinstance(value, bool)
    return isinstance(value, {"object": dict, "array": list, "string": str, "boolean": bool}[kind])


def _refuse(name: str, place: str, message: str) -> None:
    raise InvalidInputError(f"{name}: {place} {message}", rule="material.schema", path=name)
