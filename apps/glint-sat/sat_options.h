#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/tool.h"
#include "glint/bake/histogram/histogram_sat.h"

namespace glint::apps {

/// The options of glint-sat.
class SatOptions {
 public:
  explicit SatOptions(Tool& tool);

  /// Valid after parsing.
  const bake::HistogramSatOptions& values() const { return values_; }

 private:
  void readBins();

  bake::HistogramSatOptions values_;
  std::string bins_ = "9x32";
};

/// Bins, strides and bytes of each table.
nlohmann::json satJson(const bake::HistogramSatData& sat);
std::string satText(const bake::HistogramSatData& sat);

}  // namespace glint::apps
