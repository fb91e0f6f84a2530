"""Writes the tables of SPEC.md that list what schema.json holds: kinds, attributes, sizes and datasets.

A table stands between the lines `<!-- NAME, made by spec_tables.py -->` and `<!-- end -->`. `--check` changes nothing, and
fails if a table is not the schema's.
"""

import argparse
import itertools
import json
import pathlib
import re
import sys

HERE = pathlib.Path(__file__).parent
TABLE = re.compile(r"^<!-- ([^\n]+), made by spec_tables\.py -->\n(.*?)^<!-- end -->$", re.MULTILINE | re.DOTALL)
BLOCK = "<!-- {name}, made by spec_tables.py -->\n\n{table}\n\n<!-- end -->"
F32_SMALLEST = 2.0**-126  # the smallest positive normal number of f32: schema.json writes "above 0" so
F32_LARGEST = (2 - 2.0**-23) * 2.0**127


def code(text):
    """The text as Markdown writes names."""
    return f"`{text}`"


def alternatives(texts):
    """`a`, `b` or `c`."""
    *others, last = map(code, texts)
    return f"{', '.join(others)} or {last}" if others else last


def number(value):
    """A bound as people write it: large powers of 2 and 10 as powers."""
    if value >= 2**16 and value == int(value) and int(value).bit_count() == 1:
        return f"2^{int(value).bit_length() - 1}"
    text = re.sub(r"e\+0*", "e", f"{value:g}")
    return text if float(text) == value else repr(value)


def valid_values(attribute):
    """Texts or numbers that an attribute may have; nothing if any text will do."""
    if "range" not in attribute:
        return alternatives(attribute["values"].split("|")) if "values" in attribute else ""
    low, high = attribute["range"]
    if low != F32_SMALLEST and high != F32_LARGEST:
        return f"{number(low)} to {number(high)}"
    lower = "> 0" if low == F32_SMALLEST else f">= {number(low)}"
    return f"{lower}, finite" if high == F32_LARGEST else f"{lower}, at most {number(high)}"


def condition(when):
    """The condition of a type, "a=x|y & b=z", in words."""
    terms = [term.strip().split("=") for term in when.split("&")]
    return " and ".join(f"{code(name)} is {alternatives(values.split('|'))}" for name, values in terms)


def element_type(types):
    """The type of a dataset, with the attribute that it depends on."""
    whens = [choice.get("when", "") for choice in types]
    names = {when.partition("=")[0] for when in whens}
    if len(names) == 1 and all(when == f"{name}={choice['type']}" for name in names for when, choice in zip(whens, types)):
        return f"{alternatives(choice['type'] for choice in types)}, named by {code(*names)}"
    texts = [code(choice["type"]) + (f" if {condition(when)}" if when else "") for when, choice in zip(whens, types)]
    return "; else ".join(texts)


def table(columns, rows):
    """A table in Markdown, without the columns that are empty in every row."""
    kept = [k for k in range(len(columns)) if any(row[k] for row in rows)]
    lines = ["| " + " | ".join(line[k].replace("|", r"\|") for k in kept) + " |" for line in (columns, *rows)]
    return "\n".join([lines[0], "|" + "---|" * len(kept), *lines[1:]])


def version(schema, entry):
    """The version that added an attribute or dataset; nothing for the first version."""
    return f"{schema['format_major']}.{entry['since_minor']}" if entry.get("since_minor", 0) > 0 else ""


def presence(entry):
    """What follows the name of an attribute or dataset that files may lack."""
    if "needs" in entry:
        return f" (with {code(entry['needs'])})"
    return "" if entry.get("required", True) else " (MAY be absent)"


def attribute_table(schema, attributes):
    """A table of attributes. Texts have no units."""
    rows = []
    for attribute in attributes:
        count = f"[{attribute['count']}]" if "count" in attribute else ""
        units = "" if attribute["type"] == "text" else attribute["units"]
        rows.append(
            [
                code(attribute["name"]) + presence(attribute),
                code(attribute["type"] + count),
                valid_values(attribute),
                units,
                attribute["long_name"],
                version(schema, attribute),
            ]
        )
    return table(["attribute", "type", "value", "units", "meaning", "since"], rows)


def dataset_row(schema, dataset):
    """The row of a dataset, or of the datasets of all levels."""
    path = code(dataset["path"].replace("{l}", "LL")) + presence(dataset)
    size = code("".join(f"[{size}]" for size in dataset["dims"]))
    return [path, element_type(dataset["types"]), size, dataset["units"], dataset["long_name"], version(schema, dataset)]


def dataset_tables(schema, datasets):
    """A table for each run of datasets that are there once, or for the same levels."""
    parts = []
    for levels, group in itertools.groupby(datasets, lambda dataset: dataset.get("repeat")):
        if levels:
            parts.append(f"For every l with 0 <= l < {code(levels)}:")
        columns = ["dataset", "type", "size", "units", "meaning", "since"]
        parts.append(table(columns, [dataset_row(schema, dataset) for dataset in group]))
    return "\n\n".join(parts)


def schema_tables(schema):
    """All tables by name."""
    tables = {
        "kinds": table(["kind", "what it is"], [[code(kind["kind"]), kind["title"]] for kind in schema["kinds"]]),
        "root attributes": attribute_table(schema, schema["root_attributes"]),
        "dataset attributes": attribute_table(schema, schema["dataset_attributes"]),
    }
    for kind in schema["kinds"]:
        tables[f"attributes of {kind['kind']}"] = attribute_table(schema, kind["attributes"])
        if kind["derived"]:
            rows = [[code(size["name"]), code(size["expression"]), size["long_name"]] for size in kind["derived"]]
            tables[f"sizes of {kind['kind']}"] = table(["size", "value", "meaning"], rows)
        tables[f"datasets of {kind['kind']}"] = dataset_tables(schema, kind["datasets"])
    return tables


def misplaced(names, tables):
    """What is wrong with the names of the tables between markers."""
    return (
        [f"has no table '{name}': add its two marker lines" for name in tables if name not in names]
        + [f"has a table '{name}' that the schema does not have: remove it" for name in names if name not in tables]
        + [f"has the table '{name}' twice: remove one" for name in sorted(set(names)) if names.count(name) > 1]
    )


def main():
    """Checks or writes the tables. Returns the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--check", action="store_true", help="change nothing; exit with 1 if a table is not the schema's")
    parser.add_argument("--schema", type=pathlib.Path, default=HERE / "schema.json")
    parser.add_argument("--spec", type=pathlib.Path, default=HERE / "SPEC.md")
    options = parser.parse_args()
    tables = schema_tables(json.loads(options.schema.read_text(encoding="utf-8")))
    spec = options.spec.read_text(encoding="utf-8")
    found = {match[1]: match[0] for match in TABLE.finditer(spec)}
    wanted = {name: BLOCK.format(name=name, table=text) for name, text in tables.items()}
    problems = misplaced([match[1] for match in TABLE.finditer(spec)], tables)
    if options.check:
        problems += [
            f"has a table '{name}' that differs from the schema: run formats/spec_tables.py"
            for name in wanted
            if name in found and found[name] != wanted[name]
        ]
    elif not problems:
        options.spec.write_text(TABLE.sub(lambda match: wanted[match[1]], spec), encoding="utf-8")
    for problem in problems:
        print(f"{options.spec}: {problem}", file=sys.stderr)
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
