"""Writes what a wheel is made of, as a CycloneDX document: libraries that it ships, libraries linked into the module, and headers.

    python3 python/sbom.py build/wheels/glint_ndf-*.whl --build build --build build/python -o build/wheels/glint_ndf.cdx.json

Shipped libraries are read from the wheel. What is inside the module is known from the headers that its sources include, which
ninja records. Versions and licences are those of the Debian packages and of the Python packages that the files belong to.
"""

import argparse
import email
import hashlib
import json
import os
import pathlib
import re
import subprocess
import uuid
import zipfile

# Objects of these folders are in the module.
OURS = ("libglint/", "formats/", "python/", "CMakeFiles/glint_python", "CMakeFiles/nanobind")
# Of the compiler and the system, which the wheel finds where it is installed.
SYSTEM = re.compile(r"^(libc6|libc6-dev|linux-libc-dev|libstdc\+\+|libgcc|gcc|g\+\+|cpp|clang|libclang|python3|libpython)")
HASH = "SHA-256"


def run(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def headers_of(build):
    """Headers outside the sources that objects in the module include."""
    headers, wanted = set(), False
    for line in run("ninja", "-C", str(build), "-t", "deps").splitlines():
        if line and not line.startswith(" "):
            wanted = line.startswith(OURS)
        elif wanted and line.strip():
            headers.add(os.path.normpath(build.resolve() / line.strip()))
    return {path for path in headers if "site-packages/" in path or path.startswith("/usr/")}


def debian_packages(paths):
    """The packages that hold these files."""
    packages = set()
    paths = sorted({str(pathlib.Path(path).resolve()) for path in paths})
    for begin in range(0, len(paths), 500):
        found = subprocess.run(["dpkg-query", "--search", *paths[begin : begin + 500]], capture_output=True, text=True).stdout
        packages |= {line.split(":")[0] for line in found.splitlines() if not line.startswith("diversion")}
    return {package for package in packages if not SYSTEM.match(package)}


def licences_of(package):
    """Names of licences in the package's copyright file, in the order of the file."""
    text = pathlib.Path("/usr/share/doc", package, "copyright").read_text(errors="replace")
    names = re.findall(r"^License: *(\S.*)$", text, re.MULTILINE)
    return list(dict.fromkeys(names)) or ["see /usr/share/doc/" + package + "/copyright"]


def debian_component(package, properties=()):
    version, source = run("dpkg-query", "--show", "--showformat=${Version} ${source:Package}", package).split()
    return {
        "type": "library",
        "bom-ref": f"pkg:deb/debian/{package}@{version}",
        "name": package,
        "version": version,
        "purl": f"pkg:deb/debian/{package}@{version}",
        "licenses": [{"license": {"name": name}} for name in licences_of(package)],
        "properties": [{"name": "glint:source", "value": source}, *properties],
    }


def python_component(folder):
    """The package of a folder of site-packages."""
    metadata = next(folder.parent.glob(f"{folder.name}-*.dist-info/METADATA"))
    fields = email.message_from_string(metadata.read_text())
    classifiers = [c.split(" :: ")[-1] for c in fields.get_all("Classifier", []) if c.startswith("License")]
    licences = [fields[f] for f in ("License-Expression", "License") if fields[f]] or classifiers
    purl = f"pkg:pypi/{fields['Name']}@{fields['Version']}"
    return {
        "type": "library",
        "bom-ref": purl,
        "name": fields["Name"],
        "version": fields["Version"],
        "purl": purl,
        "licenses": [{"license": {"name": name.splitlines()[0]}} for name in licences[:1]],
        "properties": [{"name": "glint:how", "value": "linked into the module"}],
    }


def shipped(wheel):
    """(name, bytes) of the shared libraries beside the module."""
    with zipfile.ZipFile(wheel) as archive:
        return [(name, archive.read(name)) for name in archive.namelist() if re.search(r"\.libs/.*\.so", name)]


def package_of_library(name):
    """The package of a library whose name has a hash in the wheel: libtbb-4d79fbbd.so.12.8. None if it is of no package."""
    soname = re.sub(r"-[0-9a-f]{8}(?=\.so)", "", pathlib.Path(name).name)
    found = subprocess.run(["dpkg-query", "--search", f"*/{soname}"], capture_output=True, text=True)
    return found.stdout.split(":")[0] if found.returncode == 0 else None


def other_component(name, properties):
    """A library that no package has brought."""
    soname = re.sub(r"-[0-9a-f]{8}(?=\.so)", "", pathlib.Path(name).name)
    stem, _, version = soname.partition(".so")
    version = version.lstrip(".") or "unknown"
    purl = f"pkg:generic/{stem}@{version}"
    return {
        "type": "library",
        "bom-ref": purl,
        "name": stem,
        "version": version,
        "purl": purl,
        "licenses": [{"license": {"name": "unknown"}}],
        "properties": [{"name": "glint:source", "value": "unknown"}, *properties],
    }


def document(wheel, builds):
    components = {}
    for name, content in shipped(wheel):
        package = package_of_library(name)
        properties = [{"name": "glint:how", "value": "shared library in the wheel"}, {"name": "glint:file", "value": name}]
        component = debian_component(package, properties) if package else other_component(name, properties)
        component["hashes"] = [{"alg": HASH, "content": hashlib.sha256(content).hexdigest()}]
        components[package or component["name"]] = component
    headers = set().union(*(headers_of(build) for build in builds))
    in_python = {path for path in headers if "site-packages/" in path}
    for path in in_python:
        root, rest = path.split("site-packages/")
        folder = pathlib.Path(root, "site-packages", rest.split("/")[0])
        components.setdefault(folder.name, python_component(folder))
    sources = {c["properties"][0]["value"] for c in components.values()}
    for package in debian_packages(headers - in_python):
        component = debian_component(package, [{"name": "glint:how", "value": "linked into the module, or headers"}])
        if component["properties"][0]["value"] not in sources:  # of the shared libraries
            components[package] = component
    name, version = pathlib.Path(wheel).name.split("-")[:2]
    listed = [components[key] for key in sorted(components)]
    serial = uuid.uuid5(uuid.NAMESPACE_URL, hashlib.sha256(pathlib.Path(wheel).read_bytes()).hexdigest())
    subject = f"pkg:pypi/{name}@{version}"
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.5",
        "serialNumber": f"urn:uuid:{serial}",
        "version": 1,
        "metadata": {"component": {"type": "library", "bom-ref": subject, "name": name, "version": version, "purl": subject}},
        "components": listed,
        "dependencies": [{"ref": subject, "dependsOn": [component["bom-ref"] for component in listed]}],
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("wheel", type=pathlib.Path)
    parser.add_argument(
        "--build", action="append", type=pathlib.Path, required=True, help="folder of the build; give it once for each"
    )
    parser.add_argument("-o", "--output", type=pathlib.Path, required=True)
    arguments = parser.parse_args()
    arguments.output.write_text(json.dumps(document(arguments.wheel, arguments.build), indent=1) + "\n")


if __name__ == "__main__":
    main()
