"""glint-validate for CI: --since, --junit, --sarif, and the hook of git."""

import json
import os
import pathlib
import shutil
import subprocess
import xml.etree.ElementTree as ElementTree
from urllib.parse import unquote

import h5py
import pytest
from conftest import BIN, run_once
from test_digest import FILES, digest

ROOT = pathlib.Path(__file__).parents[2]
RULES = {"error", "warning", "note"}  # levels of SARIF


@pytest.fixture
def assets(glint):
    """Two good assets, a damaged one with signs of XML and of URIs in its name, and a file that is no asset."""
    run_once(glint, "synth flakes --size 32 -o n.png", "ingest n.png -o good.glint", "sat good.glint -o sat.glint")
    data = bytearray((glint.folder / "good.glint").read_bytes())
    data[-9] ^= 1
    (glint.folder / "odd <&\"' %.glint").write_bytes(data)
    (glint.folder / "none.glint").write_text("no asset")
    return ["good.glint", "sat.glint", "odd <&\"' %.glint", "none.glint"]


def test_junit_has_a_case_for_each_file_and_its_errors(glint, assets):
    process = glint("validate", *assets, "--junit", "report.xml", "--json")
    assert process.returncode == 3
    files = json.loads(process.stdout)["result"]["files"]
    suites = ElementTree.parse(glint.folder / "report.xml").getroot()
    assert suites.tag == "testsuites" and [suite.tag for suite in suites] == ["testsuite"]
    suite = suites[0]
    for element in (suites, suite):
        assert (element.get("tests"), element.get("failures"), element.get("errors")) == ("4", "2", "0")
    assert [case.get("name") for case in suite] == assets
    for case, file in zip(suite, files):
        assert case.get("classname") == f"glint-validate.{file['kind'] or 'unknown'}"
        failures = case.findall("failure")
        assert len(failures) == (0 if file["valid"] else 1)
        for failure in failures:
            assert (
                failure.get("type") == file["findings"][0]["rule"] and failure.get("message") == file["findings"][0]["message"]
            )
            assert len(failure.text.splitlines()) == file["errors"]


def test_names_with_characters_that_xml_refuses_are_told_by_numbers(glint, assets):
    names = ["a\ufffe.glint", "b\uffff\uffff.glint", "c\ufffd.glint"]
    for name in names:
        shutil.copy(glint.folder / "none.glint", glint.folder / name)
    assert glint("validate", *names, "--junit", "report.xml").returncode == 3
    suite = ElementTree.parse(glint.folder / "report.xml").getroot()[0]
    assert [case.get("name") for case in suite] == ["a\\ufffe.glint", "b\\uffff\\uffff.glint", "c\ufffd.glint"]


def test_warnings_fail_a_case_only_where_they_are_errors(glint):
    shutil.copy(FILES[0], glint.folder / "newer.glint")
    with h5py.File(glint.folder / "newer.glint", "r+") as file:
        file.attrs.modify("format_minor", 9999)
        file.attrs.modify("digest", digest(file).encode())
    for arguments, failures in (([], "0"), (["--warnings-as-errors"], "1")):
        process = glint("validate", "newer.glint", "--junit", "report.xml", *arguments)
        suite = ElementTree.parse(glint.folder / "report.xml").getroot()[0]
        assert suite.get("failures") == failures and (process.returncode == 0) == (failures == "0"), process.stdout
        assert (suite[0].find("system-out") is None) == (failures == "1")


def test_sarif_has_a_result_for_each_finding(glint, assets):
    process = glint("validate", *assets, "--sarif", "report.sarif", "--json")
    files = json.loads(process.stdout)["result"]["files"]
    document = json.loads((glint.folder / "report.sarif").read_text())
    # What the schema of SARIF 2.1.0 requires of the objects that are used here.
    assert document["version"] == "2.1.0" and document["$schema"].endswith("sarif-2.1.0.json") and len(document["runs"]) == 1
    run = document["runs"][0]
    driver = run["tool"]["driver"]
    assert driver["name"] == "glint-validate"
    ids = [rule["id"] for rule in driver["rules"]]
    assert ids == sorted(set(ids))
    for rule in driver["rules"]:
        assert rule["shortDescription"]["text"] and rule["help"]["text"] and rule["defaultConfiguration"]["level"] in RULES
    expected = [(file["path"], finding["rule"], finding["severity"]) for file in files for finding in file["findings"]]
    assert len(expected) >= 2
    assert [(result["ruleId"], result["level"]) for result in run["results"]] == [
        (rule, severity) for _, rule, severity in expected
    ]
    for result, (path, rule, _) in zip(run["results"], expected):
        assert ids[result["ruleIndex"]] == rule and result["message"]["text"]
        uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
        assert unquote(uri) == path and not set(uri) & set(" <>\"'&")


def test_reports_of_valid_files_are_empty_and_replaced(glint, assets):
    for _ in range(2):
        assert glint("validate", "good.glint", "--junit", "r.xml", "--sarif", "r.sarif").returncode == 0
    assert json.loads((glint.folder / "r.sarif").read_text())["runs"][0]["results"] == []
    assert ElementTree.parse(glint.folder / "r.xml").getroot().get("failures") == "0"
    process = glint("validate", "good.glint", "--junit", "n.png")
    assert process.returncode == 1 and "--force" in process.stderr
    process = glint("validate", "good.glint", "--sarif", "/dev/full")
    assert process.returncode == 2 and "No space left" in process.stderr


def test_nothing_to_check_is_a_mistake(glint):
    process = glint("validate")
    assert process.returncode == 1 and "--since MANIFEST" in process.stderr


def checked(glint, *arguments, code=0):
    process = glint("validate", *arguments, "--json")
    assert process.returncode == code, process.stderr
    return [file["path"] for file in json.loads(process.stdout)["result"]["files"]]


def test_since_checks_what_is_new_or_changed(glint, assets):
    (glint.folder / "maps").mkdir()
    for name in ("a.png", "b.png"):
        subprocess.run(
            [BIN / "glint-synth", "flakes", "--size", "32", "--seed", str(ord(name[0])), "-o", glint.folder / "maps" / name],
            check=True,
        )
    for words in ("plan maps -o farm.json --make sat", "run farm.json"):
        assert glint("farm", *words.split()).returncode == 0
    assert checked(glint, "--since", "farm.json") == []
    (glint.folder / "assets/a.glint").unlink()
    shutil.copy(glint.folder / "good.glint", glint.folder / "assets/b.glint")
    assert checked(glint, "--since", "farm.json") == ["assets/b.glint"], "a missing asset is told by glint-farm status"
    # Files that are named: the recorded ones are left out.
    assert checked(glint, "--since", "farm.json", "assets/a.sat.glint", "none.glint", code=3) == ["none.glint"]
    with open(glint.folder / "assets/a.sat.glint", "r+b") as file:
        file.write(b"x")
    assert checked(glint, "--since", "farm.json", code=3) == ["assets/a.sat.glint", "assets/b.glint"]
    process = glint("validate", "--since", "good.glint")
    assert process.returncode == 3 and "glint-farm plan" in process.stderr


def test_the_hook_refuses_damaged_assets(glint, assets):
    environment = {
        **os.environ,
        "PATH": f"{BIN}:{os.environ['PATH']}",
        "GIT_CONFIG_GLOBAL": "/dev/null",
        "GIT_CONFIG_SYSTEM": "/dev/null",
    }

    def git(*words):
        command = ["git", "-c", "user.name=a", "-c", "user.email=a@example.org", *words]
        return subprocess.run(command, cwd=glint.folder, capture_output=True, text=True, env=environment)

    assert git("init", "-q").returncode == 0
    (glint.folder / ".git/hooks").mkdir(exist_ok=True)
    (glint.folder / ".git/hooks/pre-commit").symlink_to(ROOT / "pipelines/ci/pre-commit")
    assert git("add", "good.glint").returncode == 0
    # What lies in the folder does not count: the good bytes are those that are committed.
    good = (glint.folder / "good.glint").read_bytes()
    (glint.folder / "good.glint").write_bytes(b"")
    process = git("commit", "-m", "good")
    assert process.returncode == 0, process.stderr
    (glint.folder / "good.glint").write_bytes(good)
    assert git("add", assets[2]).returncode == 0
    process = git("commit", "-m", "odd")
    assert process.returncode != 0 and "odd" in process.stdout + process.stderr
