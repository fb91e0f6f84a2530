"""Finds an LLVM library that Dr.Jit accepts, for the variants `llvm_*`."""

import ctypes.util
import glob
import os
import re
import sys
import warnings

#: Dr.Jit 1.5 refuses LLVM 14 and older; with 15 and 16 the process aborts.
OLDEST_VERSION = 17

_VARIABLE = "DRJIT_LIBLLVM_PATH"
_FOLDERS = (
    "/usr/lib/x86_64-linux-gnu",
    "/usr/lib/aarch64-linux-gnu",
    "/usr/lib/llvm-*/lib",
    "/usr/lib64",
    "/usr/lib64/llvm*/lib64",
    "/usr/lib",
    "/usr/local/lib",
)
_VERSION = re.compile(r"libLLVM(?:-(\d+))?\.so(?:\.(\d+))?")


def version_of(path):
    """The major version that the name of a library gives, or of the file that it links to; None if neither gives one."""
    for name in (os.path.basename(path), os.path.basename(os.path.realpath(path))):
        match = _VERSION.match(name)
        number = match and (match.group(1) or match.group(2))
        if number and int(number) > 1:
            return int(number)
    return None


def find(folders=_FOLDERS):
    """Path of the newest LLVM library of at least OLDEST_VERSION in the usual folders; None if there is none."""
    found = []
    for folder in folders:
        for path in glob.glob(os.path.join(folder, "libLLVM*.so*")):
            version = version_of(path)
            if version is not None and version >= OLDEST_VERSION and os.path.exists(path):
                found.append((version, path))
    return max(found)[1] if found else None


def prepare():
    """Names a library in DRJIT_LIBLLVM_PATH where the user has not. Returns the path, or None if there is none to name.

    Must run before the first variant `llvm_*` is set: Dr.Jit looks for LLVM once. On systems other than Linux, Dr.Jit's own
    search is left alone.
    """
    if os.environ.get(_VARIABLE):
        return os.environ[_VARIABLE]
    if not sys.platform.startswith("linux"):
        return None
    path = find()
    if path:
        os.environ[_VARIABLE] = path
    return path


def warn_if_missing():
    """Warns, before a variant `llvm_*` is set, that no usable LLVM is installed."""
    if sys.platform.startswith("linux") and prepare() is None and not ctypes.util.find_library("LLVM"):
        warnings.warn(
            f"no LLVM library of version {OLDEST_VERSION} or newer was found; Mitsuba's variants llvm_* need one. Install it"
            f" (Debian and Ubuntu: apt install libllvm19), or name it in {_VARIABLE}; the variants scalar_* need none",
            RuntimeWarning,
            stacklevel=3,
        )
