"""Writes properties.schema.json: the properties of glint-info, which are the attributes of formats/schema.json.

A value for each level makes a row of the table `levels`, under its name without "level_". `--check` changes nothing, and fails
if the file is not the one that would be written.
"""

import argparse
import json
import pathlib
import sys

HERE = pathlib.Path(__file__).parent
F32_SMALLEST = 2.0**-126  # formats/schema.json writes "above 0" so
F32_LARGEST = (2 - 2.0**-23) * 2.0**127


def value_schema(attribute):
    """The schema of one value: its type, and texts or numbers that it may be."""
    if attribute["type"] == "text":
        return {"type": "string"} | ({"enum": attribute["values"].split("|")} if "values" in attribute else {})
    low, high = attribute["range"]
    if attribute["type"] == "i32":
        return {"type": "integer", "minimum": int(low), "maximum": int(high)}
    lower = {"exclusiveMinimum": 0} if low == F32_SMALLEST else {"minimum": low}
    return {"type": "number"} | lower | ({} if high == F32_LARGEST else {"maximum": high})


def property_schema(attribute):
    """The schema of a property: a value, a covariance, or a list of as many values as the attribute has."""
    units = "" if attribute["type"] == "text" or attribute["units"] == "1" else f" ({attribute['units']})"
    described = {"description": attribute["long_name"][:1].upper() + attribute["long_name"][1:] + units + "."}
    if attribute["name"].endswith("_covariance"):
        return described | {"$ref": "common.schema.json#/$defs/covariance"}
    count = attribute.get("count", "")
    if not count or count == "level_count":
        return described | value_schema(attribute)
    return described | {"type": "array", "items": value_schema(attribute), "minItems": int(count), "maxItems": int(count)}


def closed_object(description, attributes, names):
    """An object of these attributes and of no others. Attributes of later minor versions may be missing, and those that files may lack."""
    required = [
        name
        for name, attribute in zip(names, attributes)
        if attribute.get("required", True) and attribute.get("since_minor", 0) == 0
    ]
    return {
        "description": description,
        "type": "object",
        "properties": dict(zip(names, map(property_schema, attributes))),
        "required": required,
        "additionalProperties": False,
    }


def kind_schema(kind):
    """The schema of the properties of a kind."""
    single = [attribute for attribute in kind["attributes"] if attribute.get("count") != "level_count"]
    of_levels = [attribute for attribute in kind["attributes"] if attribute.get("count") == "level_count"]
    schema = closed_object(kind["title"] + ".", single, [attribute["name"] for attribute in single])
    if of_levels:
        most = next(int(attribute["range"][1]) for attribute in single if attribute["name"] == "level_count")
        row = closed_object("One level.", of_levels, [attribute["name"].removeprefix("level_") for attribute in of_levels])
        schema["properties"]["levels"] = {
            "description": "Each level.",
            "type": "array",
            "items": row,
            "minItems": 1,
            "maxItems": most,
        }
        schema["required"].append("levels")
    return schema


def properties_schema(kinds):
    """The schema of an object whose `kind` says what its `properties` are."""
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Properties of an asset, by kind",
        "description": "Made by properties.py from formats/schema.json.",
        "properties": {"kind": {"enum": [kind["kind"] for kind in kinds]}},
        "allOf": [
            {
                "if": {"properties": {"kind": {"const": kind["kind"]}}},
                "then": {"properties": {"properties": {"$ref": f"#/$defs/{kind['kind']}"}}},
            }
            for kind in kinds
        ],
        "$defs": {kind["kind"]: kind_schema(kind) for kind in kinds},
    }


def main():
    """Checks or writes the schema. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="change nothing; exit with 1 if the file differs")
    parser.add_argument("--schema", type=pathlib.Path, default=HERE.parents[1] / "formats/schema.json")
    parser.add_argument("--output", type=pathlib.Path, default=HERE / "properties.schema.json")
    options = parser.parse_args()
    text = json.dumps(properties_schema(json.loads(options.schema.read_text(encoding="utf-8"))["kinds"]), indent=1) + "\n"
    if not options.check:
        options.output.write_text(text, encoding="utf-8")
    elif options.output.read_text(encoding="utf-8") != text:
        print(f"{options.output}: differs from {options.schema}: run {pathlib.Path(__file__).name}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
