#pragma once

// Private to formats/.

#include "glint/formats/findings.h"
#include "glint/formats/schema.h"
#include "glint/formats/structure.h"

namespace glint::formats {

/// Checks name, version, features and kind of a file. Returns the kind's schema, or nullptr if it cannot be read further.
const KindSchema* checkHeader(const FileStructure& structure, Findings& findings);

/// Checks attributes and datasets against the schema of the kind.
void checkConformance(const FileStructure& structure, const KindSchema& schema, Findings& findings);

}  // namespace glint::formats
