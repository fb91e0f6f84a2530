"""What the README says is so: its session, its example of the reader, its links and its tables."""

import math
import pathlib
import re
import shlex

ROOT = pathlib.Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
# Sums in another order, as another processor's vectors give, and the digits that were printed.
TOLERANCE = 5e-3


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", README, re.MULTILINE | re.DOTALL)


def session():
    """[(command, expected output)] of the console block."""
    steps = []
    for line in blocks("console")[0].splitlines():
        if line.startswith("$ "):
            steps.append((line[2:], []))
        else:
            steps[-1][1].append(line)
    return [(command, "\n".join(lines)) for command, lines in steps]


def same(text, expected):
    """Equal but for the last digits of numbers."""
    words, expected_words = text.split(), expected.split()
    if len(words) != len(expected_words):
        return False
    for word, wanted in zip(words, expected_words):
        try:
            if not math.isclose(float(word.rstrip("%,)")), float(wanted.rstrip("%,)")), rel_tol=TOLERANCE, abs_tol=1e-5):
                return False
        except ValueError:
            if word.strip("(),") != wanted.strip("(),") and not re.match(r"\(?-?\d", word):
                return False
    return True


def test_session_gives_what_is_printed(glint):
    steps = session()
    assert len(steps) > 5
    for command, expected in steps:
        program, *arguments = shlex.split(command)
        process = glint(program.removeprefix("glint-"), *arguments)
        assert process.returncode == 0, f"{command}\n{process.stderr}"
        assert same(process.stdout, expected), f"{command}\n{process.stdout}"


def test_comparison_of_sessions_sees_differences():
    assert same("a 1.00001 b", "a 1.0 b")
    assert not same("a 1.1 b", "a 1.0 b")
    assert not same("a 1.0 c", "a 1.0 b")
    assert not same("a 1.0", "a 1.0 b")


def test_example_is_the_consumer_that_is_built():
    assert blocks("cpp") == [(ROOT / "tests/consumer/main.cpp").read_text()]
    assert blocks("cmake")[0] in (ROOT / "tests/consumer/CMakeLists.txt").read_text()


def test_c_example_is_the_program_that_is_built_against_an_installed_package():
    assert blocks("c") == [(ROOT / "tests/consumer_installed/main.c").read_text()]
    project = (ROOT / "tests/consumer_installed/CMakeLists.txt").read_text()
    assert all(line in project for line in blocks("cmake")[1].splitlines())


def test_links_lead_somewhere():
    for document in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md"):
        text = (ROOT / document).read_text()
        targets = [t for t in re.findall(r"\]\(([^)#]+)", text) if not t.startswith("http")]
        assert [t for t in targets if not (ROOT / t).exists()] == [], document


def test_every_tool_and_kind_is_in_a_table():
    tools = {path.parent.name for path in (ROOT / "apps").glob("glint-*/main.cpp")}
    assert set(re.findall(r"^\| `(glint-\w+)` \|", README, re.MULTILINE)) == tools
    kinds = set(re.findall(r"^## \d+\. Kinds? `([a-z-]+)`(?: and `([a-z-]+)`)?", (ROOT / "formats/SPEC.md").read_text(), re.MULTILINE))
    named = {kind for pair in kinds for kind in pair if kind}
    assert {"normals", "ndf-pyramid"} <= named
    assert all(f"| `{kind}` |" in README for kind in named)


def test_make_has_the_targets_that_the_documents_name():
    makefile = (ROOT / "Makefile").read_text()
    for document in ("README.md", "CONTRIBUTING.md"):
        targets = set(re.findall(r"^(?:make |.*?`make )([a-z-]+)", (ROOT / document).read_text(), re.MULTILINE))
        assert {"test"} <= targets
        for target in targets:
            assert re.search(rf"^{target}:.*## ", makefile, re.MULTILINE), f"{document}: make {target}"
