#pragma once

#include <span>
#include <string>

#include "common/tool.h"

namespace glint::apps {

/// Mix-in: tables of answers. `--csv TABLE` answers a table of queries, `--samples N` makes a table of samples, and
/// `-o OUTPUT` says where the table goes; "-" is stdout.
class TableOptions {
 public:
  TableOptions(Tool& tool, const std::string& csv_help, const std::string& samples_help);

  /// --csv and --samples, for their constraints.
  Option& csvOption() { return *csv_option_; }
  Option& samplesOption() { return *samples_option_; }

  bool csvGiven() const { return csv_option_->given(); }
  const std::string& csv() const { return csv_; }
  /// Samples that are asked for; 0: none.
  int samples() const { return samples_; }

  void write(const std::string& text) const;

 private:
  void check() const;

  Tool& tool_;
  std::string csv_, output_;
  int samples_ = 0;
  Option *csv_option_, *samples_option_, *output_option_;
};

/// Mix-in: `--image FILE`, a picture of a distribution, and its size.
class PictureOptions {
 public:
  explicit PictureOptions(Tool& tool);

  /// --image, for constraints.
  Option& option() { return *option_; }
  bool given() const { return option_->given(); }
  /// @param own  pixels along each axis where --image-size was not given
  /// @throws Error failed if the picture takes more than --max-memory
  int size(int own) const;

  /// Writes the picture, and sets it as the result of the tool.
  /// @param densities  [size][size], bottom row first
  void write(int size, std::span<const float> densities) const;
  /// The same in colour. @param rgb  [size][size][3]
  void writeColours(int size, std::span<const float> rgb) const;

 private:
  void check() const;

  Tool& tool_;
  std::string path_;
  int size_ = 0;
  Option* option_;
};

}  // namespace glint::apps
