"""Runs MaterialX's own code of the node flake2d: its GLSL, with the few changes that make it C++."""

import pathlib
import re
import shutil
import subprocess

import numpy as np

import MaterialX as mx

LIBRARY = pathlib.Path(mx.__file__).parent / "libraries" / "stdlib" / "genglsl"
# Functions that mx_flake reaches.
NOISE = (
    "mx_floor",
    "mx_rotl32",
    "mx_bjmix",
    "mx_bjfinal",
    "mx_bits_to_01",
    "mx_hash_int",
    "mx_cell_noise_float",
    "mx_cell_noise_vec3",
)

SHIM = """
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>
using std::abs, std::sqrt, std::floor, std::sin, std::cos;
typedef unsigned uint;
struct vec2 { float x, y; };
struct vec3 { float x, y, z; vec3() {} explicit vec3(float a) : x(a), y(a), z(a) {} vec3(float a, float b, float c) : x(a), y(b), z(c) {} };
struct vec4 { float x, y, z, w; vec4(float a, float b, float c, float d) : x(a), y(b), z(c), w(d) {} vec4(vec3 v, float d) : x(v.x), y(v.y), z(v.z), w(d) {} };
struct mat3 { float m[9]; template <class... T> mat3(T... values) : m{float(values)...} {} };
vec3 operator+(vec3 a, vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
vec3 operator-(vec3 a, vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
vec3 operator/(vec3 a, vec3 b) { return {a.x / b.x, a.y / b.y, a.z / b.z}; }
vec3 operator*(vec3 a, float s) { return {a.x * s, a.y * s, a.z * s}; }
// Matrices of GLSL are given by columns.
vec3 operator*(mat3 a, vec3 v) { const float* m = a.m; return {m[0] * v.x + m[3] * v.y + m[6] * v.z, m[1] * v.x + m[4] * v.y + m[7] * v.z, m[2] * v.x + m[5] * v.y + m[8] * v.z}; }
vec3 floor(vec3 v) { return {floor(v.x), floor(v.y), floor(v.z)}; }
float dot(vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
vec3 normalize(vec3 v) { return v * (1 / sqrt(dot(v, v))); }
float clamp(float x, float low, float high) { return x < low ? low : x > high ? high : x; }
const float M_PI_ = 3.1415926535897932f;
#undef M_PI
#define M_PI M_PI_
"""

MAIN = """
int main(int, char** argv) {
  const int width = atoi(argv[1]), height = atoi(argv[2]);
  const float size = atof(argv[3]), roughness = atof(argv[4]), coverage = atof(argv[5]), z = atof(argv[6]);
  std::vector<float> pixels;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      int id; float rand, presence; vec3 normal;
      mx_flake(size, roughness, coverage, vec3((i + 0.5) / width, (j + 0.5) / width, z), vec3(0, 0, 1), vec3(1, 0, 0), vec3(0, 1, 0), id, rand, presence, normal);
      for (float value : {presence, normal.x, normal.y}) pixels.push_back(value);
    }
  fwrite(pixels.data(), sizeof(float), pixels.size(), stdout);
}
"""


def functions(text, names):
    """Definitions of the functions with these names, in their order."""
    matches = list(re.finditer(r"^\w+ (mx_\w+)\([^)]*\)\n\{.*?^\}\n", text, re.DOTALL | re.MULTILINE))
    assert set(names) <= {match.group(1) for match in matches}, "the library has other functions than it had"
    return "\n".join(match.group(0) for match in matches if match.group(1) in names)


def compiled(folder):
    """A program that evaluates the node at the centres of texels."""
    noise = functions((LIBRARY / "lib" / "mx_noise.glsl").read_text(), NOISE)
    flake = re.sub(r"#include.*", "", (LIBRARY / "lib" / "mx_flake.glsl").read_text())
    code = re.sub(r"\b(?:in)?out (\w+) ", r"\1& ", noise + flake)
    (folder / "node.cpp").write_text(SHIM + code + MAIN)
    compiler = shutil.which("c++")
    # GLSL's constants are floats, and nothing is fused.
    subprocess.run(
        [
            compiler,
            "-std=c++20",
            "-O2",
            "-fsingle-precision-constant",
            "-ffp-contract=off",
            "-o",
            folder / "node",
            folder / "node.cpp",
        ],
        check=True,
    )
    return folder / "node"


def evaluate(program, width, height, size, roughness, coverage, z=0):
    """presence [rows][columns], and normals [rows][columns][2]; bottom row first."""
    output = subprocess.run(
        [program, *map(str, (width, height, size, roughness, coverage, z))], capture_output=True, check=True
    ).stdout
    pixels = np.frombuffer(output, np.float32).reshape(height, width, 3)
    return pixels[..., 0], pixels[..., 1:]
