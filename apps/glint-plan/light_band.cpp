#include "glint-plan/light_band.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <vector>

#include "common/child_process.h"
#include "glint-plan/plan_map.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/hash.h"
#include "glint/model/sh.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

/// Bands that are looked at. Light that turns faster counts as sharp.
constexpr int kMostBands = 60;
/// Share of the light's square that may lie beyond the band limit: a tenth of its norm.
constexpr double kLost = 0.01;
/// Angle of light that hardly changes, as the largest band_limit_deg of scenes.
constexpr double kWidest_deg = 180;

/// The smallest angle over which light changes, as a surface sees it from straight above; 0: too sharp for the bands.
double smoothnessOf(const ShLight& light) {
  // All rows and columns of the table: each is the light towards one outgoing direction, in half vectors.
  const auto bands = static_cast<std::size_t>(light.order) + 1;
  std::vector<double> squares(bands, 0.0);
  for (std::size_t k = 0; k < light.band_norms.size(); ++k)
    squares[k % bands] += double{light.band_norms[k]} * light.band_norms[k];
  double sum = 0, beyond = 0, last = 0;
  for (const double square : squares) sum += square;
  // Bands fall towards the last. Where the last tenth still has much, there is more beyond.
  for (std::size_t l = bands - bands / 10; l < bands; ++l) last += squares[l];
  if (last > kLost * sum) return 0;
  std::size_t limit = bands - 1;
  while (limit > 1 && beyond + squares[limit] <= kLost * sum) beyond += squares[limit--];
  // Band l changes over 180 / l degrees of half vectors, which are twice as many of the light.
  return std::min(kWidest_deg, 2 * 180.0 / static_cast<double>(limit));
}

}  // namespace

void measureEnvironments(Tool& tool, const AssetFolder& folder, Scene& scene, const std::string& maps) {
  for (std::size_t k = 0; k < scene.lights.size(); ++k) {
    SceneLight& light = scene.lights[k];
    if (light.image.empty()) continue;
    const std::string field = "lights[" + std::to_string(k) + "].image", image = (fs::path(maps) / light.image).string();
    checkSceneFile(tool, scene, field, image);
    const std::string table = folder.fileOf(formats::hashFile(image), "light");
    const ChildRun run = runProgram({"glint-shlobes", "--light", image, "-o", table, "--order", std::to_string(kMostBands),
                                     "--grid", "3x4", "--force", "--quiet", "--threads", std::to_string(tool.threads())},
                                    {.shared_file = folder.lock()});
    if (run.exit_code != 0) {
      throw Error(ErrorCode::invalid_input, "scene.light", scene.file, field, run.message,
                  "give an image of a whole sphere, twice as wide as high, or band_limit_deg");
    }
    light.smooth_deg = smoothnessOf(formats::Asset::open(table).get<ShLight>());
  }
}

int shOrder(double light_deg, double sigma_r) {
  // A lobe of deviation s weighs band l by exp(-l^2 s^2 / 2), which is a hundredth at l = 3.035 / s.
  constexpr double kBandsOfLobe = 3.035;
  const double of_facets = kBandsOfLobe / sigma_r;
  const double of_light = light_deg > 0 ? 360 / light_deg : of_facets;  // half vectors turn by half of the angle
  return std::max(1, static_cast<int>(std::ceil(std::min(of_facets, of_light))));
}

}  // namespace glint::apps
