"""pipelines/farm by an engine of farms, and pipelines/ci as CI systems read it."""

import json
import os
import pathlib
import subprocess
import sys

import pytest
import yaml

ROOT = pathlib.Path(__file__).resolve().parents[3]
BIN = pathlib.Path(os.environ.get("GLINT_BIN_DIR", ROOT / "build" / "bin")).resolve()
PIPELINES = ROOT / "pipelines"
OPENJD = pathlib.Path(sys.executable).with_name("openjd")
ENVIRONMENT = {**os.environ, "PATH": f"{BIN}:{os.environ['PATH']}"}


@pytest.fixture
def folder(tmp_path):
    """A folder with a manifest of six assets, which is named by its path."""
    (tmp_path / "maps").mkdir()
    for seed in range(3):
        subprocess.run(
            [BIN / "glint-synth", "flakes", "--size", "32", "--seed", str(seed), "-o", tmp_path / f"maps/{seed}.png"],
            check=True,
        )
    subprocess.run([BIN / "glint-farm", "plan", "maps", "-o", "farm.json", "--make", "sat"], cwd=tmp_path, check=True)
    return tmp_path


def done(folder):
    process = subprocess.run([BIN / "glint-farm", "status", "farm.json", "--json"], cwd=folder, capture_output=True, check=True)
    return json.loads(process.stdout)["result"]["done"]


def openjd(folder, *words):
    template = PIPELINES / "farm/glint-farm.openjd.yaml"
    return subprocess.run(
        [OPENJD, words[0], template, *words[1:]], cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, timeout=120
    )


def test_the_template_of_open_job_description_is_valid(folder):
    process = openjd(folder, "check")
    assert process.returncode == 0, process.stdout + process.stderr


def test_its_tasks_make_the_whole(folder):
    parameters = ["--job-param", f"Manifest={folder / 'farm.json'}", "--job-param", "Shards=2"]
    process = openjd(folder, "run", "--step", "Run", "--tasks", '[{"Shard": 1}]', *parameters)
    assert process.returncode == 0, process.stdout + process.stderr
    assert 0 < done(folder) < 6, "one task is one shard"
    process = openjd(folder, "run", *parameters)
    assert process.returncode == 0, process.stdout + process.stderr
    assert done(folder) == 6


def test_a_task_that_fails_fails_the_job(folder):
    (folder / "maps/1.png").unlink()
    assert openjd(folder, "run", "--job-param", f"Manifest={folder / 'farm.json'}").returncode != 0


def act(folder, **inputs):
    """Runs the steps in bash of the composite action, as GitHub does."""
    action = yaml.safe_load((PIPELINES / "ci/validate-assets/action.yml").read_text())
    assert action["runs"]["using"] == "composite" and all({"name"} < set(step) for step in action["runs"]["steps"])
    values = {name: value["default"] for name, value in action["inputs"].items()} | {
        k.replace("_", "-"): v for k, v in inputs.items()
    }
    assert set(values) == set(action["inputs"])
    step = next(step for step in action["runs"]["steps"] if "run" in step)
    environment = ENVIRONMENT | {name: values[text[len("${{ inputs.") : -len(" }}")]] for name, text in step["env"].items()}
    return subprocess.run(
        ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
    )


def test_the_action_checks_files_and_manifests(folder):
    subprocess.run([BIN / "glint-farm", "run", "farm.json"], cwd=folder, check=True)
    assert act(folder, files="assets/*.glint none/*.glint").returncode == 0
    assert (folder / "glint-validate.sarif").exists() and 'tests="6"' in (folder / "glint-validate.xml").read_text()
    (folder / "assets/0.glint").write_text("no asset")
    process = act(folder, since="farm.json", warnings_as_errors="true")
    assert process.returncode == 3 and "assets/0.glint" in process.stdout
    assert 'tests="1" failures="1"' in (folder / "glint-validate.xml").read_text()


def test_other_examples_for_ci_are_as_their_programs_read_them():
    hook = yaml.safe_load((PIPELINES / "ci/pre-commit-config.yaml").read_text())["repos"][0]["hooks"][0]
    assert (hook["entry"], hook["language"]) == ("glint-validate", "system")
    job = yaml.safe_load((PIPELINES / "ci/gitlab-ci.yml").read_text())["validate-assets"]
    assert job["artifacts"]["reports"]["junit"] == "glint-validate.xml" and "--junit glint-validate.xml" in job["script"][0]
