"""The rooms of the project: which part may include which, held by reading the include graph of the sources."""

import pathlib
import re

import pytest

ROOT = pathlib.Path(__file__).parents[2]
ROOMS = {"formats": ROOT / "formats"} | {room: ROOT / "libglint" / room for room in ("math", "model", "query", "api", "bake")}
APPS = ROOT / "apps"
PYTHON = ROOT / "python" / "bindings"
MAX_MAIN_LINES = 60
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^">]+)[">]', re.MULTILINE)
SOURCES = {".h", ".hpp", ".inl", ".cpp", ".cc", ".c", ".cu"}

# What each room may include of ours. The apps and the Python package may include everything.
MAY_USE = {
    "math": {"math"},
    "model": {"model", "math"},
    "query": {"query", "model", "math"},
    "api": {"api", "formats", "query", "model", "math"},
    "bake": {"bake", "query", "model", "math"},
    "formats": {"formats", "model", "math"},
}

# The folders inside the rooms, and which of them each may include besides itself. A method has the same name in every room.
FOLDERS = {
    "bake": {
        "common": set(),
        "ingest": {"common"},
        "synth": {"common"},
        "pyramid": {"common"},
        "compressed": {"common"},
        "bin_map": {"common"},
        "histogram": {"common"},
        "moments": {"common"},
        "tiny": {"common", "pyramid"},
        "sh": {"common"},
        "displace": {"common"},
        "wang": {"common", "pyramid"},
        "wave": {"common", "compressed", "pyramid"},
    },
    "query/detail": {
        "common": set(),
        "manifold": {"common"},
        "pyramid": {"common"},
        "compressed": {"common", "pyramid"},
        "bin_map": {"common"},
        "histogram": {"common"},
        "moments": {"common"},
        "tiny": {"common", "pyramid"},
        "wang": {"common", "pyramid"},
        "wave": {"common", "pyramid"},
    },
}

# Headers of others that are kept in few places: pattern -> folders, relative to the root.
KEPT_IN = {
    r"^(hdf5|H5\w*)(\.h|\.hpp)$|^highfive/": ["formats"],
    r"^OpenImageIO/|^OpenEXR/|^Imath/|^Imf\w*\.h$": ["apps"],
    r"^CLI/": ["apps"],
    r"^Eigen/|^fftw3|^libsharp/|^hwy/|^boost/": ["libglint/bake"],
    r"^(tbb|oneapi)/": ["libglint/bake", "apps", "python/bindings"],
    r"^(nanobind|pybind11)/|^Python\.h$": ["python/bindings"],
}


def sources(folder):
    return sorted(path for path in folder.rglob("*") if path.suffix in SOURCES)


def includes(path):
    """(bracket, name) of every include of a file, leaving out comments."""
    text = re.sub(r"/\*.*?\*/|//[^\n]*", "", path.read_text(), flags=re.DOTALL)
    return INCLUDE.findall(text)


def room_of(path, name):
    """The room of an included header, or None when it is not one of ours."""
    if match := re.match(r"glint/(\w+)/", name):
        return match[1]
    resolved = (path.parent / name).resolve()
    for room, folder in ROOMS.items():
        if resolved.is_relative_to(folder) and resolved.exists():
            return room
    if name.startswith(("common/", "manifest/", "measure/")) or resolved.is_relative_to(APPS) or re.match(r"glint-\w+/", name):
        return "apps"
    return None


def name_of(path):
    return str(path.relative_to(ROOT))


def test_headers_that_a_room_includes_exist():
    missing = []
    for path in [p for folder in (*ROOMS.values(), APPS, PYTHON) for p in sources(folder)]:
        for _, name in includes(path):
            if match := re.match(r"glint/(\w+)/(.+)", name):
                if not (ROOMS[match[1]] / match[2]).exists():
                    missing.append(f"{name_of(path)}: {name}")
    assert missing == []


@pytest.mark.parametrize("room", ROOMS)
def test_room_includes_only_the_rooms_below_it(room):
    files = sources(ROOMS[room])
    assert files, f"{room} is empty: was it moved?"
    wrong = []
    for path in files:
        for _, name in includes(path):
            used = room_of(path, name)
            if used is not None and used not in MAY_USE[room]:
                wrong.append(f"{name_of(path)} includes {name}")
    assert wrong == []


@pytest.mark.parametrize("parent", FOLDERS)
def test_folder_of_a_method_includes_only_itself_and_its_foundations(parent):
    home = ROOT / "libglint" / parent
    assert {path.parent.relative_to(home).as_posix() for path in sources(home)} == set(FOLDERS[parent])
    wrong = []
    for folder, foundations in FOLDERS[parent].items():
        for path in sources(home / folder):
            for _, name in includes(path):
                match = re.match(rf"glint/{parent}/(\w+)/", name)
                if match and match[1] not in {folder, *foundations}:
                    wrong.append(f"{name_of(path)} includes {name}")
    assert wrong == []


@pytest.mark.parametrize("room", ["math", "model", "query"])
def test_room_needs_only_the_standard_library(room):
    """These compile into renderers and device code: nothing but our headers and those of the standard library (no dot, no
    slash).

    Some headers may also include the compiler's own intrinsics, where the processor is one that may have them.
    """
    intrinsics = {("float4.h", "emmintrin.h"), ("float4.h", "smmintrin.h"), ("avx2.h", "immintrin.h")}
    wrong = []
    for path in sources(ROOMS[room]):
        for bracket, name in includes(path):
            if (path.name, name) in intrinsics:
                continue
            if bracket == "<" and not re.fullmatch(r"[a-z_0-9]+", name):
                wrong.append(f"{name_of(path)} includes <{name}>")
    assert wrong == []


@pytest.mark.parametrize("room", ["math", "model", "query"])
def test_room_is_header_only(room):
    assert [name_of(path) for path in sources(ROOMS[room]) if path.suffix not in {".h", ".inl"}] == []


@pytest.mark.parametrize("pattern", KEPT_IN)
def test_library_stays_in_its_room(pattern):
    homes = [ROOT / folder for folder in KEPT_IN[pattern]]
    wrong = []
    for path in [p for folder in (ROOT / "libglint", ROOT / "formats", APPS, PYTHON) for p in sources(folder)]:
        if any(path.is_relative_to(home) for home in homes):
            continue
        wrong += [f"{name_of(path)} includes {name}" for _, name in includes(path) if re.search(pattern, name)]
    assert wrong == []


def test_only_the_writer_uses_hdf5():
    """A renderer needs no HDF5: only the sources of the library `writer` include it, and no public header."""
    users = {name_of(p) for p in sources(ROOMS["formats"]) if any(re.match(r"hdf5|H5", name) for _, name in includes(p))}
    assert users == {"formats/hdf5_handle.h"}
    users = {name_of(p) for p in sources(ROOMS["formats"]) if ('"', "glint/formats/hdf5_handle.h") in includes(p)}
    assert users == {"formats/hdf5_handle.cpp", "formats/asset_writer.cpp"}


def test_the_container_knows_nothing_of_assets():
    """It reads a part of HDF5; what the objects mean is the business of the rest of formats/."""
    allowed = {"container", "findings.h", "schema.h", "plain_text.h", "descriptor.h", "mapped_files.h", "system_error.h"}
    used = {
        match[1]
        for p in sources(ROOMS["formats"] / "container")
        for _, name in includes(p)
        if (match := re.match(r"glint/formats/([^/]+)", name))
    }
    assert used <= allowed


def test_c_header_is_c_and_needs_only_the_standard_library():
    """A C compiler reads it: the installed consumer tests that; nothing else of ours may creep in."""
    assert [name for _, name in includes(ROOMS["api"] / "glint.h")] == ["stddef.h", "stdint.h"]


def test_c_header_is_included_as_an_installed_package_has_it():
    files = [p for folder in (ROOT / "libglint", ROOT / "formats", ROOT / "tests", APPS) for p in sources(folder)]
    names = {name for path in files for _, name in includes(path) if pathlib.PurePath(name).name == "glint.h"}
    assert names == {"glint.h"}


def mains():
    return sorted(APPS.glob("glint-*/main.cpp"))


def test_there_are_mains():
    assert mains()


@pytest.mark.parametrize("path", mains(), ids=lambda path: path.parent.name)
def test_main_is_short(path):
    assert len(path.read_text().splitlines()) < MAX_MAIN_LINES


def test_reading_the_graph_sees_what_it_should(tmp_path):
    """A guard against a parser that finds nothing and so passes everything."""
    file = tmp_path / "x.h"
    file.write_text(
        '#include "glint/bake/a.h"\n  #  include <hdf5.h>\n// #include <no>\n/* #include "no.h"\n*/\n#include <Eigen/Core>  // x\n'
    )
    assert includes(file) == [('"', "glint/bake/a.h"), ("<", "hdf5.h"), ("<", "Eigen/Core")]
    assert room_of(file, "glint/bake/a.h") == "bake"
    assert room_of(ROOMS["query"] / "x.h", "../bake/ingest/ingest.h") == "bake"
