"""The list of what a wheel is made of names every library in it, with version and licence."""

import hashlib
import json
import pathlib
import re
import subprocess
import sys
import zipfile

import pytest

ROOT = pathlib.Path(__file__).parents[2]
WHEELS = sorted((ROOT / "build/wheels").glob("glint_ndf-*.whl"))


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("sbom") / "sbom.json"
    builds = [f"--build={ROOT / 'build'}", f"--build={ROOT / 'build/python'}"]
    subprocess.run([sys.executable, ROOT / "python/sbom.py", WHEELS[-1], *builds, "-o", path], check=True, timeout=120)
    return json.loads(path.read_text())


def test_every_shared_library_is_listed_with_its_hash(made):
    listed = {p["value"]: c for c in made["components"] for p in c["properties"] if p["name"] == "glint:file"}
    with zipfile.ZipFile(WHEELS[-1]) as wheel:
        libraries = {name: wheel.read(name) for name in wheel.namelist() if ".libs/" in name and ".so" in name}
    assert libraries and set(listed) == set(libraries)
    for name, content in libraries.items():
        assert listed[name]["hashes"][0]["content"] == hashlib.sha256(content).hexdigest()


def test_libraries_inside_the_module_are_listed(made):
    names = {component["name"] for component in made["components"]}
    assert "nanobind" in names
    with zipfile.ZipFile(WHEELS[-1]) as wheel:
        module = next(wheel.read(name) for name in wheel.namelist() if re.search(r"/_glint\..*so$", name))
    # Texts that these libraries leave in what they are linked into.
    for text, package in ((b"HDF5 library version", "libhdf5"), (b"[json.exception.", "nlohmann-json3")):
        assert text not in module or any(name.startswith(package) for name in names), package
    assert any(text in module for text in (b"[json.exception.",)), "the test can fail"


def test_components_have_what_cyclonedx_asks(made):
    assert made["bomFormat"] == "CycloneDX" and made["specVersion"] == "1.5" and made["version"] == 1
    references = [component["bom-ref"] for component in made["components"]]
    assert len(set(references)) == len(references)
    assert set(made["dependencies"][0]["dependsOn"]) == set(references)
    for component in made["components"]:
        assert component["type"] == "library" and component["version"] and component["purl"].startswith("pkg:")
        assert component["licenses"] and all(licence["license"]["name"] for licence in component["licenses"])
