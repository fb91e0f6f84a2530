#include "support/source_folder.h"

namespace glint::test {

std::filesystem::path sourceFolder() { return GLINT_SOURCE_DIR; }

}  // namespace glint::test
