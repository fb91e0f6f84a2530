"""JSON files that people write: nested too deep, with a member twice, damaged."""

import pytest

# The arguments that read a file named x.json.
READERS = {
    "plan": ["plan", "x.json", "--explain"],
    "transforms": ["tiny", "map.glint", "-o", "o.glint", "--transforms", "x.json"],
    "lights": ["shlobes", "--light", "x.json", "-o", "o.glint"],
}


@pytest.fixture
def read(glint):
    glint("synth", "flakes", "--size", "16", "-o", "map.png")
    glint("ingest", "map.png", "-o", "map.glint")

    def run(reader, text):
        (glint.folder / "x.json").write_text(text)
        process = glint(*READERS[reader])
        assert process.returncode == 3, process.stderr
        assert process.stderr.count("\n") == 1 and "x.json" in process.stderr
        return process.stderr

    return run


@pytest.mark.parametrize("reader", READERS)
@pytest.mark.parametrize("unit, end", [('{"a":', "}"), ("[", "]")], ids=["objects", "lists"])
def test_files_nested_deep_are_refused(read, reader, unit, end):
    """Values are copied and freed level by level: 100,000 of them used up the stack."""
    assert "nested deeper than 100" in read(reader, unit * 100000 + "1" + end * 100000)


@pytest.mark.parametrize("reader", READERS)
def test_a_member_that_stands_twice_is_refused(read, reader):
    message = read(reader, '{"scale": 1, "other": {"scale": 2}, "scale": 3}')
    assert "scale" in message and "twice" in message


@pytest.mark.parametrize("reader", READERS)
def test_what_is_no_json_is_told_by_its_place(read, reader):
    assert "line 2, column" in read(reader, '{"scale": 1,\n "other" 2}')


def test_brackets_in_texts_do_not_count(read):
    assert "nested" not in read("plan", '{"name": "' + "[{" * 200 + '\\" [["}')
