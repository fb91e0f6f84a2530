#include "glint-query/distribution_command.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/footprint_rules.h"
#include "common/input_asset.h"
#include "common/ndf_image.h"
#include "glint-query/command_forms.h"
#include "glint-query/usage.h"
#include "glint/api/plane_position.h"
#include "glint/api/wave_colours.h"

namespace glint::apps {
HalfVectorOptions::HalfVectorOptions(Tool& tool) {
  half_option_ = &tool.option("--half", half_, "ask for the density towards a half vector HX HY").count(2);
  range_option_ = &tool.option("--range", range_, "ask for the mean density over a box X0 Y0 X1 Y1 of half vectors").count(4);
  half_option_->excludes(*range_option_);
  spread_option_ =
      &tool.option("--spread", spread_,
                   "on a curved surface: half widths SX SY of the box of half vectors that the pixel sees; answers "
                   "are averaged over it (CurvedNdf)")
           .count(2);
  tool.addCheck([this] { check(); });
}

Vec2 HalfVectorOptions::spread() const { return spread_option_->given() ? Vec2{spread_[0], spread_[1]} : Vec2{}; }

void HalfVectorOptions::check() const {
  if (const auto fault = spreadFault(spread())) throwUsage("--spread " + fault->what, fault->remedy);
  if (!range_option_->given()) return;
  if (const auto fault = rangeFault(*query({}).range)) throwUsage("--range " + fault->what, fault->remedy);
}

Query HalfVectorOptions::query(const Footprint& footprint) const {
  Query query;
  query.footprint = footprint;
  query.spread = spread();
  if (range_option_->given()) query.range = Box2{{range_[0], range_[1]}, {range_[2], range_[3]}};
  if (half_option_->given()) query.half = Vec2{half_[0], half_[1]};
  return query;
}

DistributionCommand::DistributionCommand(Tool& tool)
    : tool_(tool),
      asset_(tool, {.udim_sets = true}),
      footprint_(tool),
      halves_(tool),
      picture_(tool),
      table_(tool,
             "answer a table of queries; its header names u,v; sigma or sxx,sxy,syy or ax,ay,bx,by; hx,hy or x0,y0,x1,y1; "
             "and may name spread_x,spread_y",
             "draw half vectors in proportion to the density: a table of hx,hy,pdf") {
  tool.option("--repeat", repeat_, "time the query: nanoseconds, median of 15 runs of N / 15").range(1, 1000000000);
  table_.csvOption()
      .excludes(footprint_.centreOption())
      .excludes(halves_.halfOption())
      .excludes(halves_.rangeOption())
      .excludes(halves_.spreadOption())
      .excludes(picture_.option());
  halves_.spreadOption().excludes(picture_.option());
  tool.usesSeed();
  for (const CommandForm& form : {kLightForm, kReflectanceForm, kPlaneForm}) tool.pointTo(form.line, form.options);
  tool.pointTo(kLightForm.line + ", or " + kReflectanceForm.line, {"--wo"});
  tool.addCheck([this] { check(); });
}

void DistributionCommand::check() const {
  if (table_.csvGiven()) return;
  if (!footprint_.given()) throwUsage("no footprint was given", "add --uv U V, or --csv TABLE");
  footprint_.check();
  if (!picture_.given() && !halves_.given() && table_.samples() == 0)
    throwUsage("nothing was asked", "add --half, --range, --samples or --image");
}

void DistributionCommand::run() {
  asset_.open(inputChecks(tool_));
  if (table_.csvGiven()) return answerTable();
  if (const auto fault = asset_.unanswerable(footprint_.footprint()))
    throw Error(ErrorCode::usage, "query.footprint", asset_.path(), "", fault->what, fault->remedy);
  if (asset_.widens(footprint_.footprint())) warnOfWidening("the footprint is");
  if (asset_.lacksTileAt(footprint_.u(), footprint_.v()))
    tool_.warn(
        fmt::format("{}: has no tile at uv {:g} {:g}: densities are 0 there", asset_.path(), footprint_.u(), footprint_.v()));
  if (picture_.given()) writePicture();
  if (table_.samples() > 0) writeSamples();
  if (halves_.given()) answerOne();
}

void DistributionCommand::warnOfWidening(const std::string& which) {
  tool_.warn(fmt::format("{}: {} answered up to {:.3g} texels wide; {}", asset_.path(), which,
                         asset_.info().smallest_sigma_texels, asset_.normalsRemedy()));
}

void DistributionCommand::answerTable() {
  const QueryTable table = QueryTable::read(table_.csv());
  std::size_t widened = 0, outside = 0;
  for (std::size_t row = 0; row < table.queries().size(); ++row) {
    outside += asset_.lacksTileAt(table.queries()[row].u, table.queries()[row].v) ? 1 : 0;
    if (const auto fault = asset_.unanswerable(table.queries()[row].footprint))
      throw Error(ErrorCode::usage, "query.footprint", table_.csv(), fmt::format("row {}", row + 1), fault->what,
                  fault->remedy);
    widened += asset_.widens(table.queries()[row].footprint) ? 1 : 0;
  }
  if (widened > 0) warnOfWidening(fmt::format("{} footprints are", widened));
  if (outside > 0)
    tool_.warn(fmt::format("{}: has no tile at {} of the footprints: densities are 0 there", asset_.path(), outside));
  table_.write(table.withAnswers(answerAll(asset_.model(), table.queries())));
  tool_.setResult({{"queries", table.queries().size()}});
}

void DistributionCommand::writeSamples() {
  const std::vector<HalfVectorSample> samples =
      drawSamples(api::movedTo(asset_.model(), footprint_.u(), footprint_.v()), footprint_.footprint(), halves_.spread(),
                  table_.samples(), tool_.seed());
  table_.write(sampleTable(samples));
  tool_.setResult({{"samples", samples.size()}});
}

void DistributionCommand::answerOne() {
  Query q = halves_.query(footprint_.footprint());
  q.u = footprint_.u(), q.v = footprint_.v();
  if (q.half && api::isWave(asset_.model())) {
    if (halves_.spreadOption().given())
      throwUsage("--spread with --half: colours of diffraction have no averages", "give --range, or leave --spread out");
    return answerColour(q);
  }
  const float value = answer(asset_.model(), q);
  tool_.print(fmt::format("{:.9g}\n", value));
  reportTimed(tool_, {{q.range ? "mean" : "density", value}, {"widened", asset_.widens(q.footprint)}}, repeat_,
              [&] { return answer(asset_.model(), q); });
}

void DistributionCommand::answerColour(const Query& q) {
  const auto ask = [&] { return api::densityRgb(asset_.model(), q.footprint, *q.half); };
  const Rgb rgb = ask();
  std::vector<float> spectrum(static_cast<std::size_t>(api::channelCount(asset_.model())));
  api::densitySpectrum(asset_.model(), q.footprint, *q.half, spectrum.data());
  tool_.print(fmt::format("{:.9g} {:.9g} {:.9g}\n", rgb.r, rgb.g, rgb.b));
  reportTimed(tool_,
              {{"density", answer(asset_.model(), q)},
               {"rgb", {rgb.r, rgb.g, rgb.b}},
               {"channels", spectrum},
               {"widened", asset_.widens(q.footprint)}},
              repeat_, [&] { return ask().g; });
}

void DistributionCommand::writePicture() {
  const int size = picture_.size(asset_.resolution());
  if (const auto colours = asset_.colourImage(footprint_.footprint(), size)) return picture_.writeColours(size, *colours);
  auto densities = asset_.scatteredImage(footprint_.footprint(), size);
  if (!densities)
    densities = ndfImage(api::movedTo(asset_.model(), footprint_.u(), footprint_.v()), footprint_.footprint(), size,
                         tool_.progress("rows"));
  picture_.write(size, *densities);
}

}  // namespace glint::apps
