"""Compiles the plugin for the Mitsuba that is installed, and tells Mitsuba where it is."""

import hashlib
import importlib.metadata
import importlib.util
import os
import pathlib
import platform
import shlex
import shutil
import subprocess
import tempfile

import glint_ndf as gn

_SOURCE = pathlib.Path(__file__).with_name("glint_native.cpp")
_PLUGIN = "glint_native.so"


def load(folder=None):
    """Makes the BSDF `glint_native` known to Mitsuba, for the variants scalar_rgb, scalar_spectral, llvm_ad_rgb and llvm_ad_spectral.

    Args:
        folder: where the compiled plugin is kept; None: a folder of the user's cache.

    Raises:
        glint_ndf.UnsupportedError: there is no C++ compiler, or no headers of Mitsuba, Dr.Jit or nanobind.
        glint_ndf.FailedError: the compiler failed; the message ends with the compiler's words.
    """
    import mitsuba as mi

    home = str(compiled_plugin(folder).parents[1])
    resolver = mi.file_resolver()
    if home not in [str(resolver[i]) for i in range(len(resolver))]:
        resolver.append(home)


def compiled_plugin(folder=None) -> pathlib.Path:
    """The plugin `FOLDER/HASH/plugins/glint_native.so`, compiled where it is not there. HASH is that of the source and the versions."""
    if platform.machine() not in ("x86_64", "AMD64"):
        raise gn.UnsupportedError(
            f"glint_native: is for x86-64, and this processor is {platform.machine()}; take the BSDF `glint`"
        )
    compiler = shlex.split(os.environ.get("CXX", "g++"))
    if not compiler or shutil.which(compiler[0]) is None:
        raise gn.UnsupportedError("glint_native: there is no C++ compiler; install g++, or name one in CXX")
    command = [*compiler, *_flags()]
    home = pathlib.Path(folder) if folder is not None else _cache_folder()
    plugin = home / _hash_of(command) / "plugins" / _PLUGIN
    if not plugin.exists():
        _compile(command, plugin)
    return plugin


def _cache_folder() -> pathlib.Path:
    return pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "glint-ndf" / "mitsuba"


def _home_of(package: str) -> pathlib.Path:
    found = importlib.util.find_spec(package)
    if found is None:
        raise gn.UnsupportedError(f"glint_native: compiling needs the package {package}: pip install {package}")
    return pathlib.Path(found.origin).parent


def _flags() -> list[str]:
    """Flags of the compiler. Mitsuba's wheel is compiled for x86-64-v2, and its classes differ for other processors."""
    mitsuba, drjit, nanobind = _home_of("mitsuba"), _home_of("drjit"), _home_of("nanobind")
    module = pathlib.Path(gn._glint.__file__)
    includes = [
        mitsuba / "include",
        drjit / "include",
        nanobind / "include",
        nanobind / "ext" / "robin_map" / "include",
        module.parent / "include",
    ]
    libraries = [
        (mitsuba, ["-lmitsuba"]),
        (drjit, ["-ldrjit-core", "-ldrjit-extra", "-lnanothread"]),
        (module.parent, [f"-l:{module.name}"]),
    ]
    for folder in includes:
        if not folder.is_dir():
            raise gn.UnsupportedError(
                f"glint_native: there are no headers in {folder}; install the wheels of Mitsuba, Dr.Jit and nanobind"
            )
    flags = ["-std=c++20", "-O2", "-march=x86-64-v2", "-fPIC", "-shared", "-fvisibility=hidden", "-w"]
    flags += [f"-I{folder}" for folder in includes] + [str(_SOURCE)]
    for folder, names in libraries:
        flags += [f"-L{folder}", *names, f"-Wl,-rpath,{folder}"]
    return flags


def _hash_of(command: list[str]) -> str:
    versions = [importlib.metadata.version(package) for package in ("mitsuba", "drjit", "nanobind")]
    parts = [*command, *versions, gn.__version__, _SOURCE.read_text()]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


def _compile(command: list[str], plugin: pathlib.Path) -> None:
    """Compiles into a temporary file and renames it, so that others never load half a plugin."""
    plugin.parent.mkdir(parents=True, exist_ok=True)
    handle, made = tempfile.mkstemp(dir=plugin.parent, suffix=".so")
    os.close(handle)
    try:
        done = subprocess.run([*command, "-o", made], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise gn.FailedError(f"glint_native: the compiler failed:\n{done.stderr[-2000:]}")
        os.replace(made, plugin)
    finally:
        if os.path.exists(made):
            os.unlink(made)
