#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <iterator>
#include <random>

#include "glint/bake/common/slopes.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/validate.h"
#include "support/sample_assets.h"
#include "support/temp_folder.h"

namespace glint::formats::formats_round_trip_test {
namespace {

using test::TempFolder;
using testing::HasSubstr;
namespace fs = std::filesystem;

std::string readBytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void writeBytes(const fs::path& path, const std::string& bytes) { std::ofstream(path, std::ios::binary) << bytes; }

template <class T>
std::string bytesOf(std::span<const T> span) {
  return {reinterpret_cast<const char*>(span.data()), span.size_bytes()};
}

template <class T>
void expectSame(std::span<const T> a, std::span<const T> b) {
  EXPECT_EQ(bytesOf(a), bytesOf(b));
}

/// Pointers may be null where there are no bytes.
void expectSameBytes(const void* a, const void* b, std::size_t size) {
  const auto bytes = [size](const void* p) { return std::span(static_cast<const std::byte*>(p), size); };
  expectSame(bytes(a), bytes(b));
}

void expectSame(const MapSlopes& a, const MapSlopes& b) {
  EXPECT_EQ(a.mean, b.mean);
  EXPECT_EQ(a.covariance.xx, b.covariance.xx);
  EXPECT_EQ(a.covariance.xy, b.covariance.xy);
  EXPECT_EQ(a.covariance.yy, b.covariance.yy);
}

void expectSame(const PyramidShape& a, const PyramidShape& b) {
  EXPECT_EQ(a.width, b.width);
  EXPECT_EQ(a.height, b.height);
  EXPECT_EQ(a.resolution, b.resolution);
  EXPECT_EQ(a.sigma_r, b.sigma_r);
  EXPECT_EQ(a.surface, b.surface);
  EXPECT_EQ(a.boundary, b.boundary);
  expectSame(a.slopes, b.slopes);
  ASSERT_EQ(a.level_count, b.level_count);
  for (int l = 0; l < a.level_count; ++l) {
    EXPECT_EQ(a.levels[l].stride, b.levels[l].stride);
    EXPECT_EQ(a.levels[l].columns, b.levels[l].columns);
    EXPECT_EQ(a.levels[l].rows, b.levels[l].rows);
  }
}

std::size_t bytesPerCoefficient(CoefficientType type) {
  return type == CoefficientType::i8 ? 1 : type == CoefficientType::f16 ? 2 : 4;
}

/// The id of the rule that opening breaks; empty if it opens.
std::string brokenRule(const fs::path& path, const OpenOptions& options = {}) {
  try {
    Asset::open(path, options);
    return {};
  } catch (const Error& error) {
    return error.rule();
  }
}

TEST(AssetRoundTrip, NormalsComeBackBitExact) {
  const TempFolder folder;
  for (const auto& [width, height, bounds] : {std::tuple{64, 48, true}, {37, 5, true}, {1, 1, false}, {16, 16, false}}) {
    const auto sample = test::sampleNormals(width, height, bounds);
    writeAsset(folder / "a.glint", sample.map, test::sampleProvenance(), {.overwrite = true});
    const Asset asset = Asset::open(folder / "a.glint", {.verify_hashes = true});
    EXPECT_EQ(asset.kind(), "normals");
    const NormalMap& map = asset.get<NormalMap>();
    EXPECT_EQ(map.width, width);
    EXPECT_EQ(map.height, height);
    EXPECT_EQ(map.texel_size_um, 2.5f);
    expectSame(map.normals, sample.map.normals);
    ASSERT_EQ(map.bounds_level_count, sample.map.bounds_level_count);
    for (int k = 0; k < map.bounds_level_count; ++k) {
      EXPECT_EQ(map.bounds[k].columns, sample.map.bounds[k].columns);
      EXPECT_EQ(map.bounds[k].rows, sample.map.bounds[k].rows);
      expectSame(map.bounds[k].nodes, sample.map.bounds[k].nodes);
    }
    EXPECT_TRUE(validateAsset(folder / "a.glint").findings.empty());
  }
}

TEST(AssetRoundTrip, SlopesOfNormalsComeBackIfThereAreAny) {
  const TempFolder folder;
  auto sample = test::sampleNormals(64, 48);
  writeAsset(folder / "without.glint", sample.map, test::sampleProvenance());
  EXPECT_FALSE(Asset::open(folder / "without.glint").get<NormalMap>().slopes);
  sample.map.slopes = bake::mapSlopes(sample.map);
  writeAsset(folder / "with.glint", sample.map, test::sampleProvenance());
  EXPECT_TRUE(validateAsset(folder / "with.glint").findings.empty());
  expectSame(*Asset::open(folder / "with.glint").get<NormalMap>().slopes, *sample.map.slopes);
}

TEST(AssetRoundTrip, SlopesThatAreNotOfTheNormalsAreFound) {
  const TempFolder folder;
  auto sample = test::sampleNormals(64, 48);
  const MapSlopes slopes = bake::mapSlopes(sample.map);
  const auto found = [&](MapSlopes wrong) {
    sample.map.slopes = wrong;
    writeAsset(folder / "a.glint", sample.map, test::sampleProvenance(), {.overwrite = true});
    const auto findings = validateAsset(folder / "a.glint").findings;
    return findings.empty() ? std::string() : findings[0].rule;
  };
  EXPECT_EQ(found(slopes), "");
  EXPECT_EQ(found({{slopes.mean.x + 0.01f, slopes.mean.y}, slopes.covariance}), "normals.slopes");
  EXPECT_EQ(found({slopes.mean, {1.1f * slopes.covariance.xx, slopes.covariance.xy, slopes.covariance.yy}}), "normals.slopes");
}

TEST(AssetRoundTrip, HeightsComeBackBitExact) {
  const TempFolder folder;
  const auto sample = test::sampleHeights(31, 7);
  writeAsset(folder / "a.glint", sample.map, test::sampleProvenance());
  const Asset asset = Asset::open(folder / "a.glint", {.verify_hashes = true});
  EXPECT_EQ(asset.get<HeightMap>().width, 31);
  EXPECT_EQ(asset.get<HeightMap>().height, 7);
  expectSame(asset.get<HeightMap>().heights, sample.map.heights);
  EXPECT_TRUE(validateAsset(folder / "a.glint").findings.empty());
}

TEST(AssetRoundTrip, TablesOfDisplacementsComeBackBitExact) {
  const TempFolder folder;
  const auto sample = test::sampleDisplacedTable(32);
  writeAsset(folder / "a.glint", sample.displacement, test::sampleProvenance());
  const Asset asset = Asset::open(folder / "a.glint", {.verify_hashes = true});
  const Displacement& d = asset.get<Displacement>();
  EXPECT_EQ(d.base.kind, BaseBrdf::Kind::table);
  ASSERT_TRUE(d.table);
  EXPECT_EQ(d.table->diffuse_share, 0.375f);
  EXPECT_TRUE(std::ranges::equal(d.table->values, sample.base_table));
  EXPECT_TRUE(validateAsset(folder / "a.glint").findings.empty());
}

TEST(AssetRoundTrip, DisplacementsComeBackBitExact) {
  const TempFolder folder;
  for (const bool colored : {false, true}) {
    const auto sample = test::sampleDisplacement(32, colored);
    writeAsset(folder / "a.glint", sample.displacement, test::sampleProvenance(), {.overwrite = true});
    const Asset asset = Asset::open(folder / "a.glint", {.verify_hashes = true});
    const Displacement& d = asset.get<Displacement>();
    EXPECT_EQ(std::tuple(d.width, d.height, d.texel_size_um, d.lobe_count, d.angular, d.level_count),
              std::tuple(32, 16, 2.5f, 2, 3, 2));
    EXPECT_EQ(d.base.kind, BaseBrdf::Kind::ggx);
    EXPECT_EQ(std::tuple(d.base.albedo, d.base.alpha, d.base.eta, d.base.k), std::tuple(1.0f, 0.25f, 1.5f, 3.0f));
    for (int l = 0; l < 2; ++l) {
      const DisplacementLevel& level = d.levels[l];
      const DisplacementLevel& wanted = sample.displacement.levels[l];
      EXPECT_EQ(std::tuple(level.factor, level.columns, level.rows, level.spatial_columns, level.spatial_rows),
                std::tuple(4 << l, 8 >> l, 4 >> l, 2, 1));
      EXPECT_EQ(std::tuple(level.rank1_residual, level.rank1_energy, level.interreflected_share, level.distant_share),
                std::tuple(0.125f, 0.75f, 0.25f, 0.0625f));
      expectSame(level.heights, wanted.heights);
      expectSame(level.lobes, wanted.lobes);
      expectSame(level.slopes, wanted.slopes);
      expectSame(level.fit_errors, wanted.fit_errors);
      expectSame(level.spatial_scale, wanted.spatial_scale);
      expectSame(level.angular_scale, wanted.angular_scale);
      expectSame(level.spatial_terms, wanted.spatial_terms);
      expectSame(level.angular_terms, wanted.angular_terms);
      expectSame(level.singular_shares, wanted.singular_shares);
      EXPECT_EQ(level.scale_residual, wanted.scale_residual);
      expectSame(level.lobe_colors, wanted.lobe_colors);
      expectSame(level.lobe_alphas, wanted.lobe_alphas);
      EXPECT_EQ(level.lobe_alphas.empty(), !colored);
    }
    EXPECT_EQ(d.channels, colored ? 3 : 1);
    EXPECT_TRUE(validateAsset(folder / "a.glint").findings.empty());
  }
}

TEST(AssetRoundTrip, PyramidsComeBackBitExact) {
  const TempFolder folder;
  for (const BlockPrecision precision : {BlockPrecision::f16, BlockPrecision::f32}) {
    const auto sample = test::samplePyramid(32, precision);
    writeAsset(folder / "a.glint", sample.pyramid, test::sampleProvenance(), {.overwrite = true});
    const Asset asset = Asset::open(folder / "a.glint", {.verify_hashes = true});
    const NdfPyramid& pyramid = asset.get<NdfPyramid>();
    expectSame(pyramid.shape, sample.pyramid.shape);
    EXPECT_EQ(pyramid.precision, precision);
    EXPECT_EQ(pyramid.value_scale, 4);
    for (int l = 0; l < pyramid.shape.level_count; ++l) {
      const PyramidLevel& wanted = sample.pyramid.levels[l];
      expectSame(pyramid.levels[l].masks, wanted.masks);
      expectSame(pyramid.levels[l].mask_ranks, wanted.mask_ranks);
      expectSame(pyramid.levels[l].block_means, wanted.block_means);
      const std::size_t bytes = wanted.block_means.size() * kBlockPixels * (precision == BlockPrecision::f16 ? 2 : 4);
      expectSameBytes(pyramid.levels[l].pixels, wanted.pixels, bytes);
    }
    const ValidationReport report = validateAsset(folder / "a.glint");
    EXPECT_TRUE(report.findings.empty()) << report.findings[0].rule << " " << report.findings[0].message;
  }
}

TEST(AssetRoundTrip, HistogramsComeBackBitExact) {
  const TempFolder folder;
  for (const auto& [width, height] : {std::pair{22, 19}, {1, 1}, {40, 3}}) {
    const auto sample = test::sampleHistograms(width, height);
    writeAsset(folder / "a.glint", sample.sat, test::sampleProvenance(), {.overwrite = true});
    const Asset asset = Asset::open(folder / "a.glint", {.verify_hashes = true});
    EXPECT_EQ(asset.kind(), "histogram-sat");
    const HistogramSat& sat = asset.get<HistogramSat>();
    EXPECT_EQ(sat.width, width);
    EXPECT_EQ(sat.height, height);
    EXPECT_EQ(sat.theta_bins, 12);
    EXPECT_EQ(sat.phi_bins, 8);
    EXPECT_EQ(sat.bin_count, sample.sat.bin_count);
    EXPECT_EQ(sat.stride, 4);
    EXPECT_EQ(sat.coarse_stride, 8);
    EXPECT_EQ(sat.line_stride, 16);
    expectSame(sat.slopes, sample.sat.slopes);
    expectSame(sat.bin_ids, sample.sat.bin_ids);
    expectSame(sat.bin_normals, sample.sat.bin_normals);
    expectSame(sat.bin_totals, sample.sat.bin_totals);
    expectSame(sat.texels, sample.sat.texels);
    expectSame(sat.sums, sample.sat.sums);
    expectSame(sat.coarse_sums, sample.sat.coarse_sums);
    expectSame(sat.row_sums, sample.sat.row_sums);
    expectSame(sat.column_sums, sample.sat.column_sums);
    const ValidationReport report = validateAsset(folder / "a.glint");
    EXPECT_TRUE(report.findings.empty()) << report.findings[0].rule << " " << report.findings[0].message;
  }
}

TEST(AssetRoundTrip, CompressedPyramidsOfEveryMethodAndTypeComeBackBitExact) {
  const TempFolder folder;
  for (const CompressionMethod method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    for (const auto& [type, form] : {std::pair{CoefficientType::i8, test::SampleForm::wide},
                                     {CoefficientType::i8, test::SampleForm::narrow},
                                     {CoefficientType::i8, test::SampleForm::spots},
                                     {CoefficientType::f16, test::SampleForm::wide},
                                     {CoefficientType::f32, test::SampleForm::wide}}) {
      const auto sample = test::sampleNdfCp(32, method, type, form);
      writeAsset(folder / "a.glint", sample.ndf, test::sampleProvenance(), {.overwrite = true});
      const Asset asset = Asset::open(folder / "a.glint", {.verify_hashes = true});
      const NdfCp& ndf = asset.get<NdfCp>();
      expectSame(ndf.shape, sample.ndf.shape);
      EXPECT_EQ(ndf.method, method);
      EXPECT_EQ(ndf.coefficient_type, type);
      EXPECT_EQ(ndf.regions, 2);
      EXPECT_EQ(ndf.places, 16);
      for (int l = 0; l < ndf.shape.level_count; ++l) EXPECT_EQ(ndf.first_image[l], sample.ndf.first_image[l]);
      expectSame(ndf.image_regions, sample.ndf.image_regions);
      expectSame(ndf.image_slots, sample.ndf.image_slots);
      expectSame(ndf.image_scales, sample.ndf.image_scales);
      expectSame(ndf.density_scales, sample.ndf.density_scales);
      expectSame(ndf.floors, sample.ndf.floors);
      expectSame(ndf.block_places, sample.ndf.block_places);
      expectSame(ndf.place_blocks, sample.ndf.place_blocks);
      expectSame(ndf.core, sample.ndf.core);
      expectSame(ndf.spot_sums, sample.ndf.spot_sums);
      expectSame(ndf.block_masks, sample.ndf.block_masks);
      expectSame(ndf.first_block, sample.ndf.first_block);
      expectSame(ndf.block_masses, sample.ndf.block_masses);
      expectSame(ndf.clusters, sample.ndf.clusters);
      expectSame(ndf.masks, sample.ndf.masks);
      expectSame(ndf.mask_ranks, sample.ndf.mask_ranks);
      expectSame(ndf.scales, sample.ndf.scales);
      expectSame(ndf.basis, sample.ndf.basis);
      ASSERT_EQ(ndf.coefficient_count, sample.ndf.coefficient_count);
      expectSameBytes(ndf.coefficients, sample.ndf.coefficients, ndf.coefficient_count * bytesPerCoefficient(type));
      const ValidationReport report = validateAsset(folder / "a.glint");
      EXPECT_TRUE(report.findings.empty()) << report.findings[0].rule << " " << report.findings[0].message;
    }
  }
}

TEST(AssetRoundTrip, BinMapsComeBackBitExact) {
  const TempFolder folder;
  for (const auto& [width, height] : {std::pair{64, 48}, {37, 5}, {1, 1}}) {
    const auto sample = test::sampleBinMap(width, height);
    writeAsset(folder / "a.glint", sample.map, test::sampleProvenance(), {.overwrite = true});
    const Asset asset = Asset::open(folder / "a.glint", {.verify_hashes = true});
    const BinMap& map = asset.get<BinMap>();
    EXPECT_EQ(std::tuple(map.width, map.height, map.alpha, map.bins_per_axis, map.leaf_size),
              std::tuple(width, height, sample.map.alpha, sample.map.bins_per_axis, sample.map.leaf_size));
    EXPECT_EQ(std::tuple(map.alpha_min, map.alpha_max), std::tuple(sample.map.alpha_min, sample.map.alpha_max));
    EXPECT_EQ(std::tuple(map.slopes.mean.x, map.slopes.mean.y, map.slopes.covariance.xx, map.slopes.covariance.xy,
                         map.slopes.covariance.yy),
              std::tuple(sample.map.slopes.mean.x, sample.map.slopes.mean.y, sample.map.slopes.covariance.xx,
                         sample.map.slopes.covariance.xy, sample.map.slopes.covariance.yy));
    EXPECT_EQ(map.tile_bits, sample.map.tile_bits);
    expectSame(map.nodes, sample.map.nodes);
    expectSame(map.block_moments, sample.map.block_moments);
    expectSame(map.cell_starts.bases, sample.map.cell_starts.bases);
    expectSame(map.cell_starts.offsets, sample.map.cell_starts.offsets);
    EXPECT_EQ(map.cell_starts.shift, sample.map.cell_starts.shift);
    expectSame(map.texels, sample.map.texels);
    expectSame(map.class_keys, sample.map.class_keys);
    expectSame(map.texel_classes, sample.map.texel_classes);
    for (const Finding& finding : validateAsset(folder / "a.glint").findings) ADD_FAILURE() << finding.rule << finding.message;
  }
}

TEST(AssetRoundTrip, SphericalHarmonicsComeBackBitExact) {
  const test::TempFolder folder;
  const test::SampleShLobes lobes = test::sampleShLobes();
  writeAsset(folder / "lobes.glint", lobes.lobes, test::sampleProvenance());
  const Asset lobes_back = Asset::open(folder / "lobes.glint");
  EXPECT_EQ(lobes_back.get<ShLobes>().order, 1);
  EXPECT_EQ(lobes_back.get<ShLobes>().sigma_r, 0.1f);
  EXPECT_EQ(lobes_back.get<ShLobes>().grid.columns, 4);
  EXPECT_EQ(lobes_back.get<ShLobes>().precision, ShPrecision::f32);
  EXPECT_EQ(std::memcmp(lobes_back.get<ShLobes>().coefficients, lobes.coefficients.data(), 4 * lobes.coefficients.size()), 0);
  const test::SampleShLight light = test::sampleShLight();
  writeAsset(folder / "light.glint", light.light, test::sampleProvenance());
  const Asset light_back = Asset::open(folder / "light.glint");
  EXPECT_EQ(light_back.get<ShLight>().precision, ShPrecision::f16);
  EXPECT_TRUE(std::ranges::equal(light_back.get<ShLight>().scales, light.scales));
  EXPECT_TRUE(std::ranges::equal(light_back.get<ShLight>().band_norms, light.band_norms));
  EXPECT_EQ(std::memcmp(light_back.get<ShLight>().coefficients, light.coefficients.data(), 2 * light.coefficients.size()), 0);
}

TEST(AssetRoundTrip, LobesNeedNoTable) {
  const test::TempFolder folder;
  const std::vector<float> zonal = {0.28f, 0.4f};
  writeAsset(folder / "zonal.glint", ShLobes{1, 0.1f, {}, ShPrecision::f16, zonal, nullptr}, test::sampleProvenance());
  EXPECT_TRUE(std::ranges::equal(Asset::open(folder / "zonal.glint").get<ShLobes>().zonal, zonal));
}

TEST(AssetRoundTrip, ProvenanceComesBack) {
  const TempFolder folder;
  for (const Provenance& provenance : {test::sampleProvenance(), Provenance{"", "{}", {}}}) {
    writeAsset(folder / "a.glint", test::sampleHeights(4, 4).map, provenance, {.overwrite = true});
    const Asset asset = Asset::open(folder / "a.glint");
    EXPECT_EQ(asset.info().provenance, provenance);
    EXPECT_EQ(asset.info().format_major, kFormatMajor);
    EXPECT_EQ(asset.info().format_minor, kFormatMinor);
    EXPECT_TRUE(asset.info().warnings.empty());
  }
}

TEST(AssetRoundTrip, BigDatasetsStartOnPagesAndSmallOnesOnCacheLines) {
  const TempFolder folder;
  writeAsset(folder / "a.glint", test::sampleNormals(256, 256).map, test::sampleProvenance());
  const Asset asset = Asset::open(folder / "a.glint");
  for (const DatasetInfo& dataset : asset.info().datasets) {
    EXPECT_EQ(dataset.offset % (dataset.size_bytes >= 65536 ? 4096 : 64), 0u) << dataset.path;
  }
  // Alignment must not cost more than a few pages.
  EXPECT_LT(asset.info().file_bytes, 256 * 256 * 8 + 256 * 256 / 3 * 16 + 48 * 1024);
}

TEST(AssetRoundTrip, AskingForAnotherKindNamesBoth) {
  const TempFolder folder;
  writeAsset(folder / "a.glint", test::sampleHeights(4, 4).map, {});
  const Asset asset = Asset::open(folder / "a.glint");
  try {
    asset.get<NdfPyramid>();
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
    EXPECT_THAT(error.what(), HasSubstr("heights"));
    EXPECT_THAT(error.what(), HasSubstr("ndf-pyramid"));
  }
}

TEST(AssetRoundTrip, MovedAssetsKeepTheirData) {
  const TempFolder folder;
  const auto sample = test::sampleHeights(9, 9);
  writeAsset(folder / "a.glint", sample.map, {});
  Asset first = Asset::open(folder / "a.glint");
  const float* data = first.get<HeightMap>().heights.data();
  const Asset second = std::move(first);
  EXPECT_EQ(second.get<HeightMap>().heights.data(), data);
  fs::remove(folder / "a.glint");
  expectSame(second.get<HeightMap>().heights, sample.map.heights);
}

TEST(AssetWriter, TwoRunsGiveTheSameBytes) {
  const TempFolder folder;
  const auto sample = test::samplePyramid(32, BlockPrecision::f16);
  writeAsset(folder / "a.glint", sample.pyramid, test::sampleProvenance());
  ::usleep(1100000);  // HDF5 stores times in whole seconds, if it stores any
  writeAsset(folder / "b.glint", sample.pyramid, test::sampleProvenance());
  EXPECT_EQ(readBytes(folder / "a.glint"), readBytes(folder / "b.glint"));
}

TEST(AssetWriter, DoesNotReplaceAFileUnlessAsked) {
  const TempFolder folder;
  writeBytes(folder / "a.glint", "precious");
  const auto sample = test::sampleHeights(4, 4);
  EXPECT_THROW(writeAsset(folder / "a.glint", sample.map, {}), Error);
  EXPECT_EQ(readBytes(folder / "a.glint"), "precious");
  writeAsset(folder / "a.glint", sample.map, {}, {.overwrite = true});
  EXPECT_EQ(brokenRule(folder / "a.glint"), "");
}

std::size_t fileCount(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

TEST(AssetWriter, InvalidStructsLeaveNoFile) {
  const TempFolder folder;
  auto sample = test::samplePyramid(32, BlockPrecision::f16);
  sample.levels[0].mask_ranks[3] += 1;
  try {
    writeAsset(folder / "a.glint", sample.pyramid, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.rule(), "pyramid.mask_ranks");
    EXPECT_EQ(error.path(), (folder / "a.glint").string());
  }
  sample.levels[0].mask_ranks[3] -= 1;
  sample.pyramid.levels[1].block_means = sample.pyramid.levels[1].block_means.first(3);
  EXPECT_THROW(writeAsset(folder / "a.glint", sample.pyramid, {}), Error);
  auto map = test::sampleHeights(4, 4);
  map.map.width = 5;
  EXPECT_THROW(writeAsset(folder / "a.glint", map.map, {}), Error);
  EXPECT_EQ(fileCount(folder.path()), 0u);
}

TEST(AssetWriter, FailsCleanlyWithoutSpace) {
  const TempFolder folder;
  writeAsset(folder / "a.glint", test::sampleHeights(4, 4).map, {});
  const std::string old = readBytes(folder / "a.glint");
  const pid_t child = ::fork();
  if (child == 0) {
    const rlimit limit = {100000, 100000};
    ::setrlimit(RLIMIT_FSIZE, &limit);
    std::signal(SIGXFSZ, SIG_IGN);
    int status = 1;
    try {
      writeAsset(folder / "a.glint", test::sampleHeights(300, 300).map, {}, {.overwrite = true});
    } catch (const Error& error) {
      status = error.code() == ErrorCode::io ? 0 : 2;
    }
    ::_exit(status);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_EQ(readBytes(folder / "a.glint"), old);
  EXPECT_EQ(fileCount(folder.path()), 1u);
}

TEST(AssetWriter, AKilledRunLeavesTheOldFile) {
  const TempFolder folder;
  writeAsset(folder / "a.glint", test::sampleHeights(4, 4).map, {});
  const std::string old = readBytes(folder / "a.glint");
  const std::vector<float> heights(4 << 20);
  const HeightMap big{2048, 2048, 0, heights};
  for (const int delay_us : {500, 2000, 5000}) {
    const pid_t child = ::fork();
    if (child == 0) {
      for (;;) writeAsset(folder / "b.glint", big, {}, {.overwrite = true});
    }
    ::usleep(static_cast<useconds_t>(delay_us));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    // Either no file or a whole one, whenever the kill came.
    if (fs::exists(folder / "b.glint")) {
      EXPECT_EQ(brokenRule(folder / "b.glint", {.verify_hashes = true}), "");
    }
  }
  EXPECT_EQ(readBytes(folder / "a.glint"), old);
}

TEST(AssetWriter, TheNextRunRemovesWhatKilledOnesLeft) {
  const TempFolder folder;
  const std::vector<float> heights(4 << 20);
  const HeightMap big{2048, 2048, 0, heights};
  std::size_t left = 0;
  for (int attempt = 0; attempt < 50 && left == 0; ++attempt) {
    const pid_t child = ::fork();
    if (child == 0) {
      for (;;) writeAsset(folder / "a.glint", big, {}, {.overwrite = true});
    }
    ::usleep(3000);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    left = fileCount(folder.path()) - (fs::exists(folder / "a.glint") ? 1 : 0);
  }
  ASSERT_GT(left, 0u);
  writeBytes(folder / ".b.glint.1-2-3.tmp", "another target's");
  writeBytes(folder / ".a.glint.notes.tmp", "the user's");
  writeAsset(folder / "a.glint", test::sampleHeights(4, 4).map, {}, {.overwrite = true});
  EXPECT_TRUE(fs::exists(folder / ".b.glint.1-2-3.tmp"));
  EXPECT_TRUE(fs::exists(folder / ".a.glint.notes.tmp"));
  EXPECT_EQ(fileCount(folder.path()), 3u);
}

TEST(AssetWriter, LeavesTheFilesOfLivingWritersAlone) {
  const TempFolder folder;
  writeBytes(folder / ".a.glint.1-2-3.tmp", "in work");
  const int other = ::open((folder / ".a.glint.1-2-3.tmp").c_str(), O_RDWR);
  ASSERT_EQ(::flock(other, LOCK_EX), 0);
  writeAsset(folder / "a.glint", test::sampleHeights(4, 4).map, {});
  EXPECT_EQ(readBytes(folder / ".a.glint.1-2-3.tmp"), "in work");
  ::close(other);
  writeAsset(folder / "a.glint", test::sampleHeights(4, 4).map, {}, {.overwrite = true});
  EXPECT_FALSE(fs::exists(folder / ".a.glint.1-2-3.tmp"));
}

TEST(AssetWriter, NamesTheFolderThatIsMissing) {
  try {
    writeAsset("/nonexistent/folder/a.glint", test::sampleHeights(4, 4).map, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::io);
    EXPECT_THAT(error.what(), HasSubstr("/nonexistent/folder/a.glint"));
    EXPECT_THAT(error.what(), HasSubstr("No such file"));
  }
}

TEST(DamagedAsset, EveryPrefixIsRefused) {
  const TempFolder folder;
  writeAsset(folder / "a.glint", test::sampleHeights(16, 16).map, test::sampleProvenance());
  const std::string bytes = readBytes(folder / "a.glint");
  for (std::size_t size = 0; size < bytes.size(); size += size < 256 ? 1 : 61) {
    writeBytes(folder / "b.glint", bytes.substr(0, size));
    const std::string rule = brokenRule(folder / "b.glint");
    EXPECT_TRUE(rule == "file.truncated" || rule == "file.signature") << size << " " << rule;
  }
}

TEST(DamagedAsset, EveryFlippedByteIsFoundByValidation) {
  const TempFolder folder;
  writeAsset(folder / "a.glint", test::sampleHeights(16, 16).map, test::sampleProvenance());
  const std::string bytes = readBytes(folder / "a.glint");
  const ValidationReport good = validateAsset(folder / "a.glint");
  ASSERT_TRUE(good.findings.empty());
  const Asset asset = Asset::open(folder / "a.glint");
  std::mt19937 random(7);
  std::size_t unnoticed = 0;
  constexpr int kFlips = 500;
  for (int k = 0; k < kFlips; ++k) {
    std::string flipped = bytes;
    flipped[random() % bytes.size()] ^= static_cast<char>(1 << random() % 8);
    writeBytes(folder / "b.glint", flipped);
    const ValidationReport report = validateAsset(folder / "b.glint");
    if (!report.valid()) continue;
    ++unnoticed;
    // What nobody notices must be a gap between objects: the asset is the same.
    const Asset other = Asset::open(folder / "b.glint", {.verify_hashes = true});
    expectSame(other.get<HeightMap>().heights, asset.get<HeightMap>().heights);
    EXPECT_EQ(other.info().provenance, asset.info().provenance);
  }
  EXPECT_LT(unnoticed, static_cast<std::size_t>(kFlips / 2));
}

TEST(DamagedAsset, AFlippedBitOfDataIsFoundWhenHashesAreVerified) {
  const TempFolder folder;
  writeAsset(folder / "a.glint", test::sampleHeights(16, 16).map, {});
  const std::uint64_t offset = Asset::open(folder / "a.glint").info().datasets.at(0).offset;
  std::string bytes = readBytes(folder / "a.glint");
  bytes[offset + 100] ^= 1;
  writeBytes(folder / "a.glint", bytes);
  EXPECT_EQ(brokenRule(folder / "a.glint"), "");
  EXPECT_EQ(brokenRule(folder / "a.glint", {.verify_hashes = true}), "dataset.hash");
  const ValidationReport report = validateAsset(folder / "a.glint");
  ASSERT_EQ(report.findings.size(), 1u);
  EXPECT_EQ(report.findings[0].rule, "dataset.hash");
  EXPECT_EQ(report.findings[0].object, "/heights");
}

}  // namespace
}  // namespace glint::formats::formats_round_trip_test
