#include "glint-query/plane_command.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/input_asset.h"
#include "glint-query/command_forms.h"
#include "glint-query/usage.h"
#include "glint/api/ndf_info.h"

namespace glint::apps {

PlaneCommand::PlaneCommand(Tool& tool) : tool_(tool), halves_(tool), picture_(tool) {
  tool.option("ASSET", path_, "asset of kind wang-tiles, from glint-wang; or of kind wang-pyramid or wang-cp, made of one")
      .required();
  tool.option("--texel", texel_, "centre of the footprint: texels X Y of the plane, up to 2^52 from the origin")
      .count(2)
      .range(-0x1p52, 0x1p52)
      .required();
  size_ = std::make_unique<FootprintSize>(tool);
  tool.choice("--surface", surface_, {{"flat", Surface::flat}, {"smooth", Surface::smooth}},
              "how normals behave between texels (kind wang-tiles)");
  tool.option("--sigma-r", sigma_r_, "intrinsic roughness, disk units (kind wang-tiles)").range(1e-4, 0.25);
  tool.option("--repeat", repeat_, "time the query: nanoseconds, median of 15 runs of N / 15").range(1, 1000000000);
  tool.pointTo(kDistributionForm.line, {"--uv", "--csv", "--samples"});
  tool.addCheck([this] { check(); });
}

void PlaneCommand::check() const {
  checkRegular(path_);
  tool_.addInput(path_);
  size_->check();
  if (!halves_.given() && !picture_.given()) throwUsage("nothing was asked", "add --half, --range or --image");
}

void PlaneCommand::run() {
  const formats::Asset asset = openInput(tool_, path_);
  const auto kind = asset.kind();
  if (kind == "wang-pyramid") return ask(WangPlane<PyramidTiles>(asset.get<WangPyramid>()));
  if (kind == "wang-cp") return ask(WangPlane<CompressedTiles>(asset.get<WangCp>()));
  ask(WangReference(asset.get<WangTiles>(), sigma_r_, surface_));
}

template <class Plane>
void PlaneCommand::ask(const Plane& tiles) {
  // The plane seen from the cell of the point, so that no digits are lost.
  const WangPlace place = tiles.layout().placeOf(texel_[0], texel_[1]);
  const Plane plane = tiles.movedTo(place.cell_x, place.cell_y);
  const Footprint at = size_->at(plane.layout().positionIn(place));
  if (picture_.given()) writePicture(plane, at);
  if (!halves_.given()) return;
  const Query q = halves_.query(at);
  const auto answer = [&] { return q.range ? plane.mean(q.footprint, *q.range) : plane.density(q.footprint, *q.half); };
  const float value = answer();
  tool_.print(fmt::format("{:.9g}\n", value));
  reportTimed(tool_, {{q.range ? "mean" : "density", value}, {"widened", false}}, repeat_, answer);
}

template <class Plane>
void PlaneCommand::writePicture(const Plane& plane, const Footprint& footprint) {
  const int size = picture_.size(api::kDefaultResolution);
  const float pixel = 2.0f / static_cast<float>(size);
  std::vector<float> densities(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  const bake::ProgressFn progress = tool_.progress("rows");
  bake::ProgressCounter counter(progress, static_cast<std::size_t>(size));
  tbb::parallel_for(0, size, [&](int y) {
    for (int x = 0; x < size; ++x) {
      const Vec2 low = {-1 + static_cast<float>(x) * pixel, -1 + static_cast<float>(y) * pixel};
      densities[rowMajorIndex(x, y, size)] = plane.mean(footprint, {low, low + Vec2{pixel, pixel}});
    }
    counter.advance();
  });
  picture_.write(size, densities);
}

}  // namespace glint::apps
