#include "glint-query/output_options.h"

#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/memory_needs.h"
#include "common/ndf_picture.h"
#include "glint-query/usage.h"

namespace glint::apps {
TableOptions::TableOptions(Tool& tool, const std::string& csv_help, const std::string& samples_help) : tool_(tool) {
  csv_option_ = &tool.option("--csv", csv_, csv_help);
  samples_option_ = &tool.option("--samples", samples_, samples_help).range(1, 100000000);
  output_option_ = &tool.option("-o,--output", output_, "where the table of --csv or --samples goes; - for stdout");
  csv_option_->excludes(*samples_option_);
  tool.addCheck([this] { check(); });
}

void TableOptions::check() const {
  const bool makes_table = csvGiven() || samples_ > 0;
  if (makes_table && !output_option_->given())
    throwUsage(csvGiven() ? "--csv needs a place for the answers" : "--samples needs a place for them",
               "add -o OUT.csv, or -o - for stdout");
  if (!makes_table && output_option_->given()) throwUsage("-o is for tables", "add --csv or --samples, or leave it out");
  if (!makes_table) return;
  if (output_ == "-" && tool_.wantsJson())
    throwUsage("--json and -o - both write to stdout", "name a file with -o, or leave out --json");
  if (output_ != "-") {
    checkOutput(tool_, output_, OutputFormat::table);
    tool_.addOutput(output_);
  }
  if (!csvGiven()) return;
  checkReadable(csv_);
  tool_.addInput(csv_);
}

void TableOptions::write(const std::string& text) const {
  if (output_ == "-")
    tool_.print(text);
  else
    writeTextFile(output_, text);
}

PictureOptions::PictureOptions(Tool& tool) : tool_(tool) {
  option_ =
      &tool.option("--image", path_,
                   "write the NDF image: densities (kinds wave-pyramid and wave-cp: linear sRGB) as .exr, colours as .png");
  tool.option("--image-size", size_, "pixels of the image along each axis")
      .range(1, 4096)
      .defaultText("the asset's own, or 256");
  tool.addCheck([this] { check(); });
}

void PictureOptions::check() const {
  if (!given()) return;
  checkPictureName(path_);
  checkOutput(tool_, path_, OutputFormat::image);
  tool_.addOutput(path_);
}

int PictureOptions::size(int own) const {
  const int size = size_ > 0 ? size_ : own;
  requireMemoryFor(tool_, "a picture of", size, size, BytesPerTexel::kPicture, "give a smaller --image-size");
  return size;
}

void PictureOptions::write(int size, std::span<const float> densities) const {
  writeNdfPicture(path_, size, densities);
  tool_.setResult({{"image", path_}, {"image_size", size}});
}

void PictureOptions::writeColours(int size, std::span<const float> rgb) const {
  writeColourPicture(path_, size, rgb);
  tool_.setResult({{"image", path_}, {"image_size", size}});
}

}  // namespace glint::apps
