#include "glint-displace/base_table_file.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <span>

#include "common/files.h"
#include "glint/bake/displace/merl_table.h"

namespace glint::apps {
namespace {

constexpr double kGain = 1.05;  // beyond what steps of bins add to a white table

/// Refuses a file of another size than its head says, before all of it is read.
void checkSize(const std::string& path) {
  std::array<std::byte, 12> head = {};
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(head.data()), head.size());
  bake::checkMerlSize(std::span(head).first(static_cast<std::size_t>(file.gcount())), std::filesystem::file_size(path));
}

}  // namespace

BaseTableFile::BaseTableFile(Tool& tool) : tool_(tool) {
  option_ =
      &tool.option("--base-table", path_,
                   "isotropic BRDF as a table in the form of the MERL database (.binary): three 32-bit integers 90, 90, 180, "
                   "then doubles of red, green and blue by half angle, difference angle and its azimuth");
  tool.addCheck([this, &tool] {
    if (path_.empty()) return;
    checkRegular(path_);
    tool.addInput(path_);
  });
}

std::shared_ptr<const bake::MeasuredBrdf> BaseTableFile::read() const {
  if (path_.empty()) return nullptr;
  try {
    checkSize(path_);
    const bake::MerlTable table = bake::readMerl(readFile(path_));
    if (table.negative > 0)
      tool_.warn(fmt::format("{}: {} of {} values are negative: bins without a measurement, which count as black", path_,
                             table.negative, table.values.size()));
    auto brdf = std::make_shared<const bake::MeasuredBrdf>(table);
    if (brdf->albedo() > kGain)
      tool_.warn(fmt::format("{}: the table reflects {:.2f} times the light that arrives", path_, brdf->albedo()));
    return brdf;
  } catch (const Error& error) {
    if (!error.path().empty()) throw;
    throw Error(error.code(), error.rule(), path_, error.object(), error.clause(), error.remedy());
  }
}

}  // namespace glint::apps
