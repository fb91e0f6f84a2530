#include "glint/formats/provenance.h"

#include <utility>

namespace glint::formats {

Provenance chained(Provenance run, const Provenance& of_input) {
  const std::string name = run.inputs.empty() ? std::string() : run.inputs.front().name;
  for (const InputRecord& input : of_input.inputs) run.inputs.push_back({name + "/" + input.name, input.hash_hex});
  return run;
}

}  // namespace glint::formats
