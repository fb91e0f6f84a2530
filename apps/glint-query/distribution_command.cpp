#include "glint-query/distribution_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/footprint_rules.h"
#include "common/ndf_picture.h"

namespace glint::apps {
namespace {

[[noreturn]] void usage(const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::usage, "query.arguments", "", "", what, remedy);
}

}  // namespace

DistributionCommand::DistributionCommand(Tool& tool) : tool_(tool), light_(tool), displacement_(tool) {
  tool.section(Tool::kOptions);
  wo_option_ = &tool.option("--wo", wo_, "--light and --wi: outgoing direction X Y Z, z out of the surface").count(3);
  uv_option_ = &tool.option("--uv", uv_, "centre of the footprint, texture space").count(2);
  sigma_option_ =
      &tool.option("--sigma", sigma_, "footprint: deviation of an isotropic Gaussian, texels").range(kLeastSigma, kMostSigma);
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
  tool.option("--samples", samples_,
              "draw half vectors in proportion to the density: a table of hx,hy,pdf; of a displacement directions of light: "
              "wix,wiy,wiz,pdf")
      .range(1, 100000000);
  output_option_ = &tool.option("-o,--output", output_, "where the table of --csv or --samples goes; - for stdout");
  tool.option("--repeat", repeat_, "time the query: nanoseconds, median of 15 runs of N / 15").range(1, 1000000000);
  sigma_option_->excludes(*covariance_option_).excludes(*box_option_);
  covariance_option_->excludes(*box_option_);
  half_option_->excludes(*range_option_);
  tool.usesSeed();
  tool.addCheck([this] { check(); });
}

void DistributionCommand::checkTable() const {
  if (uv_option_->given() || samples_ > 0 || !image_.empty() || half_option_->given() || range_option_->given() ||
      light_.asked() || displacement_.lightGiven() || displacement_.levelGiven())
    usage("--csv asks its own queries", "leave out the others");
  checkReadable(csv_);
  tool_.addInput(csv_);
}

void DistributionCommand::check() const {
  const bool makes_table = csv_option_->given() || samples_ > 0;
  if (makes_table && !output_option_->given())
    usage(csv_option_->given() ? "--csv needs a place for the answers" : "--samples needs a place for them",
          "add -o OUT.csv, or -o - for stdout");
  if (!makes_table && output_option_->given()) usage("-o is for tables", "add --csv or --samples, or leave it out");
  if (makes_table) checkTableOutput();
  if (csv_option_->given()) return checkTable();
  if (!uv_option_->given()) usage("no footprint was given", "add --uv U V, or --csv TABLE");
  if (!sigma_option_->given() && !covariance_option_->given() && !box_option_->given() && !displacement_.levelGiven())
    usage("the footprint has no size",
          "add --sigma S, --cov SXX SXY SYY or --box AX AY BX BY; of a displacement --sigma or --level");
  if (image_.empty() && !half_option_->given() && !range_option_->given() && samples_ == 0 && !light_.asked() &&
      !displacement_.lightGiven())
    usage("nothing was asked", "add --half, --range, --samples, --image or --light; of a displacement --wi and --wo");
  if (light_.asked() && (!wo_option_->given() || !(wo_[2] > 0)))
    throw Error(ErrorCode::usage, "query.arguments", "", "--wo", "no outgoing direction above the surface was given",
                "add --wo X Y Z with Z > 0");
  if (covariance_option_->given()) checkFootprint("--cov");
  if (box_option_->given()) checkFootprint("--box");
  if (range_option_->given()) {
    if (const auto fault = rangeFault(*query().range)) usage("--range " + fault->what, fault->remedy);
  }
  if (image_.empty()) return;
  checkPictureName(image_);
  checkOutput(tool_, image_, OutputFormat::image);
  tool_.addOutput(image_);
}

void DistributionCommand::checkTableOutput() const {
  if (output_ == "-") {
    if (tool_.wantsJson()) usage("--json and -o - both write to stdout", "name a file with -o, or leave out --json");
    return;
  }
  checkOutput(tool_, output_, OutputFormat::table);
  tool_.addOutput(output_);
}

void DistributionCommand::checkFootprint(const std::string& option) const {
  if (const auto fault = footprintFault(footprint())) usage(option + " " + fault->what, fault->remedy);
}

Footprint DistributionCommand::footprint() const {
  const Vec2 centre = {uv_[0], uv_[1]};
  if (covariance_option_->given()) return Footprint::gaussian(centre, {covariance_[0], covariance_[1], covariance_[2]});
  if (box_option_->given()) return Footprint::box(centre, {box_[0], box_[1]}, {box_[2], box_[3]});
  return Footprint::isotropic(centre, sigma_);
}

Query DistributionCommand::query() const {
  Query query;
  query.footprint = footprint();
  if (range_option_->given()) query.range = Box2{{range_[0], range_[1]}, {range_[2], range_[3]}};
  if (half_option_->given()) query.half = Vec2{half_[0], half_[1]};
  return query;
}

void DistributionCommand::checkDisplacement() const {
  if (covariance_option_->given() || box_option_->given())
    usage("a displacement has levels, not footprints of any shape", "give --sigma S or --level L");
  if (sigma_option_->given() && displacement_.levelGiven()) usage("the level was given twice", "give --sigma S or --level L");
  if (range_option_->given()) usage("lobes have no means over ranges", "ask for --half, --image, or --wi and --wo");
  if (light_.asked())
    usage("--light is for distributions of normals", "ask for the light from one direction: --wi X Y Z --wo X Y Z");
  if ((displacement_.lightGiven() || samples_ > 0) && !wo_option_->given())
    usage("no outgoing direction was given", "add --wo X Y Z");
  if (displacement_.lightGiven() + half_option_->given() > 1)
    usage("light and normals were both asked for", "give --wi and --wo, or --half");
}

void DistributionCommand::run(const Displacement& asset) {
  checkDisplacement();
  const DisplacedBrdf brdf(asset);
  if (csv_option_->given()) return writeTable(displacement_.table(brdf, csv_));
  const DisplacedPoint at = displacement_.point(asset, {uv_[0], uv_[1]}, sigma_);
  if (!image_.empty()) {
    const int size = image_size_ > 0 ? image_size_ : 256;
    writeNdfPicture(image_, size, lobeImage(brdf, at, size));
    tool_.setResult({{"image", image_}, {"image_size", size}});
  }
  if (samples_ > 0) writeTable(displacement_.samples(brdf, at, directionOf(wo_, "--wo"), samples_));
  if (displacement_.lightGiven()) displacement_.reflect(brdf, at, directionOf(wo_, "--wo"), repeat_);
  if (half_option_->given()) displacement_.density(brdf, at, {half_[0], half_[1]}, repeat_);
}

void DistributionCommand::run(NdfAsset& asset) {
  if (displacement_.asked())
    usage("--wi, --level and --variant ask how a surface reflects; this asset holds how its normals are distributed",
          "ask an asset of kind displacement, from glint-displace; or --half, --range, --samples, --image or --light");
  if (csv_option_->given()) return answerTable(asset);
  if (const auto fault = asset.unanswerable(footprint()))
    throw Error(ErrorCode::usage, "query.footprint", asset.path(), "", fault->what, fault->remedy);
  if (!image_.empty()) writePicture(asset);
  if (samples_ > 0) writeSamples(asset);
  if (light_.asked()) return light_.run(asset, footprint(), directionOf(wo_, "--wo"));
  if (half_option_->given() || range_option_->given()) answerOne(asset);
}

void DistributionCommand::answerTable(NdfAsset& asset) {
  const QueryTable table = QueryTable::read(csv_);
  for (std::size_t row = 0; row < table.queries().size(); ++row) {
    if (const auto fault = asset.unanswerable(table.queries()[row].footprint))
      throw Error(ErrorCode::usage, "query.footprint", csv_, fmt::format("row {}", row + 1), fault->what, fault->remedy);
  }
  const std::string text = table.withAnswers(answerAll(asset.model(), table.queries()));
  writeTable(text);
  tool_.setResult({{"queries", table.queries().size()}});
}

void DistributionCommand::writeTable(const std::string& text) {
  if (output_ == "-")
    tool_.print(text);
  else
    writeTextFile(output_, text);
}

void DistributionCommand::writeSamples(NdfAsset& asset) {
  const std::vector<HalfVectorSample> samples = drawSamples(asset.model(), footprint(), samples_, tool_.seed());
  writeTable(sampleTable(samples));
  tool_.setResult({{"samples", samples.size()}});
}

void DistributionCommand::answerOne(NdfAsset& asset) {
  const Query q = query();
  const float value = answer(asset.model(), q);
  nlohmann::json result = {{q.range ? "mean" : "density", value}};
  tool_.print(fmt::format("{:.9g}\n", value));
  if (repeat_ > 0) {
    const double ns = medianNanoseconds(repeat_, [&] { return answer(asset.model(), q); });
    result["nanoseconds"] = ns;
    tool_.print(fmt::format("{:.1f} ns per query\n", ns));
  }
  tool_.setResult(result);
}

void DistributionCommand::writePicture(NdfAsset& asset) {
  const int size = image_size_ > 0 ? image_size_ : asset.resolution();
  auto densities = asset.scatteredImage(footprint(), size);
  if (!densities) densities = ndfImage(asset.model(), footprint(), size, tool_.progress("rows"));
  writeNdfPicture(image_, size, *densities);
  tool_.setResult({{"image", image_}, {"image_size", size}});
}

}  // namespace glint::apps
