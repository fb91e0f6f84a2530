"""Compiles the Mitsuba BSDF `glint_native` against the headers of the installed wheels of Mitsuba, Dr.Jit and nanobind.

    python python/mitsuba_native/build.py --glint PREFIX --output FOLDER

PREFIX holds include/glint.h and lib/libglint.so, as `cmake --install` leaves them; or give --include and --library. Writes
FOLDER/plugins/glint_native.so, which Mitsuba finds after `mi.file_resolver().append(FOLDER)`.
"""

import argparse
import importlib.util
import os
import pathlib
import subprocess
import sys
import sysconfig

SOURCE = pathlib.Path(__file__).with_name("glint_native.cpp")


def folder_of(package):
    """Folder of an installed package. Does not import it."""
    spec = importlib.util.find_spec(package)
    if spec is None:
        sys.exit(f"build.py: error: the package {package} is not installed in {sys.prefix}; pip install {package}")
    return pathlib.Path(spec.submodule_search_locations[0])


def command(compiler, include, library, target):
    mitsuba, drjit, nanobind = folder_of("mitsuba"), folder_of("drjit"), folder_of("nanobind")
    headers = [
        mitsuba / "include",
        drjit / "include",
        nanobind / "include",
        nanobind / "ext" / "robin_map" / "include",
        sysconfig.get_paths()["include"],
        include,
    ]
    return [
        compiler,
        # Mitsuba's wheels are compiled for x86-64-v2: other options change the layout of vectors.
        *"-std=c++17 -O2 -march=x86-64-v2 -fPIC -shared -fvisibility=hidden".split(),
        *(f"-I{folder}" for folder in headers),
        str(SOURCE),
        "-o",
        str(target),
        *(f"-L{folder}" for folder in (mitsuba, drjit)),
        *"-lmitsuba -ldrjit-core -ldrjit-extra -lnanothread".split(),
        str(library),
        f"-Wl,-rpath,{library.parent}",
    ]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--glint", type=pathlib.Path, help="prefix of an installed glint")
    parser.add_argument("--include", type=pathlib.Path, help="folder of glint.h")
    parser.add_argument("--library", type=pathlib.Path, help="libglint.so")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="folder for plugins/glint_native.so")
    parser.add_argument("--compiler", default=os.environ.get("CXX", "g++"))
    options = parser.parse_args()
    if not options.glint and not (options.include and options.library):
        parser.error("give --glint, or --include and --library")
    include = options.include or options.glint / "include"
    library = (options.library or options.glint / "lib" / "libglint.so").absolute()
    for path in (include / "glint.h", library):
        if not path.exists():
            sys.exit(f"build.py: error: {path}: there is no such file; build and install glint first")
    target = options.output / "plugins" / "glint_native.so"
    target.parent.mkdir(parents=True, exist_ok=True)
    unfinished = target.with_suffix(".new")
    subprocess.run(command(options.compiler, include, library, unfinished), check=True)
    unfinished.replace(target)


if __name__ == "__main__":
    main()
