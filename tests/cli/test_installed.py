"""The installed package: installed into a folder of its own, then used from C and C++ through CMake and pkg-config, by
projects that see nothing else of the repository. Programs in C run under AddressSanitizer; in the asan preset the library is
instrumented as well."""

import os
import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).parents[2]
BUILD = pathlib.Path(os.environ.get("GLINT_BUILD_DIR", ROOT / "build"))
CONSUMER = ROOT / "tests/consumer_installed"
GOLDEN = ROOT / "tests/golden/v1.0"
KINDS = ["normals.glint", "ndf-pyramid.glint", "ndf-cp-cp-i8.glint", "ndf-cp-tucker-f16.glint", "bin-map.glint"]
DISPLACEMENT = GOLDEN / "displacement-rgb.glint"
SANITIZE = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g"]


def run(*command, **options):
    process = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    assert process.returncode == 0, f"{' '.join(map(str, command))}\n{process.stdout}\n{process.stderr}"
    return process.stdout


def cache(name):
    """A variable of the build that is tested."""
    found = re.search(rf"^{name}(?::\w+)?=(.*)$", (BUILD / "CMakeCache.txt").read_text(), re.MULTILINE)
    return found[1] if found else ""


def instrumented(sanitizer):
    return f"-fsanitize={sanitizer}" in cache("CMAKE_CXX_FLAGS")


pytestmark = pytest.mark.skipif(
    instrumented("thread"), reason="programs with AddressSanitizer cannot link a library for ThreadSanitizer"
)


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """Installed to one folder and moved to another: nothing may remember where it was built or installed."""
    first = tmp_path_factory.mktemp("install") / "first"
    run("cmake", "--install", BUILD, "--prefix", first)
    moved = first.with_name("moved")
    first.rename(moved)
    return moved


@pytest.fixture(scope="module")
def library_dir(prefix):
    return next(prefix.rglob("libglint.so")).parent


@pytest.fixture(scope="module")
def programs(prefix, tmp_path_factory):
    """The consumer project, configured and built with nothing but the prefix."""
    build = tmp_path_factory.mktemp("consumer")
    sanitize = " ".join(SANITIZE)
    # Static programs in C++ share templates with the library, so they are instrumented only where it is.
    flags = cache("CMAKE_CXX_FLAGS")
    run(
        "cmake",
        "-S",
        CONSUMER,
        "-B",
        build,
        f"-DCMAKE_PREFIX_PATH={prefix}",
        "-DCMAKE_BUILD_TYPE=Debug",
        f"-DCMAKE_C_FLAGS={sanitize}",
        f"-DCMAKE_CXX_FLAGS={flags}",
        f"-DCMAKE_EXE_LINKER_FLAGS={sanitize}",
    )
    run("cmake", "--build", build)
    return build


@pytest.mark.parametrize("program", ["check_c", "check_c_static", "check_cxx"])
@pytest.mark.parametrize("asset", KINDS)
def test_programs_of_an_installed_package_get_what_the_header_promises(programs, program, asset):
    displacement = [] if program == "check_cxx" else [DISPLACEMENT]
    run(programs / program, GOLDEN / asset, *displacement)


def test_example_of_the_readme_answers(programs):
    assert re.fullmatch(
        r"density \S+\nmean over a light \S+\nreflected \S+ \S+ \S+\n", run(programs / "app", GOLDEN / "ndf-cp-cp-i8.glint")
    )


def test_a_project_in_c_alone_links_the_static_library(prefix, tmp_path):
    run(
        "cmake",
        "-S",
        ROOT / "tests/consumer_c",
        "-B",
        tmp_path,
        f"-DCMAKE_PREFIX_PATH={prefix}",
        f"-DCMAKE_C_FLAGS={cache('CMAKE_C_FLAGS')}",
    )
    run("cmake", "--build", tmp_path)
    assert "mean over a light" in run(tmp_path / "app", GOLDEN / "ndf-cp-cp-i8.glint")


def test_kinds_without_a_distribution_are_refused_by_name(programs):
    process = subprocess.run([programs / "app", GOLDEN / "heights.glint"], capture_output=True, text=True)
    assert process.returncode == 1
    assert "is of kind heights" in process.stderr


@pytest.mark.skipif(shutil.which("pkg-config") is None or shutil.which("cc") is None, reason="needs pkg-config and cc")
@pytest.mark.parametrize("package", ["glint", "glint-static"])
def test_a_plain_compiler_and_pkg_config_are_enough(prefix, library_dir, tmp_path, package):
    environment = {**os.environ, "PKG_CONFIG_PATH": str(library_dir / "pkgconfig")}
    flags = run("pkg-config", "--cflags", "--libs", package, env=environment).split()
    program = tmp_path / "check"
    run(
        "cc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-Wpedantic",
        "-Werror",
        *SANITIZE,
        CONSUMER / "check.c",
        "-o",
        program,
        *flags,
        "-lm",
    )
    loaded = {**os.environ, "LD_LIBRARY_PATH": str(library_dir)} if package == "glint" else None
    for asset in KINDS:
        run(program, GOLDEN / asset, DISPLACEMENT, env=loaded)


def test_shared_library_shows_the_c_interface_and_nothing_else(prefix, library_dir):
    header = (prefix / "include/glint.h").read_text()
    declared = set(re.findall(r"\b(glint_\w+)\(", re.sub(r"/\*.*?\*/", "", header, flags=re.DOTALL)))
    symbols = [
        line.split()[-1].split("@")[0] for line in run("nm", "-D", "--defined-only", library_dir / "libglint.so").splitlines()
    ]
    version = re.search(r"#define GLINT_ABI_VERSION (\d+)", header)[1]
    assert {name for name in symbols if name != f"GLINT_{version}"} == declared


def test_soname_is_the_version_of_the_abi(prefix, library_dir):
    version = re.search(r"#define GLINT_ABI_VERSION (\d+)", (prefix / "include/glint.h").read_text())[1]
    assert f"soname: [libglint.so.{version}]" in run("readelf", "-d", library_dir / "libglint.so")


def test_the_library_needs_runtimes_only(library_dir):
    """Opening assets needs no HDF5, nor anything else but the runtimes of C and C++ and of a sanitizer."""
    needed = set(re.findall(r"\(NEEDED\).*\[(.*?)\.so", run("readelf", "-d", library_dir / "libglint.so")))
    assert needed - {"libstdc++", "libm", "libgcc_s", "libc", "ld-linux-x86-64", "libasan", "libubsan", "libtsan"} == set()
