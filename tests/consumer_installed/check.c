/* Asks the library everything that its header promises: check ASSET DISPLACEMENT. Exits with the number of broken promises. */
#include <glint.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int broken = 0;

static void check(int holds, const char* promise) {
  if (holds) return;
  fprintf(stderr, "broken: %s (last error: %s)\n", promise, glint_error_message());
  ++broken;
}

enum { COUNT = 37 };

/* One struct for each query, as a renderer's wavefront may have them. */
typedef struct query {
  float u, v, sigma, hx, hy;
} query;

static void check_batches(const glint_ndf* ndf) {
  /* Exactly as much memory as the header asks for, so that a step beyond it is seen. */
  query* queries = malloc(COUNT * sizeof *queries);
  float* answers = malloc(COUNT * sizeof *answers);
  float* means = malloc(COUNT * sizeof *means);
  glint_footprints footprints;
  memset(&footprints, 0, sizeof footprints);
  for (int k = 0; k < COUNT; ++k) {
    const float t = (float)k / COUNT;
    const query q = {t, 1 - t, 1 + 60 * t, 0.4f * t - 0.2f, 0.1f - 0.2f * t};
    queries[k] = q;
  }
  const ptrdiff_t stride = sizeof(query);
  const glint_floats u = {&queries->u, stride}, v = {&queries->v, stride}, sigma = {&queries->sigma, stride};
  const glint_floats hx = {&queries->hx, stride}, hy = {&queries->hy, stride};
  const float low = -0.1f, high = 0.2f;
  const glint_floats x0 = {&low, 0}, x1 = {&high, 0};
  footprints.u = u;
  footprints.v = v;
  footprints.sigma = sigma;
  check(glint_density_batch(ndf, COUNT, &footprints, hx, hy, answers) == GLINT_OK, "a batch of densities");
  check(glint_mean_batch(ndf, COUNT, &footprints, x0, x0, x1, x1, means) == GLINT_OK, "a batch of means");
  for (int k = 0; k < COUNT; ++k) {
    const glint_footprint p = glint_footprint_isotropic(queries[k].u, queries[k].v, queries[k].sigma);
    float one = -1;
    glint_density(ndf, &p, queries[k].hx, queries[k].hy, &one);
    check(fabsf(one - answers[k]) <= 1e-6f * one, "densities of a batch are those of single queries");
    glint_mean(ndf, &p, low, low, high, high, &one);
    check(fabsf(one - means[k]) <= 1e-6f * one, "means of a batch are those of single queries");
  }
  const glint_floats none = {NULL, sizeof(float)};
  check(glint_density_batch(ndf, 0, NULL, none, none, NULL) == GLINT_OK, "no query needs no pointers");
  check(glint_density_batch(ndf, COUNT, &footprints, none, hy, answers) == GLINT_ERROR_USAGE, "hx must be given");
  check(glint_density_batch(ndf, COUNT, NULL, hx, hy, answers) == GLINT_ERROR_USAGE, "footprints must be given");
  check(glint_density_batch(ndf, COUNT, &footprints, hx, hy, NULL) == GLINT_ERROR_USAGE, "answers must be given");
  footprints.sigma = none;
  check(glint_density_batch(ndf, COUNT, &footprints, hx, hy, answers) == GLINT_ERROR_USAGE, "a size must be given");
  free(queries);
  free(answers);
  free(means);
}

static void check_bad_arguments(const glint_ndf* ndf) {
  const glint_footprint p = glint_footprint_isotropic(0.5f, 0.5f, 20);
  const glint_footprint odd = glint_footprint_isotropic(NAN, INFINITY, NAN);
  float value = -1;
  check(glint_density(NULL, &p, 0, 0, &value) == GLINT_ERROR_USAGE && value == -1, "a null handle is an error");
  check(strlen(glint_error_message()) > 0, "an error has a message");
  check(glint_density(ndf, NULL, 0, 0, &value) == GLINT_ERROR_USAGE && value == -1, "a null footprint is an error");
  check(glint_density(ndf, &p, NAN, 0, &value) == GLINT_OK && value == 0, "the density towards NaN is 0");
  check(glint_density(ndf, &p, 2, 0, &value) == GLINT_OK && value == 0, "the density outside the square is 0");
  check(glint_density(ndf, &odd, 0, 0, &value) == GLINT_OK && value >= 0 && isfinite(value), "any footprint has an answer");
  check(glint_mean(ndf, &p, 0, 0, 0, 0, &value) == GLINT_OK && value == 0, "the mean over an empty box is 0");
  check(glint_mean(ndf, &p, -1, -1, 1, 1, &value) == GLINT_OK && fabsf(value - 0.25f) < 0.02f, "the density integrates to 1");
}

static void check_opening(const char* path) {
  glint_ndf* ndf = NULL;
  check(glint_ndf_open("no-such-file.glint", NULL, &ndf) == GLINT_ERROR_IO && ndf == NULL, "a missing file is an error");
  check(strstr(glint_error_message(), "no-such-file.glint") != NULL, "the message names the file");
  check(glint_ndf_open(NULL, NULL, &ndf) == GLINT_ERROR_USAGE, "a null path is an error");
  check(glint_ndf_open(path, NULL, NULL) == GLINT_ERROR_USAGE, "a null handle pointer is an error");
  glint_open_options options = GLINT_OPEN_OPTIONS_INIT;
  options.sigma_r = -1;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_ERROR_USAGE, "a negative roughness is an error");
  options.sigma_r = 0;
  options.slant_tolerance = -0.5f;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_ERROR_USAGE, "a negative tolerance is an error");
  options.slant_tolerance = GLINT_SLANT_EXACT;
  options.gaussian_boxes = 2;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_ERROR_USAGE, "Gaussians are 1 or 3 boxes");
  options.gaussian_boxes = 3;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_OK, "options of other kinds are ignored");
  glint_ndf_close(ndf);
  ndf = NULL;
  options.struct_size = 1;
  check(glint_ndf_open(path, &options, &ndf) == GLINT_ERROR_USAGE, "options need their size");
  check(ndf == NULL, "a failed call leaves its outputs untouched");
  glint_ndf_close(NULL);
}

static int is_light(const float color[3]) {
  int c, light = 1;
  for (c = 0; c < 3; ++c) light = light && isfinite(color[c]) && color[c] >= 0;
  return light;
}

/* Directions of a batch as structs, around a view. */
static void make_directions(float (*wi)[3], float (*wo)[3]) {
  for (int k = 0; k < COUNT; ++k) {
    const float t = (float)k / COUNT;
    wi[k][0] = 0.2f - 0.3f * t, wi[k][1] = 0.2f * t, wo[k][0] = 0.5f * t - 0.3f, wo[k][1] = -0.1f;
    wi[k][2] = sqrtf(1 - wi[k][0] * wi[k][0] - wi[k][1] * wi[k][1]);
    wo[k][2] = sqrtf(1 - wo[k][0] * wo[k][0] - wo[k][1] * wo[k][1]);
  }
}

static glint_directions columns(float (*w)[3]) {
  const glint_directions d = {{&w[0][0], sizeof *w}, {&w[0][1], sizeof *w}, {&w[0][2], sizeof *w}};
  return d;
}

static void check_brdf(const glint_ndf* ndf) {
  const glint_footprint p = glint_footprint_isotropic(0.3f, 0.7f, 40);
  const float sigma = 40, u = 0.3f, v = 0.7f, xi = 0.4f, below[3] = {0, 0.6f, -0.8f};
  float(*wi)[3] = malloc(COUNT * sizeof *wi), (*wo)[3] = malloc(COUNT * sizeof *wo);
  float *f = malloc(3 * COUNT * sizeof *f), *weights = malloc(3 * COUNT * sizeof *weights);
  float *drawn = malloc(3 * COUNT * sizeof *drawn), *pdfs = malloc(COUNT * sizeof *pdfs),
        *drawn_pdfs = malloc(COUNT * sizeof *pdfs);
  glint_brdf* brdf = NULL;
  glint_brdf_options gold = GLINT_BRDF_OPTIONS_INIT;
  gold.fresnel = GLINT_FRESNEL_CONDUCTOR;
  gold.eta[0] = 0.18f, gold.eta[1] = 0.42f, gold.eta[2] = 1.37f;
  gold.k[0] = -1;
  check(glint_brdf_create(ndf, &gold, &brdf) == GLINT_ERROR_USAGE && brdf == NULL, "a negative extinction is an error");
  gold.k[0] = 3.42f, gold.k[1] = 2.35f, gold.k[2] = 1.77f;
  check(glint_brdf_create(ndf, &gold, &brdf) == GLINT_OK, "a distribution reflects");
  make_directions(wi, wo);
  glint_footprints footprints;
  memset(&footprints, 0, sizeof footprints);
  footprints.u.data = &u, footprints.v.data = &v, footprints.sigma.data = &sigma;
  const glint_directions wis = columns(wi), wos = columns(wo);
  const glint_floats random = {&xi, 0};
  check(glint_brdf_evaluate_batch(brdf, COUNT, &footprints, &wis, &wos, f, pdfs) == GLINT_OK, "a batch of values");
  check(glint_brdf_sample_batch(brdf, COUNT, &footprints, &wos, random, random, drawn, weights, drawn_pdfs) == GLINT_OK,
        "a batch of drawn directions");
  for (int k = 0; k < COUNT; ++k) {
    float one[3], weight[3], direction[3], pdf = -1;
    glint_brdf_evaluate(brdf, &p, wi[k], wo[k], one, &pdf);
    check(is_light(one) && pdf >= 0 && fabsf(one[2] - f[3 * k + 2]) <= 1e-6f * one[2] && fabsf(pdf - pdfs[k]) <= 1e-6f * pdf,
          "values of a batch are those of single queries");
    glint_brdf_sample(brdf, &p, wo[k], xi, xi, direction, weight, &pdf);
    check(is_light(weight) && direction[0] == drawn[3 * k] && weight[1] == weights[3 * k + 1] && pdf == drawn_pdfs[k],
          "directions of a batch are those of single queries");
  }
  float one[3] = {-1, -1, -1}, pdf = -1;
  check(glint_brdf_evaluate(brdf, &p, below, wo[0], one, &pdf) == GLINT_OK && one[0] == 0 && pdf == 0,
        "nothing is reflected from below the horizon");
  check(glint_brdf_evaluate(brdf, NULL, wi[0], wo[0], one, &pdf) == GLINT_ERROR_USAGE && one[0] == 0,
        "a BRDF needs a footprint");
  glint_brdf_destroy(brdf);
  glint_brdf_destroy(NULL);
  free(wi), free(wo), free(f), free(weights), free(drawn), free(pdfs), free(drawn_pdfs);
}

static void check_displaced(const char* path) {
  glint_displaced* displaced = NULL;
  glint_displaced_info info;
  const float *heights = NULL, u = 0.3f, v = 0.7f, xi = 0.4f;
  int32_t width = 0, height = 0;
  float level = -1, drawn[3], weight[3], pdf = -1;
  float(*wi)[3] = malloc(COUNT * sizeof *wi), (*wo)[3] = malloc(COUNT * sizeof *wo);
  float *light = malloc(3 * COUNT * sizeof *light), *pdfs = malloc(COUNT * sizeof *pdfs);
  check(glint_displaced_open("no-such-file.glint", 0, &displaced) == GLINT_ERROR_IO, "a missing displacement is an error");
  check(glint_displaced_open(path, 1, &displaced) == GLINT_OK, "a displacement opens");
  info.struct_size = sizeof info;
  check(glint_displaced_get_info(displaced, &info) == GLINT_OK && info.level_count > 0, "a displacement has levels");
  check(glint_displaced_heights(displaced, 0, &heights, &width, &height) == GLINT_OK && width * info.factors[0] == info.width &&
            isfinite(heights[width * height - 1]),
        "a level has a surface");
  check(glint_displaced_level(displaced, 1e9f, &level) == GLINT_OK && level == (float)(info.level_count - 1),
        "the largest footprint has the coarsest level");
  make_directions(wi, wo);
  const glint_directions wis = columns(wi), wos = columns(wo);
  glint_displaced_points points;
  memset(&points, 0, sizeof points);
  points.level.data = &level, points.u.data = &u, points.v.data = &v;
  level = 0.25f;
  check(glint_displaced_evaluate_batch(displaced, GLINT_DISPLACED_FULL, COUNT, &points, &wis, &wos, light, pdfs) == GLINT_OK,
        "a batch of reflected light");
  for (int k = 0; k < COUNT; ++k) {
    float one[3];
    glint_displaced_evaluate(displaced, GLINT_DISPLACED_FULL, level, u, v, wi[k], wo[k], one, &pdf);
    check(is_light(one) && one[0] == light[3 * k] && pdf == pdfs[k], "light of a batch is that of single queries");
    glint_displaced_sample(displaced, GLINT_DISPLACED_FULL, level, u, v, wo[k], xi, xi, drawn, weight, &pdf);
    check(is_light(weight) && isfinite(pdf) && pdf >= 0, "a displacement draws directions");
  }
  glint_displaced_close(displaced);
  glint_displaced_close(NULL);
  free(wi), free(wo), free(light), free(pdfs);
}

static void check_light(const glint_ndf* ndf) {
  const glint_spherical_gaussian lamps[2] = {{{0, 0, 1}, 50, {1, 2, 3}}, {{0.6f, 0, 0.8f}, 200, {3, 1, 1}}};
  const glint_footprint p = glint_footprint_from_cone(
      glint_ray_cone_bounced(glint_ray_cone_propagated((glint_ray_cone){0.1f, 0.01f}, 2), 0.1f), 4096.3, -17.3, NULL, 100);
  const float wo[3] = {-0.28f, 0, 0.96f};
  float light[3] = {-1, -1, -1}, wi[3], shares[2], pdf = -1, again = -2, mean[2], covariance[3];
  glint_brdf* brdf = NULL;
  check(glint_brdf_create(ndf, NULL, &brdf) == GLINT_OK, "a distribution reflects without options");
  check(glint_lobes_reflected(brdf, &p, wo, lamps, 2, 0, light) == GLINT_OK && is_light(light), "lobes are reflected");
  check(glint_lobes_shares(brdf, &p, wo, lamps, 2, shares) == GLINT_OK, "lobes have shares");
  check(glint_lobes_sample(lamps, 2, shares, 0.3f, 0.6f, wi, light, &pdf) == GLINT_OK && is_light(light) && pdf > 0,
        "lobes are drawn");
  check(glint_lobes_evaluate(lamps, 2, shares, wi, NULL, &again) == GLINT_OK && fabsf(again - pdf) <= 1e-5f * pdf,
        "lobes have a pdf");
  check(glint_ndf_slopes(ndf, mean, covariance) == GLINT_OK && covariance[0] >= 0 && covariance[2] >= 0, "a map has slopes");
  glint_brdf_destroy(brdf);
  check(glint_lobes_reflected(brdf, &p, wo, lamps, 2, 0, light) == GLINT_ERROR_USAGE, "a destroyed BRDF is an error");
}

static void check_curved(const glint_ndf* ndf) {
  glint_footprint p = glint_footprint_isotropic(0.3, 0.7, 40);
  const float up[3] = {0, 0, 1}, turn_x[3] = {0.04f, 0, 0}, turn_y[3] = {0, 0.02f, 0};
  float density = -1, mean = -1;
  check(p.spread[0] == 0 && p.spread[1] == 0, "a footprint is flat");
  check(glint_footprint_set_spread(&p, up, up, turn_x, turn_y, NULL, NULL, 0.5f) == GLINT_OK, "a surface turns");
  check(fabsf(p.spread[0] - 0.04f) < 1e-6f && fabsf(p.spread[1] - 0.02f) < 1e-6f, "the half vector turns with it");
  glint_density(ndf, &p, 0, 0, &density);
  p.spread[0] = p.spread[1] = 0;
  glint_mean(ndf, &p, -0.04f, -0.02f, 0.04f, 0.02f, &mean);
  check(fabsf(density - mean) <= 1e-4f * (1 + mean), "a curved pixel sees the mean over its half vectors");
  check(glint_footprint_set_spread(NULL, up, up, turn_x, turn_y, NULL, NULL, 0.5f) == GLINT_ERROR_USAGE, "null is an error");
}

static void check_packing(const glint_ndf* ndf) {
  size_t size = 0;
  const glint_status status = glint_ndf_pack(ndf, NULL, 0, &size);
  check(status == GLINT_OK || status == GLINT_ERROR_UNSUPPORTED, "a model packs, or its kind has no packed form");
  if (status != GLINT_OK) return;
  void* buffer = malloc(size);
  check(glint_ndf_pack(ndf, buffer, size - 1, &size) == GLINT_ERROR_USAGE, "a small buffer is an error");
  check(glint_ndf_pack(ndf, buffer, size, &size) == GLINT_OK, "a buffer of the right size is filled");
  free(buffer);
}

/* A handle of its own, because it is asked after it is closed. */
static void check_closed(const char* path) {
  glint_ndf* ndf = NULL;
  glint_brdf* brdf = NULL;
  const glint_footprint p = glint_footprint_box(0.3, 0.7, 9, 1, -1, 9);
  const float up[3] = {0, 0, 1};
  float value = -1, f[3];
  check(glint_ndf_open(path, NULL, &ndf) == GLINT_OK && glint_brdf_create(ndf, NULL, &brdf) == GLINT_OK,
        "an asset opens twice");
  glint_ndf_close(ndf);
  check(glint_density(ndf, &p, 0, 0, &value) == GLINT_ERROR_USAGE && value == -1, "asking a closed handle is an error");
  check(strstr(glint_error_message(), "closed") != NULL, "the message says so");
  check(glint_brdf_evaluate(brdf, &p, up, up, f, NULL) == GLINT_OK, "a BRDF keeps its distribution");
  glint_ndf_close(ndf);
  glint_brdf_destroy(brdf);
  glint_brdf_destroy(brdf);
  check(glint_brdf_evaluate(brdf, &p, up, up, f, NULL) == GLINT_ERROR_USAGE, "asking a destroyed BRDF is an error");
}

int main(int argc, char** argv) {
  glint_ndf* ndf = NULL;
  if (argc != 3) return 99;
  check(glint_abi_version() == GLINT_ABI_VERSION, "header and library are of one ABI");
  check(strchr(glint_version(), '.') != NULL, "the library knows its version");
  check(strcmp(glint_error_message(), "") == 0, "before the first error there is no message");
  check_opening(argv[1]);
  if (glint_ndf_open(argv[1], NULL, &ndf) != GLINT_OK) {
    fprintf(stderr, "%s\n", glint_error_message());
    return 98;
  }
  glint_ndf_info info;
  info.struct_size = sizeof info;
  check(glint_ndf_get_info(ndf, &info) == GLINT_OK && info.width > 0 && info.height > 0, "an asset says its size");
  check(info.struct_size == sizeof info, "the size of the struct is kept");
  check_bad_arguments(ndf);
  check_batches(ndf);
  check_brdf(ndf);
  check_light(ndf);
  check_curved(ndf);
  check_packing(ndf);
  check_closed(argv[1]);
  check_displaced(argv[2]);
  printf("%s, %d x %d texels, %d levels: %d broken promises\n", info.kind, (int)info.width, (int)info.height,
         (int)info.level_count, broken);
  glint_ndf_close(ndf);
  return broken;
}
