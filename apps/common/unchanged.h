#pragma once

#include <functional>
#include <string>

#include "glint/formats/provenance.h"

namespace glint::apps {

/// Whether a file is a whole asset that a run of this record would only make again: the same tool and version, parameters and inputs.
/// @param run     generator and command of the run, without its inputs
/// @param inputs  gives the record of the inputs of the run; called only if all else is equal, because it reads them
/// @param trust   do not compare the asset with its hashes
/// @note other files, and damaged assets, are not; inputs of inputs (formats::chained) do not count
/// @throws Error  what `inputs` throws
bool isMadeBy(const std::string& path, const formats::Provenance& run, const std::function<formats::Provenance()>& inputs,
              bool trust);

}  // namespace glint::apps
