#pragma once

#include <filesystem>

namespace glint::test {

/// The root of the sources. Known to one source only: ccache then serves all others to a checkout in another folder.
std::filesystem::path sourceFolder();

/// The golden files of format 1.0.
inline std::filesystem::path goldenFolder() { return sourceFolder() / "tests/golden/v1.0"; }

}  // namespace glint::test
