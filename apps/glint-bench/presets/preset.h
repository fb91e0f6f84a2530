#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "glint-bench/lab/bench_lab.h"

namespace glint::apps {

/// One figure of a paper beside ours.
struct PresetRow {
  std::string source;                ///< "Table 2"
  std::string subject;               ///< "brushed metal 2K^2, stride 32, rank 16"
  std::string figure;                ///< "bytes of the compressed asset"
  std::string unit;                  ///< "MB"; empty: a plain number
  std::optional<double> paper = {};  ///< as the paper prints it, in the unit; none: the paper prints no number
  std::optional<double> ours = {};   ///< none: the note says why
  std::string note = {};
};

/// What the steps of a preset work with.
struct PresetRun {
  Tool& tool;
  BenchLab& lab;
  bool quick;
  std::vector<PresetRow>& rows;

  /// Texels along an axis of a map of this size in the paper; a quarter with --quick.
  int sizeOf(int texels) const { return quick ? texels / 4 : texels; }
  /// A synthetic map of this size.
  const LabMap& map(bake::SynthKind kind, int texels) const;
};

/// The tables and plots of one paper, on maps of the same kind.
struct Preset {
  std::string name;   ///< "deng2022"
  std::string paper;  ///< "Deng 2022, Constant-Cost Spatio-Angular Prefiltering ..."
  std::vector<std::function<void(PresetRun&)>> steps;
};

/// Every preset, by year.
std::vector<Preset> presets();

// Private to presets: those of one paper each.

Preset gamboa2018();
Preset wu2019();
Preset atanasov2021();
Preset deng2022();
Preset xing2024();

}  // namespace glint::apps
