#pragma once

// Private to formats/.

#include <string>
#include <string_view>

#include "glint/formats/structure.h"

namespace glint::formats {

/// Root attribute that holds the digest of the file.
inline constexpr std::string_view kDigestAttribute = "digest";

/// Digest of all that a file holds: paths, attributes but the digest itself, types and sizes of datasets. The hashes of datasets are
/// attributes, so that the digest stands for their bytes, too.
/// @return 32 lower-case hexadecimal digits, as SPEC.md, section 3 says
std::string digestOf(const FileStructure& structure);

}  // namespace glint::formats
