"""The query headers are device code. Clang compiles tests/device for NVIDIA GPUs, without a CUDA toolkit: every model is made
and asked in a kernel, so that a call of a host function is an error. What this cannot show is nvcc's own opinion and the
numbers; glint-device-check shows those where there are a compiler and a GPU."""

import os
import pathlib
import re
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).parents[2]
BUILD = pathlib.Path(os.environ.get("GLINT_BUILD_DIR", ROOT / "build"))
# Clang 14 crashes on std::span in device code.
NAMES = ["clang++-16", "clang++-17", "clang++-18", "clang++-19", "clang++-15", "clang++"]
# What CUDA has for device code under these names.
CUDA_FUNCTIONS = {
    "__ffsll",
    "__popcll",
    "abs",
    "acosf",
    "asinf",
    "atan2",
    "atan2f",
    "atanf",
    "ceil",
    "ceilf",
    "copysignf",
    "cos",
    "cosf",
    "erfcf",
    "erff",
    "erfinvf",
    "exp2f",
    "expf",
    "expm1f",
    "fabs",
    "fabsf",
    "floor",
    "floorf",
    "fmaxf",
    "fminf",
    "hypot",
    "hypotf",
    "log1pf",
    "log2f",
    "logf",
    "memcpy",
    "memset",
    "powf",
    "sin",
    "sinf",
    "sqrt",
    "sqrtf",
    "tanf",
}


def compile_cuda(clang, source, folder, *flags):
    output = folder / "out.ll"
    command = [
        clang,
        "-x",
        "cuda",
        *flags,
        "-nocudainc",
        "-nocudalib",
        "--cuda-gpu-arch=sm_70",
        "-std=c++20",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-O1",
        "-S",
        "-emit-llvm",
        "-I",
        BUILD / "include",
        "-I",
        ROOT / "tests/device/shim",
        "-I",
        ROOT / "tests",
        "-include",
        "cuda_shim.h",
        source,
        "-o",
        output,
    ]
    process = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    return process, output.read_text() if process.returncode == 0 else ""


@pytest.fixture(scope="module")
def clang(tmp_path_factory):
    folder = tmp_path_factory.mktemp("probe")
    probe = folder / "probe.cu"
    probe.write_text(
        "#include <span>\nstruct A { std::span<const int> s; A() = default; };\n__global__ void f(int* a) { A b; *a = b.s.empty(); }\n"
    )
    for name in NAMES:
        if shutil.which(name) and compile_cuda(name, probe, folder, "--cuda-device-only")[0].returncode == 0:
            return name
    pytest.skip("needs clang 15 or newer that can compile for NVIDIA GPUs")


def test_query_headers_compile_as_device_code(clang, tmp_path):
    process, code = compile_cuda(clang, ROOT / "tests/device/compile_check.cu", tmp_path, "--cuda-device-only")
    assert process.returncode == 0, process.stderr
    assert 'target triple = "nvptx64' in code
    kernels = " ".join(re.findall(r'!\{ptr @(\w+), !"kernel", i32 1\}', code))
    models = (
        "9ReferenceE",
        "11ManifoldNdfE",
        "10PyramidNdfE",
        "5CpNdfE",
        "9BinMapNdfE",
        "12HistogramNdfE",
        "10MomentsNdfE",
        "14TinyExampleNdfE",
        "13WangReferenceE",
        "7WaveNdfE",
        "9WaveCpNdfE",
    )
    for name in (*(f"answerINS_{model}" for model in models), "answerPacked", "weigh", "drawBrdf", "shade", "reflect", "light"):
        assert name in kernels
    # All else is in the module: nothing waits for a function of the host.
    declared = set(re.findall(r"^declare [^@]*@([\w.]+)\(", code, re.MULTILINE))
    assert {name for name in declared if not name.startswith("llvm.")} <= CUDA_FUNCTIONS


@pytest.mark.parametrize("side", ["--cuda-device-only", "--cuda-host-only"])
def test_program_for_the_gpu_compiles(clang, tmp_path, side):
    process, _ = compile_cuda(clang, ROOT / "tests/device/device_check.cu", tmp_path, side)
    assert process.returncode == 0, process.stderr


def test_a_call_of_a_host_function_is_seen(clang, tmp_path):
    """A guard against a check that passes everything."""
    source = tmp_path / "bad.cu"
    source.write_text(
        '#include "glint/query/cp_ndf.h"\n#include <vector>\nnamespace glint { GLINT_HD inline int deep(int n) { return int(std::vector<int>(n).size()); } }\n'
        "__global__ void kernel(int* out) { *out = glint::deep(*out); }\n"
    )
    process, _ = compile_cuda(clang, source, tmp_path, "--cuda-device-only")
    assert process.returncode != 0
    assert "__host__ function" in process.stderr
