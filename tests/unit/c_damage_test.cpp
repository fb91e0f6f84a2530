// Answers of the C interface are finite and not negative, whatever the arrays of a file hold that was opened without checks.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "glint.h"
#include "glint/api/any_ndf.h"
#include "glint/formats/asset_reader.h"
#include "support/hdf5_bytes.h"
#include "support/source_folder.h"
#include "support/temp_folder.h"

namespace glint::c_damage_test {
namespace {

constexpr int kFilesOfKind = 60;  // of each golden file, each with other damage: enough that damage of a 20th of files shows

/// A change of an array: words that are no numbers, or are too large, at random places.
void damage(test::Bytes& bytes, const formats::DatasetInfo& array, std::mt19937& random) {
  constexpr std::uint32_t kBad[] = {0x7fc00000, 0xffc00000, 0x7f800000, 0xff800000, 0x7f7fffff,
                                    0xbf800000, 0x7e007e00, 0xfc00fc00, 0x00000001, 0xffffffff};
  if (array.size_bytes < sizeof(std::uint32_t)) return;
  const std::uint64_t words = array.size_bytes / sizeof(std::uint32_t);
  const std::uint64_t count = random() % 4 == 0 ? words : 1 + random() % std::min<std::uint64_t>(words, 16);
  for (std::uint64_t k = 0; k < count; ++k) {
    const std::uint32_t word = random() % 8 == 0 ? static_cast<std::uint32_t>(random()) : kBad[random() % std::size(kBad)];
    const std::uint64_t at = array.offset + sizeof word * (count == words ? k : random() % words);
    for (std::size_t b = 0; b < sizeof word; ++b) bytes[at + b] = static_cast<std::byte>(word >> (8 * b));
  }
}

bool isDensity(float value) { return std::isfinite(value) && value >= 0; }

/// Asks everything once. @return whether the file opened
bool answersAreDefined(const std::string& path) {
  glint_ndf* ndf = nullptr;
  if (glint_ndf_open(path.c_str(), nullptr, &ndf) != GLINT_OK) return false;
  for (const glint_footprint& p : {glint_footprint_isotropic(0.3, 0.6, 0.7f), glint_footprint_isotropic(0.9, 0.1, 6),
                                   glint_footprint_isotropic(0.3, 0.6, 400), glint_footprint_box(0.5, 0.5, 9, 1, -1, 7)}) {
    float density = 0, mean = 0, hx = 0, hy = 0, pdf = 0;
    float rgb[3] = {};
    EXPECT_EQ(glint_density(ndf, &p, 0.1f, -0.05f, &density), GLINT_OK);
    EXPECT_EQ(glint_density_rgb(ndf, &p, 0.1f, -0.05f, rgb), GLINT_OK);
    EXPECT_EQ(glint_mean(ndf, &p, -0.2f, -0.3f, 0.3f, 0.1f, &mean), GLINT_OK);
    EXPECT_EQ(glint_sample(ndf, &p, 0.4f, 0.7f, &hx, &hy, &pdf), GLINT_OK);
    EXPECT_TRUE(isDensity(density) && isDensity(mean) && isDensity(pdf)) << density << ' ' << mean << ' ' << pdf;
    // Colours may be below 0: they lie outside the gamut.
    EXPECT_TRUE(std::isfinite(rgb[0]) && std::isfinite(rgb[1]) && std::isfinite(rgb[2]))
        << rgb[0] << ' ' << rgb[1] << ' ' << rgb[2];
    EXPECT_TRUE(std::isfinite(hx) && std::isfinite(hy)) << hx << ' ' << hy;
  }
  glint_ndf_close(ndf);
  return true;
}

TEST(CDamage, AnswersAreFiniteWhateverTheArraysHold) {
  const test::TempFolder folder;
  const std::string path = folder / "damaged.glint";
  std::mt19937 random(23);
  int opened = 0;
  std::vector<std::filesystem::path> paths;
  for (const auto& entry : std::filesystem::directory_iterator(test::goldenFolder())) paths.push_back(entry.path());
  std::sort(paths.begin(), paths.end());  // the damage of each file depends on those before it
  for (const std::filesystem::path& golden : paths) {
    const formats::Asset asset = formats::Asset::open(golden);
    if (!api::answersNdf(asset.kind())) continue;
    SCOPED_TRACE(golden.filename().string());
    const test::Bytes good = test::readBytes(golden.string());
    for (int k = 0; k < kFilesOfKind; ++k) {
      SCOPED_TRACE(k);
      test::Bytes bytes = good;
      damage(bytes, asset.info().datasets[random() % asset.info().datasets.size()], random);
      test::writeBytes(path, bytes);
      opened += answersAreDefined(path);
      if (HasFailure()) return;
    }
  }
  EXPECT_GT(opened, kFilesOfKind) << "most damage of values is not seen when a file is opened";
}

}  // namespace
}  // namespace glint::c_damage_test
