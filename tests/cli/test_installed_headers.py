"""Every installed header by itself: it compiles without warnings that other projects forbid, and older standards of C++ get one
error that says what to do."""

import subprocess

from test_installed import prefix, pytestmark  # noqa: F401  (the installed package, and where it cannot be tested)


def run_for_warnings(source, prefix, flags):
    """Lines of warnings of a source that compiles."""
    command = ["c++", "-std=c++20", "-Wall", "-Wextra", *flags, "-fsyntax-only", "-I", prefix / "include", source]
    process = subprocess.run(command, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    return [line for line in process.stderr.splitlines() if "warning:" in line]


def installed_headers(prefix):
    headers = [header.relative_to(prefix / "include") for header in sorted((prefix / "include/glint").rglob("*.h"))]
    assert len(headers) > 15
    return headers


# Conversions that other projects forbid.
STRICT = ["-Wconversion", "-Wsign-conversion", "-Wdouble-promotion", "-Wshadow"]


def test_installed_headers_compile_alone(prefix, tmp_path):
    """Each by itself, so that none leans on another that is not installed or not included."""
    source = tmp_path / "all.cpp"
    for header in installed_headers(prefix):
        source.write_text(f'#include "{header}"\n')
        assert run_for_warnings(source, prefix, STRICT) == [], header


def test_older_standards_get_one_error_that_says_what_to_do(prefix, tmp_path):
    source = tmp_path / "old.cpp"
    refused = 0
    for header in installed_headers(prefix):
        source.write_text(f'#include "{header}"\n')
        process = subprocess.run(
            ["c++", "-std=c++17", "-fsyntax-only", "-Wfatal-errors", "-I", prefix / "include", source],
            capture_output=True,
            text=True,
        )
        errors = [line for line in process.stderr.splitlines() if "error:" in line]
        assert not errors or "glint needs C++20" in errors[0], header
        refused += bool(errors)
    assert refused > 50
