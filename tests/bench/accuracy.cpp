// How far pyramids, compressed or not, are from the Reference:
//   glint-accuracy NORMALS.glint ASSET.glint... [--samples N]
// For every footprint-size octave: errors of the images (at centres, trilinear is the image), and of answers at random places
// for a size between two levels. JSON on
// stdout.

#include <tbb/parallel_for.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "glint/bake/common/image_errors.h"
#include "glint/bake/common/reference_image.h"
#include "glint/bake/common/seen_error.h"
#include "glint/formats/asset_reader.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/pyramid_ndf.h"

namespace {

using namespace glint;

// Size of random footprints, in deviations of their level.
constexpr float kRandomSize = 1.3f;

/// Means of the density over pixels.
template <NdfModel M>
std::vector<float> imageOf(const M& model, const Footprint& footprint, int resolution) {
  std::vector<float> image;
  image.reserve(static_cast<std::size_t>(resolution) * resolution);
  const auto centre = [&](int k) { return -1 + (static_cast<float>(k) + 0.5f) * 2 / static_cast<float>(resolution); };
  for (int y = 0; y < resolution; ++y)
    for (int x = 0; x < resolution; ++x) image.push_back(model.pixelMean(footprint, {centre(x), centre(y)}));
  return image;
}

/// Footprints at centres of a level, spread over the map; at most `samples`.
std::vector<Footprint> centresOf(const PyramidShape& shape, int level, int samples) {
  const PyramidGrid& grid = shape.levels[level];
  const int images = static_cast<int>(grid.imageCount());
  const int count = std::min(samples, images);
  std::vector<Footprint> footprints;
  for (int k = 0; k < count; ++k) {
    // An odd multiple of the golden ratio visits rows and columns evenly.
    const int image = count == images ? k : static_cast<int>(std::fmod((k + 0.5) * 0.6180339887498949, 1.0) * images);
    const Vec2 centre = shape.centre(level, image % grid.columns, image / grid.columns);
    const Vec2 uv = {centre.x / static_cast<float>(shape.width), centre.y / static_cast<float>(shape.height)};
    footprints.push_back(Footprint::isotropic(uv, kFootprintPerStride * grid.stride));
  }
  return footprints;
}

/// Anywhere, of one size between this level's and the next one's: seen errors are defined over places of one size.
std::vector<Footprint> randomFootprints(const PyramidShape& shape, int level, int samples) {
  std::mt19937 random(static_cast<unsigned>(level) + 1);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  std::vector<Footprint> footprints;
  for (int k = 0; k < samples; ++k) {
    const float u = unit(), v = unit();
    footprints.push_back(Footprint::isotropic({u, v}, kRandomSize * kFootprintPerStride * shape.levels[level].stride));
  }
  return footprints;
}

/// Reference images of one set of footprints, and the errors of models against them.
class Truth {
 public:
  Truth(const NormalMap& map, const PyramidShape& shape, std::vector<Footprint> footprints)
      : resolution_(shape.resolution), footprints_(std::move(footprints)), images_(footprints_.size()) {
    tbb::parallel_for(std::size_t{0}, images_.size(), [&](std::size_t k) {
      images_[k] = bake::referenceImage(map, shape.sigma_r, shape.surface, shape.boundary, footprints_[k], resolution_);
    });
  }

  template <NdfModel M>
  nlohmann::ordered_json errorsOf(const M& model) const {
    std::vector<bake::ImageErrors> errors(images_.size());
    std::vector<std::vector<float>> answers(images_.size());
    tbb::parallel_for(std::size_t{0}, images_.size(), [&](std::size_t k) {
      answers[k] = imageOf(model, footprints_[k], resolution_);
      errors[k] = bake::imageErrors(answers[k], images_[k], resolution_);
    });
    bake::SeenError seen_error(resolution_);
    for (std::size_t k = 0; k < images_.size(); ++k) seen_error.add(answers[k].data(), images_[k].data());
    const bake::SeenSummary seen = seen_error.summary();
    bake::ImageErrors mean;
    for (const bake::ImageErrors& e : errors) {
      mean.rel_l2 += e.rel_l2 / static_cast<double>(errors.size());
      mean.tv += e.tv / static_cast<double>(errors.size());
      mean.energy += e.energy / static_cast<double>(errors.size());
    }
    return {{"footprints", errors.size()}, {"rel_l2", mean.rel_l2},    {"tv", mean.tv},    {"energy", mean.energy},
            {"seen", seen.seen},           {"seen_worst", seen.worst}, {"bias", seen.bias}};
  }

 private:
  int resolution_;
  std::vector<Footprint> footprints_;
  std::vector<std::vector<float>> images_;
};

const PyramidShape& shapeOf(const formats::Asset& asset) {
  return asset.kind() == "ndf-cp" ? asset.get<NdfCp>().shape : asset.get<NdfPyramid>().shape;
}

nlohmann::ordered_json errorsOf(const Truth& truth, const formats::Asset& asset, Interpolation interpolation) {
  return asset.kind() == "ndf-cp" ? truth.errorsOf(CpNdf(asset.get<NdfCp>(), interpolation))
                                  : truth.errorsOf(PyramidNdf(asset.get<NdfPyramid>(), interpolation));
}

bool sameGrid(const PyramidShape& a, const PyramidShape& b) {
  return a.width == b.width && a.height == b.height && a.resolution == b.resolution && a.sigma_r == b.sigma_r &&
         a.surface == b.surface && a.boundary == b.boundary && a.level_count == b.level_count &&
         a.levels[0].stride == b.levels[0].stride;
}

nlohmann::ordered_json measure(const std::string& normals_path, const std::vector<std::string>& paths, int samples) {
  const formats::Asset normals = formats::Asset::open(normals_path);
  const NormalMap& map = normals.get<NormalMap>();
  std::vector<formats::Asset> assets;
  nlohmann::ordered_json result = nlohmann::ordered_json::array();
  for (const std::string& path : paths) {
    assets.push_back(formats::Asset::open(path));
    if (!sameGrid(shapeOf(assets.front()), shapeOf(assets.back())))
      throw std::runtime_error(path + ": not of the same grid as " + paths[0]);
    if (shapeOf(assets.back()).width != map.width || shapeOf(assets.back()).height != map.height)
      throw std::runtime_error(path + ": not made of " + normals_path);
    result.push_back(
        {{"asset", path}, {"size_bytes", assets.back().info().file_bytes}, {"levels", nlohmann::ordered_json::array()}});
  }
  const PyramidShape& shape = shapeOf(assets.front());
  for (int level = 0; level < shape.level_count; ++level) {
    const Truth own(map, shape, centresOf(shape, level, samples));
    const Truth random(map, shape, randomFootprints(shape, level, level + 1 < shape.level_count ? samples : 0));
    for (std::size_t a = 0; a < assets.size(); ++a) {
      nlohmann::ordered_json entry = {{"sigma_texels", kFootprintPerStride * shape.levels[level].stride},
                                      {"centres", errorsOf(own, assets[a], Interpolation::trilinear)}};
      if (level + 1 < shape.level_count) entry["random"] = errorsOf(random, assets[a], Interpolation::footprint);
      result[a]["levels"].push_back(entry);
    }
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App parser("Errors of pyramids, compressed or not, against brute force over the texels");
  std::string normals;
  std::vector<std::string> assets;
  int samples = 8;
  parser.add_option("NORMALS", normals, "asset of kind normals")->required();
  parser.add_option("ASSETS", assets, "assets of kind ndf-pyramid and ndf-cp that were made of it")->required();
  parser.add_option("--samples", samples, "footprints of each octave")->check(CLI::Range(1, 4096));
  CLI11_PARSE(parser, argc, argv);
  try {
    std::puts(measure(normals, assets, samples).dump(1).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "glint-accuracy: error: %s\n", error.what());
    return 1;
  }
}
