"""What the README and the pages of docs/ say is so: commands, examples, links, paths and tables."""

import math
import pathlib
import re
import shlex

import pytest

ROOT = pathlib.Path(__file__).parents[2]
README = (ROOT / "README.md").read_text()
LINKING = (ROOT / "docs/LINKING.md").read_text()
DOCUMENTS = [
    "README.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    *(f"docs/{path.name}" for path in sorted((ROOT / "docs").glob("*.md"))),
]
# Sums in another order, as another processor's vectors give, and the digits that were printed.
TOLERANCE = 5e-3
# One screen and a half.
MOST_README_LINES = 75


def blocks(text, language):
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def session_of(text):
    """[(command, expected output)] of all console blocks."""
    steps = []
    for line in "".join(blocks(text, "console")).splitlines():
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


def anchors(text):
    """Names of the headings of a page, as links use them."""
    headings = re.findall(r"^#+ (.*)", text, re.MULTILINE)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


def test_chain_gives_what_is_printed(glint):
    steps = session_of(README)
    assert len(steps) == 5
    for command, expected in steps:
        program, *arguments = shlex.split(command, comments=True)
        process = glint(program.removeprefix("glint-"), *arguments)
        assert process.returncode == 0, f"{command}\n{process.stderr}"
        assert same(process.stdout, expected), f"{command}\n{process.stdout}"


def test_comparison_of_sessions_sees_differences():
    assert same("a 1.00001 b", "a 1.0 b")
    assert not same("a 1.1 b", "a 1.0 b")
    assert not same("a 1.0 c", "a 1.0 b")
    assert not same("a 1.0", "a 1.0 b")


def test_readme_is_short():
    assert len(README.splitlines()) <= MOST_README_LINES, "move the details to docs/"


def test_plans_are_those_of_their_page():
    cells = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in (ROOT / "docs/PLANS.md").read_text().splitlines()
    ]
    table = [row for row in cells if len(row) == 8][2:]
    assert len(table) == 9, "three rows of three scenes"
    for plan, paper in zip(table[::3], table[1::3]):
        title, _, asked, _, *ours = plan
        seen, file, density = (f"{ours[k]} ({paper[4 + k]})" for k in (0, 1, 3))
        assert f"| {title} | {asked} | {seen} | {file} | {density} |" in README.splitlines()


def test_projects_that_link_are_those_that_are_built():
    inside, installed = blocks(LINKING, "cmake")
    assert inside in (ROOT / "tests/consumer/CMakeLists.txt").read_text()
    project = (ROOT / "tests/consumer_installed/CMakeLists.txt").read_text()
    assert all(line in project for line in installed.splitlines())


@pytest.mark.parametrize("document", DOCUMENTS)
def test_links_lead_somewhere(document):
    path = ROOT / document
    prose = re.sub(r"^```.*?^```", "", path.read_text(), flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)]+)", prose):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        linked = path.parent / name if name else path
        assert linked.exists(), target
        assert not anchor or anchor in anchors(linked.read_text()), target


@pytest.mark.parametrize(
    "document",
    ["docs/ARCHITECTURE.md", "docs/METHODS.md", "docs/FORMAT.md", "docs/TOOLS.md", "docs/LINKING.md", "docs/INTEGRATIONS.md"],
)
def test_files_that_are_named_exist(document):
    rooms = r"(?:libglint|formats|apps|tests|pipelines)/"
    named = set(re.findall(rf"`({rooms}[\w./-]+)`", (ROOT / document).read_text()))
    assert [name for name in named if "METHOD" not in name and not (ROOT / name).exists()] == []


def test_headers_that_are_named_exist():
    for header in set(re.findall(r"`((?:light/|brdf/)?\w+\.h)`", LINKING)) - {"glint.h"}:
        assert (ROOT / "libglint/query" / header).exists(), header
    for header in re.findall(r"`glint/([\w/]+\.h)`", LINKING):
        assert (ROOT / "libglint" / header).exists(), header


def test_every_tool_and_kind_is_in_a_table():
    tools = {path.parent.name for path in (ROOT / "apps").glob("glint-*/main.cpp")}
    assert set(re.findall(r"^\| `(glint-\w+)` \|", (ROOT / "docs/TOOLS.md").read_text(), re.MULTILINE)) == tools
    kinds = set(
        re.findall(r"^## \d+\. Kinds? `([a-z-]+)`(?: and `([a-z-]+)`)?", (ROOT / "formats/SPEC.md").read_text(), re.MULTILINE)
    )
    named = {kind for pair in kinds for kind in pair if kind}
    assert {"normals", "ndf-pyramid"} <= named
    assert set(re.findall(r"^\| `([a-z-]+)` \|", (ROOT / "docs/FORMAT.md").read_text(), re.MULTILINE)) == named


def test_glossary_is_in_order_and_says_each_word_once():
    words = re.findall(r"^\*\*([^*]+)\*\*:", (ROOT / "docs/GLOSSARY.md").read_text(), re.MULTILINE)
    assert len(words) > 40
    assert words == sorted(set(words), key=str.lower)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_make_has_the_targets_that_the_documents_name(document):
    makefile = (ROOT / "Makefile").read_text()
    targets = set(re.findall(r"(?:^|`)make ([a-z][a-z-]*)", (ROOT / document).read_text(), re.MULTILINE))
    assert document not in ("README.md", "CONTRIBUTING.md") or "test" in targets
    for target in targets:
        assert re.search(rf"^{target}:.*## ", makefile, re.MULTILINE), f"{document}: make {target}"
