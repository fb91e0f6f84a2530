"""The tables of formats/SPEC.md are those of formats/schema.json."""

import json
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

FORMATS = pathlib.Path(__file__).parents[2] / "formats"


def run(folder, *arguments):
    command = [
        sys.executable,
        FORMATS / "spec_tables.py",
        "--schema",
        folder / "schema.json",
        "--spec",
        folder / "SPEC.md",
        *arguments,
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


@pytest.fixture
def copies(tmp_path):
    """A folder with copies of the committed schema and text."""
    for name in ("schema.json", "SPEC.md"):
        shutil.copy(FORMATS / name, tmp_path)
    return tmp_path


def change_schema(folder, change):
    path = folder / "schema.json"
    schema = json.loads(path.read_text())
    change({kind["kind"]: kind for kind in schema["kinds"]}, schema)
    path.write_text(json.dumps(schema))


def rows_of(spec, name):
    """Cells of the rows of a table below its headings, without the marks of code."""
    body = re.search(rf"^<!-- {name}, made by spec_tables\.py -->$(.*?)^<!-- end -->$", spec, re.MULTILINE | re.DOTALL)[1]
    rows = re.findall(r"^\| (.*) \|$", re.sub(r"^\|.*\n\|---.*$", "", body, flags=re.MULTILINE), re.MULTILINE)
    return [row.replace("`", "").split(" | ") for row in rows]


def test_the_committed_tables_are_those_of_the_schema():
    done = run(FORMATS, "--check")
    assert (done.returncode, done.stderr) == (0, "")


def test_every_entry_of_the_schema_has_a_row_with_its_meaning():
    schema, spec = json.loads((FORMATS / "schema.json").read_text()), (FORMATS / "SPEC.md").read_text()

    def check(table, entries, key):
        def presence(entry):
            return (
                f" (with {entry['needs']})" if "needs" in entry else "" if entry.get("required", True) else " (MAY be absent)"
            )

        expected = [(entry[key].replace("{l}", "LL") + presence(entry), entry["long_name"]) for entry in entries]
        assert [(row[0], row[-1]) for row in rows_of(spec, table)] == expected, table

    check("root attributes", schema["root_attributes"], "name")
    check("dataset attributes", schema["dataset_attributes"], "name")
    assert [row[0] for row in rows_of(spec, "kinds")] == [kind["kind"] for kind in schema["kinds"]]
    for kind in schema["kinds"]:
        check(f"attributes of {kind['kind']}", kind["attributes"], "name")
        check(f"datasets of {kind['kind']}", kind["datasets"], "path")
        if kind["derived"]:
            check(f"sizes of {kind['kind']}", kind["derived"], "name")


def test_tables_say_types_values_sizes_and_conditions():
    spec = (FORMATS / "SPEC.md").read_text()

    def row(table, name):
        return next(row[1:-1] for row in rows_of(spec, table) if row[0] == name)

    assert row("attributes of ndf-pyramid", "level_strides") == ["f32[level_count]", "> 0, at most 2^20", "texel"]
    assert row("attributes of ndf-pyramid", "value_scale") == ["f32", "> 0, finite", "1"]
    assert row("attributes of ndf-cp", "method") == ["text", "cp, tucker or pca", ""]
    assert row("datasets of ndf-pyramid", "level_LL/pixels") == [
        "f16 or f32, named by precision",
        "[stored_blocks][16][16]",
        "1",
    ]
    coefficients = "i8 if coefficient_type is i8; else f16 if coefficient_type is f16; else f32 if coefficient_type is f32"
    assert row("datasets of ndf-cp", "coefficients")[0] in (coefficients, "i8, f16 or f32, named by coefficient_type")
    assert "For every l with 0 <= l < `level_count * has_lobe_colors`:\n\n| dataset |" in spec


CHANGES = {
    "attributes of normals": lambda kinds, schema: kinds["normals"]["attributes"][0].update(range=[2.0, 1048576.0]),
    "sizes of ndf-cp": lambda kinds, schema: kinds["ndf-cp"]["derived"][1].update(expression="places"),
    "datasets of heights": lambda kinds, schema: kinds["heights"]["datasets"][0].update(since_minor=3),
    "datasets of sh-light": lambda kinds, schema: kinds["sh-light"]["datasets"][2]["types"].pop(),
    "kinds": lambda kinds, schema: kinds["sh-lobes"].update(title="Lobes"),
    "root attributes": lambda kinds, schema: schema["root_attributes"].pop(),
}


@pytest.mark.parametrize("table", CHANGES)
def test_another_schema_is_found_and_written(copies, table):
    change_schema(copies, CHANGES[table])
    before = (copies / "SPEC.md").read_text()
    done = run(copies, "--check")
    problem = f"has a table '{table}' that differs from the schema: run formats/spec_tables.py"
    assert (done.returncode, done.stderr) == (1, f"{copies / 'SPEC.md'}: {problem}\n")
    assert (copies / "SPEC.md").read_text() == before
    assert run(copies).returncode == 0
    assert (copies / "SPEC.md").read_text() != before
    assert run(copies, "--check").returncode == 0


def test_the_version_that_added_an_entry_has_a_column_of_its_own(copies):
    change_schema(copies, CHANGES["datasets of heights"])
    run(copies)
    assert rows_of((copies / "SPEC.md").read_text(), "datasets of heights")[0][-1] == "1.3"


def test_a_kind_without_tables_is_found(copies):
    change_schema(copies, lambda kinds, schema: schema["kinds"].append(kinds["heights"] | {"kind": "depths"}))
    for arguments in (["--check"], []):
        done = run(copies, *arguments)
        assert done.returncode == 1
        assert "has no table 'datasets of depths': add its two marker lines" in done.stderr


def test_a_table_that_is_not_of_the_schema_is_found(copies):
    with open(copies / "SPEC.md", "a") as spec:
        spec.write("\n<!-- attributes of depths, made by spec_tables.py -->\n<!-- end -->\n")
        spec.write("\n<!-- kinds, made by spec_tables.py -->\n<!-- end -->\n")
    done = run(copies, "--check")
    assert done.returncode == 1
    assert "has a table 'attributes of depths' that the schema does not have: remove it" in done.stderr
    assert "has the table 'kinds' twice: remove one" in done.stderr
