"""A kind of asset is added in one line and one file: done here with a toy kind, in a copy of the sources.

The copy is built and the toy is written, checked, read and described by code that knows nothing of it.
"""

import pathlib
import shutil
import subprocess

import pytest

ROOT = pathlib.Path(__file__).parents[2]

# The line: the struct of the kind joins the list, with its name. What comes before and after it is today's.
LIST = "formats/kinds.h"
LIST_EDITS = {
    '#include "glint/model/sh.h"\n': '#include "glint/model/sh.h"\n#include "glint/model/toy.h"\n',
    "std::variant<BinMap,": "std::variant<Toy, BinMap,",  # the end of the list changes with every kind
    'kKindName<ShLobes> = "sh-lobes";\n': 'kKindName<ShLobes> = "sh-lobes";\ntemplate <>\ninline constexpr std::string_view kKindName<Toy> = "toy";\n',
}

# The file, and the struct that it describes.
STRUCT = """#pragma once
#include <span>
namespace glint {
struct Toy {
  int count = 0;
  float scale = 1;
  std::span<const float> values;  ///< [count]
};
}  // namespace glint
"""
DESCRIPTION = """#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/shared_fields.h"

namespace glint::formats {

template <>
struct KindDescription<Toy> {
  static constexpr std::string_view kTitle = "Toy";
  static std::vector<Rule> indexRules() { return {}; }
  static std::vector<Rule> valueRules() { return {errorRule("toy.finite", "values are finite")}; }

  static void describe(Fields auto& fields, auto& toy) {
    fields.integer("count", toy.count, {0, 1000}, "1", "number of values");
    fields.real("scale", toy.scale, kPositive, "um", "size of a toy");
    fields.array("values", toy.values, {"count"}, "1", "values of the toy");
  }

  static void checkIndex(const Toy&, Findings&) {}
  static void checkValues(const Toy& toy, Findings& findings) {
    for (const float value : toy.values)
      if (!std::isfinite(value)) return findings.add("toy.finite", "/values", "holds a value that is not finite");
  }
};

template const Kind& kindOf<Toy>();

}  // namespace glint::formats
"""

PROGRAM = """#include <cmath>
#include <cstdio>
#include <vector>

#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/validate.h"

using namespace glint;

int main(int, char** argv) {
  const std::vector<float> values = {1, 2, 4};
  formats::writeAsset(argv[1], Toy{3, 0.5f, values}, {"toy 1.0", "{}", {}});
  const formats::Asset asset = formats::Asset::openForBuilding(argv[1]);
  const Toy& toy = asset.get<Toy>();
  std::printf("%s %d %g %g\\n", std::string(asset.kind()).c_str(), toy.count, double{toy.scale}, double{toy.values[2]});
  std::printf("%s %s\\n", asset.info().attributes[1].name.c_str(), asset.info().attributes[1].units.c_str());
  std::printf("%zu\\n", formats::validateAsset(argv[1]).findings.size());
  const std::vector<float> bad = {NAN};
  formats::writeAsset(argv[2], Toy{1, 0.5f, bad}, {"toy 1.0", "{}", {}});
  std::printf("%s\\n", formats::validateAsset(argv[2]).findings[0].rule.c_str());
  try {
    asset.get<HeightMap>();
  } catch (const Error& error) {
    std::printf("%s\\n", error.clause().c_str());
  }
}
"""

BUILD = """cmake_minimum_required(VERSION 3.25)
project(toy LANGUAGES C CXX)
set(GLINT_BUILD_WRITER ON)
add_subdirectory(glint)
add_executable(toy toy.cpp)
target_link_libraries(toy PRIVATE glint::writer)
"""


def run(*command):
    process = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    assert process.returncode == 0, f"{' '.join(map(str, command))}\n{process.stdout}\n{process.stderr}"
    return process.stdout


@pytest.fixture
def sources(tmp_path):
    """The sources of the reader with the toy kind added, and a project that uses them."""
    copy = tmp_path / "glint"
    for folder in ("libglint", "formats", "cmake"):
        shutil.copytree(ROOT / folder, copy / folder)
    shutil.copy(ROOT / "CMakeLists.txt", copy)
    text = (copy / LIST).read_text()
    for old, new in LIST_EDITS.items():
        assert text.count(old) == 1, f"{LIST} has another form: {old}"
        text = text.replace(old, new)
    (copy / LIST).write_text(text)
    (copy / "libglint/model/toy.h").write_text(STRUCT)
    (copy / "formats/kinds/toy.cpp").write_text(DESCRIPTION)
    (tmp_path / "toy.cpp").write_text(PROGRAM)
    (tmp_path / "CMakeLists.txt").write_text(BUILD)
    return tmp_path


def test_toy_kind_takes_a_line_and_a_file(sources):
    build = sources / "build"
    run("cmake", "-S", sources, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Debug")
    run("cmake", "--build", build, "--target", "toy")
    shown = run(build / "bin/toy" if (build / "bin/toy").exists() else build / "toy", sources / "a.glint", sources / "b.glint")
    assert shown.splitlines() == ["toy 3 0.5 4", "scale um", "0", "toy.finite", "is of kind toy, not heights"]
