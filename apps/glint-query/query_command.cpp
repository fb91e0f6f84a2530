#include "glint-query/query_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/ndf_picture.h"

namespace glint::apps {

QueryCommand::QueryCommand(Tool& tool) : tool_(tool), light_(tool) {
  uv_option_ = &tool.option("--uv", uv_, "centre of the footprint, texture space").count(2);
  sigma_option_ = &tool.option("--sigma", sigma_, "footprint: deviation of an isotropic Gaussian, texels").range(1e-6, 1e9);
  covariance_option_ = &tool.option("--cov", covariance_, "footprint: covariance SXX SXY SYY of a Gaussian, texels^2").count(3);
  box_option_ = &tool.option("--box", box_, "footprint: half axes AX AY BX BY of a parallelogram, texels").count(4);
  half_option_ = &tool.option("--half", half_, "ask for the density towards a half vector HX HY").count(2);
  range_option_ = &tool.option("--range", range_, "ask for the mean density over a box X0 Y0 X1 Y1 of half vectors").count(4);
  tool.option("--image", image_, "write the NDF image: densities as .exr, colours as .png");
  tool.option("--image-size", image_size_, "pixels of the image along each axis")
      .range(1, 4096)
      .defaultText("the asset's own, or 256");
  csv_option_ = &tool.option("--csv", csv_,
                             "answer a table of queries; its header names u,v; sigma or sxx,sxy,syy or ax,ay,bx,by; "
                             "hx,hy or x0,y0,x1,y1");
  tool.option("--samples", samples_, "draw half vectors in proportion to the density: a table of hx,hy,pdf")
      .range(1, 100000000);
  output_option_ = &tool.option("-o,--output", output_, "where the table of --csv or --samples goes; - for stdout");
  tool.option("--repeat", repeat_, "time the query: nanoseconds, median of 15 runs of N / 15").range(1, 1000000000);
  sigma_option_->excludes(*covariance_option_).excludes(*box_option_);
  covariance_option_->excludes(*box_option_);
  half_option_->excludes(*range_option_);
  tool.addCheck([this] { check(); });
}

void QueryCommand::check() const {
  const auto usage = [](const std::string& what, const std::string& remedy) {
    throw Error(ErrorCode::usage, "query.arguments", "", "", what, remedy);
  };
  const bool makes_table = csv_option_->given() || samples_ > 0;
  if (makes_table && !output_option_->given())
    usage(csv_option_->given() ? "--csv needs a place for the answers" : "--samples needs a place for them",
          "add -o OUT.csv, or -o - for stdout");
  if (!makes_table && output_option_->given()) usage("-o is for tables", "add --csv or --samples, or leave it out");
  if (makes_table && output_ != "-") checkWritable(output_);
  if (csv_option_->given()) {
    if (uv_option_->given() || samples_ > 0 || !image_.empty() || half_option_->given() || range_option_->given() ||
        light_.asked())
      usage("--csv asks its own queries", "leave out the others");
    checkReadable(csv_);
    return;
  }
  if (!uv_option_->given()) usage("no footprint was given", "add --uv U V, or --csv TABLE");
  if (!sigma_option_->given() && !covariance_option_->given() && !box_option_->given())
    usage("the footprint has no size", "add --sigma S, --cov SXX SXY SYY or --box AX AY BX BY");
  if (image_.empty() && !half_option_->given() && !range_option_->given() && samples_ == 0 && !light_.asked())
    usage("nothing was asked", "add --half, --range, --samples, --image or --light");
  if (!image_.empty()) {
    checkWritable(image_);
    checkPictureName(image_);
  }
}

Footprint QueryCommand::footprint() const {
  const Vec2 centre = {uv_[0], uv_[1]};
  if (covariance_option_->given()) return Footprint::gaussian(centre, {covariance_[0], covariance_[1], covariance_[2]});
  if (box_option_->given()) return Footprint::box(centre, {box_[0], box_[1]}, {box_[2], box_[3]});
  return Footprint::isotropic(centre, sigma_);
}

Query QueryCommand::query() const {
  Query query;
  query.footprint = footprint();
  if (range_option_->given()) query.range = Box2{{range_[0], range_[1]}, {range_[2], range_[3]}};
  if (half_option_->given()) query.half = Vec2{half_[0], half_[1]};
  return query;
}

void QueryCommand::run(NdfAsset& asset) {
  if (csv_option_->given()) return answerTable(asset);
  asset.requireAnswerable(footprint());
  if (!image_.empty()) writePicture(asset);
  if (samples_ > 0) writeSamples(asset);
  if (light_.asked()) return light_.run(asset, footprint());
  if (half_option_->given() || range_option_->given()) answerOne(asset);
}

void QueryCommand::answerTable(NdfAsset& asset) {
  const QueryTable table = QueryTable::read(csv_);
  for (const Query& query : table.queries()) asset.requireAnswerable(query.footprint);
  const std::string text = table.withAnswers(answerAll(asset.model(), table.queries()));
  writeTable(text);
  tool_.setResult({{"queries", table.queries().size()}});
}

void QueryCommand::writeTable(const std::string& text) {
  if (output_ == "-")
    tool_.print(text);
  else
    writeFileAtomically(output_, text);
}

void QueryCommand::writeSamples(NdfAsset& asset) {
  const std::vector<HalfVectorSample> samples = drawSamples(asset.model(), footprint(), samples_, tool_.seed());
  writeTable(sampleTable(samples));
  tool_.setResult({{"samples", samples.size()}});
}

void QueryCommand::answerOne(NdfAsset& asset) {
  const Query q = query();
  const float value = answer(asset.model(), q);
  nlohmann::json result = {{q.range ? "mean" : "density", value}};
  tool_.print(fmt::format("{:.9g}\n", value));
  if (repeat_ > 0) {
    const double ns = nanosecondsPerQuery(asset.model(), q, repeat_);
    result["nanoseconds"] = ns;
    tool_.print(fmt::format("{:.1f} ns per query\n", ns));
  }
  tool_.setResult(result);
}

void QueryCommand::writePicture(NdfAsset& asset) {
  const int size = image_size_ > 0 ? image_size_ : asset.resolution();
  auto densities = asset.scatteredImage(footprint(), size);
  if (!densities) densities = ndfImage(asset.model(), footprint(), size, tool_.progress("rows"));
  writeNdfPicture(image_, size, *densities);
  tool_.setResult({{"image", image_}, {"image_size", size}});
}

}  // namespace glint::apps
