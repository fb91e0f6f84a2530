// A small renderer, as a new integrator would write it with the public headers:
//   glint-render-test ASSET -o PICTURE.exr [--normals NORMALS] [--shape both] [--distance 4] [--light 0.5 10] [--size 128] ...
// Draws direct light on a ball and a square seen in perspective. JSON on stdout.

#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "picture.h"

namespace {

struct Arguments {
  std::string asset, output;
  glint::api::NdfOptions ndf;
  render::Options options;
  std::size_t threads = 0;
};

void declare(CLI::App& app, Arguments& a) {
  const std::map<std::string, render::Shape> shapes = {
      {"quad", render::Shape::quad}, {"sphere", render::Shape::sphere}, {"both", render::Shape::both}};
  const std::map<std::string, render::Filter> filters = {{"gaussian", render::Filter::gaussian}, {"box", render::Filter::box}};
  constexpr float kFarthest = 4096;  // map widths: uv of floats still tell texels apart
  render::Options& o = a.options;
  app.add_option("asset", a.asset, "asset of a kind that answers an NDF")->required();
  app.add_option("-o,--output", a.output, "picture (.exr): radiance, half vector, deviation of the footprint")->required();
  app.add_option("--normals", a.ndf.normals, "asset of the normals, for footprints below level 0");
  app.add_option("--shape", o.shape, "quad, sphere or both")->transform(CLI::CheckedTransformer(shapes));
  app.add_option("--distance", o.distance, "of the eye, map widths")->check(CLI::Range(0.01f, kFarthest));
  app.add_option("--light", o.lights, "angular diameters of the light, degrees; a picture for each")
      ->expected(1, static_cast<int>(render::kMostLights))
      ->check(CLI::Range(0.01f, 60.0f));
  app.add_option("--size", o.size, "pixels of the square picture along each axis")->check(CLI::Range(1, 4096));
  app.add_option("--samples", o.samples, "of a pixel, along each axis")->check(CLI::Range(1, 64));
  app.add_option("--shift-x", o.shift.x, "shift of the picture, pixels");
  app.add_option("--shift-y", o.shift.y, "shift of the picture, pixels");
  app.add_option("--filter", o.filter, "gaussian or box")->transform(CLI::CheckedTransformer(filters));
  app.add_flag("--curvature", o.curvature, "widen half vectors by the turning of the surface under a pixel");
  app.add_option("--sigma", o.sigma, "deviation of every footprint, texels; 0: from ray differentials")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--threads", a.threads, "most threads; 0: all");
}

void draw(const Arguments& a) {
  const std::size_t all = std::max(1u, std::thread::hardware_concurrency());
  const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, a.threads > 0 ? a.threads : all);
  const auto ndf = glint::api::OpenedNdf::open(a.asset, a.ndf);
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu_start = std::clock();  // of all threads
  const render::Picture picture = render::render(ndf, a.options);
  const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
  const double cpu_seconds = static_cast<double>(std::clock() - cpu_start) / CLOCKS_PER_SEC;
  render::write(picture, a.output);
  const long long samples = 1LL * picture.covered * a.options.samples * a.options.samples;
  const nlohmann::json result = {
      {"mean_radiance", picture.mean_radiance}, {"covered_pixels", picture.covered}, {"samples", samples},
      {"means", samples * picture.means},       {"seconds", seconds.count()},        {"cpu_seconds", cpu_seconds}};
  std::puts(result.dump().c_str());
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Draws direct light on a ball and a square whose facets come from an asset");
  declare(app, arguments);
  CLI11_PARSE(app, argc, argv);
  try {
    draw(arguments);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "glint-render-test: error: %s\n", error.what());
    return 1;
  }
}
