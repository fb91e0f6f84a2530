#pragma once

#include <memory>
#include <string>

#include "common/tool.h"
#include "glint/bake/displace/measured_brdf.h"

namespace glint::apps {

/// Mix-in: a base that is a table in a file (--base-table).
class BaseTableFile {
 public:
  explicit BaseTableFile(Tool& tool);

  /// The option, for others that exclude it.
  const Option& option() const { return *option_; }

  /// Reads the table; warns of bins without a measurement, and of a table that reflects more light than arrives.
  /// @return null where no table is given
  /// @throws Error io; invalid_input: the file is no table in MERL's form, or has values that cannot be used
  std::shared_ptr<const bake::MeasuredBrdf> read() const;

 private:
  Tool& tool_;
  std::string path_;
  const Option* option_ = nullptr;
};

}  // namespace glint::apps
