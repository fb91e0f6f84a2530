/*
 * glint, the C interface: ask a precomputed asset how the normals inside a footprint are distributed, and how they reflect
 * light.
 *
 * Conventions
 *  - uv: texture space, periodic; any finite uv is valid. v points up. Positions are doubles, because floats lose texels far out
 *    in a tiled texture; arrays of floats are for positions near the origin.
 *  - Half vectors are points (x, y) of the unit disk in the tangent frame, z = sqrt(1 - x^2 - y^2).
 *  - Densities are per unit projected area, >= 0: the microfacet D whose integral against the cosine is 1.
 *  - Sizes are in texels of the normal map.
 *  - Directions are unit vectors (x, y, z) of the tangent frame (dp/du, dp/dv, n), z out of the surface, both away from it:
 *    radiance comes along wi and leaves along wo. Colours are linear red, green and blue.
 *
 * Errors: every function that can fail returns a glint_status and leaves its outputs untouched unless it is GLINT_OK.
 * glint_error_message() then says what, where, and what to do. Queries fail for null arguments only: numbers that are not
 * finite or out of range have defined answers, given with each function. No C++ exception leaves the library.
 *
 * Closed handles: a function that is given one, or a handle of another kind, returns GLINT_ERROR_USAGE. For that, some 40 bytes
 * of each handle stay in memory until the program ends.
 *
 * Threads: handles are immutable; any number of threads may ask one at once. Opening is thread-safe and takes no lock. Queries
 * allocate nothing.
 *
 * Versions: three numbers, each with its rule. GLINT_ABI_VERSION, the number in the name of the shared library, rises when a
 * program has to be compiled again; functions, kinds and members at the end of sized structs come without that. glint_version()
 * is that of the project. Files have a version of their own, which opening checks.
 */
#ifndef GLINT_H
#define GLINT_H

#include <stddef.h>
#include <stdint.h>

#define GLINT_ABI_VERSION 2

#if defined(__GNUC__)
#define GLINT_API __attribute__((visibility("default")))
#else
#define GLINT_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* Classes of errors that a caller treats differently; the same numbers as the exit codes of the tools. */
typedef int32_t glint_status;
enum {
  GLINT_OK = 0,
  GLINT_ERROR_USAGE = 1,         /* an argument is null or out of range */
  GLINT_ERROR_IO = 2,            /* a file cannot be opened or read */
  GLINT_ERROR_INVALID_INPUT = 3, /* a file was read, but what it holds breaks a rule of the format */
  GLINT_ERROR_FAILED = 4,        /* out of memory, or another failure of the work itself */
  GLINT_ERROR_UNSUPPORTED = 5    /* a newer version of the format, or a kind that does not hold what is asked for */
};

/* GLINT_ABI_VERSION of the library that is loaded. Compare with the macro where the library is loaded by hand. */
GLINT_API int32_t glint_abi_version(void);

/* Version of the project, "MAJOR.MINOR.PATCH"; never null. */
GLINT_API const char* glint_version(void);

/* Message of the last call on this thread that did not return GLINT_OK: what, where, and what to do; "" if there was none.
 * Never null; valid until the next such call on this thread. */
GLINT_API const char* glint_error_message(void);

/* Stable id of the rule that was broken, such as "format.kind"; "" if there is none. Same lifetime as the message. */
GLINT_API const char* glint_error_rule(void);

/* A distribution of normals over a texture, opened from an asset. */
typedef struct glint_ndf glint_ndf;

enum { GLINT_SURFACE_FLAT = 0, GLINT_SURFACE_SMOOTH = 1 };
enum { GLINT_BOUNDARY_WRAP = 0, GLINT_BOUNDARY_CLAMP = 1 };
enum {
  GLINT_INTERPOLATION_FOOTPRINT = 0, /* 16 images, weighed so that together they see the footprint; 32 between levels */
  GLINT_INTERPOLATION_TRILINEAR = 1  /* 8 images: quicker, and answers a wider footprint */
};
enum {
  GLINT_PIXELS_SMOOTH = 0,  /* continuous, of the same mean in every pixel */
  GLINT_PIXELS_CONSTANT = 1 /* quicker, but small lights show the borders of pixels */
};

enum {
  GLINT_ESTIMATOR_EXACT = 0,    /* by the normals of the texels */
  GLINT_ESTIMATOR_PUBLISHED = 1 /* by the centres of 21 bins around the half vector: quicker, and less exact */
};

enum {
  GLINT_BINS_EVEN = 0, /* even over the bin: lights smaller than a bin show its borders */
  GLINT_BINS_LOBES =
      1 /* a lobe with the mean and the spread of the bin's normals over the whole map: continuous, and slower; even
                          in the outermost ring of bins */
};
enum {
  GLINT_KEPT_NORMALS_USED = 0,   /* footprints below level 0 are answered from them */
  GLINT_KEPT_NORMALS_IGNORED = 1 /* the asset answers as one that keeps none: to compare, or for speed */
};

/* Structs that start with a struct_size may grow: it says which version of the struct the caller has. A size that is smaller
 * than the first version's or above this is no size of a struct, and GLINT_ERROR_USAGE. */
#define GLINT_MOST_STRUCT_SIZE 4096

/* What an asset does not say itself. Zero is the default of every member but the first; options of other kinds are ignored, but
 * have to be in range. Members are added at the end; a library that does not know one accepts 0 there. */
typedef struct glint_open_options {
  size_t struct_size;       /* sizeof(glint_open_options) */
  const char* normals_path; /* asset of kind normals that the pyramid was made from: it answers footprints below level 0. Null:
                               the normals that the pyramid keeps answer them (glint-pyramid --keep-normals), and the nearest
                               level where it keeps none, or where kept_normals says so */
  float sigma_r;            /* kinds normals, slope-moments and histogram-sat: intrinsic roughness, disk units, 1e-4 to 0.25; 0:
                               0.005 */
  int32_t surface;          /* kind normals: GLINT_SURFACE_* */
  int32_t boundary;         /* kind normals: GLINT_BOUNDARY_* */
  int32_t verify_hashes;    /* not 0: compare datasets with their hashes, and bytes between objects with 0; reads all */
  float alpha;              /* kind bin-map: Beckmann roughness, in the range that the asset was made for; 0: the smallest */
  float slant_tolerance;    /* kind histogram-sat: share of a footprint with slanted sides that may be counted in a wrong
                               place, up to 1; 0: 0.06; GLINT_SLANT_EXACT: none, and slower */
  int32_t gaussian_boxes;   /* kind histogram-sat: boxes that stand for a Gaussian footprint, 1 or 3; 0: 1 */
  int32_t footprint_parts;  /* kinds with levels of images, and slope-moments: most round footprints that stand for a stretched
                               one, up to 32, each at the cost of one; 1: one of the same mean square size, whatever the
                               shape; 0: 32 */
  int32_t interpolation;    /* kinds with levels of images: GLINT_INTERPOLATION_*, how footprints between the stored ones are
                               answered */
  int32_t pixels;           /* kinds with levels of images: GLINT_PIXELS_*, how densities run between half vectors of one pixel
                               of an image */
  int32_t copy;         /* not 0: copy the bytes of the asset into memory of its own. For files that others may truncate while
                               they are open, which would end the program with SIGBUS, and for memory that does not stay */
  int32_t estimator;    /* kind bin-map: GLINT_ESTIMATOR_*, how densities are made of the texels; means and samples are exact */
  int32_t bins;         /* kind histogram-sat: GLINT_BINS_*, where the normals of a bin are */
  int32_t kept_normals; /* kinds ndf-pyramid and ndf-cp: GLINT_KEPT_NORMALS_*, whether the asset's own normals are used */
} glint_open_options;

#define GLINT_SLANT_EXACT (-1.0f)

/* clang-format off */
#define GLINT_OPEN_OPTIONS_INIT { sizeof(glint_open_options), NULL, 0.0f, 0, 0, 0, 0.0f, 0.0f, 0, 0, 0, 0, 0, 0, 0, 0 }
/* clang-format on */

/* Opens an asset of any kind that holds a distribution of normals: normals, ndf-pyramid, ndf-cp, bin-map, histogram-sat,
 * slope-moments, tiny-example, wang-cp, wang-pyramid, wang-tiles, wave-cp, wave-pyramid.
 *
 * The file is checked, then mapped; what queries read is not copied. Safe on untrusted files. A file must not be changed in
 * place while it is open (the tools never do: they replace files).
 *
 * A path with <UDIM> in the name of the file, such as "rock.<UDIM>.glint", opens every tile of a UDIM set that has a file, of kind
 * normals, ndf-pyramid, ndf-cp or slope-moments: tile 1001 + floor(u) + 10 floor(v) holds uv. normals_path is then a pattern, too.
 * Sizes of footprints are in texels of the largest tile. Where the set has no tile, densities and means are 0 and nothing is
 * drawn; its weights in footprints that reach there count for nothing. The file of one tile opens as a set of this tile.
 * path: UTF-8, not null. options: null for the defaults. ndf: receives the handle, not null.
 * Returns GLINT_ERROR_USAGE for null path or ndf, or options out of range; IO, INVALID_INPUT and UNSUPPORTED as listed
 * above. */
GLINT_API glint_status glint_ndf_open(const char* path, const glint_open_options* options, glint_ndf** ndf);

/* The same for an asset whose bytes are in memory. They must stay unchanged as long as the asset is open, unless
 * options->copy is set. They are copied, too, where they do not start at a multiple of 64.
 * bytes: not null. name: UTF-8, name of the asset in messages; null: "memory".
 * Returns what glint_ndf_open returns; GLINT_ERROR_USAGE for null bytes. */
GLINT_API glint_status glint_ndf_open_memory(const void* bytes, size_t size_bytes, const char* name,
                                             const glint_open_options* options, glint_ndf** ndf);

/* Where the bytes of an asset come from that is neither a file nor in memory, such as a part of an archive. */
typedef struct glint_source {
  const char* name;    /* UTF-8, name of the asset in messages; null: "source" */
  uint64_t size_bytes; /* of the asset */
  void* context;       /* passed to read */
  /* Fills size_bytes bytes at `to` with those of the asset from `offset` on, which are inside the asset. Returns 0, or another
   * number where reading fails. Not null. */
  int32_t (*read)(void* context, uint64_t offset, void* to, size_t size_bytes);
} glint_source;

/* The same for bytes that a function reads: all of them, on the calling thread, before this returns.
 * Returns what glint_ndf_open returns; GLINT_ERROR_USAGE for a null source or read, GLINT_ERROR_IO where read fails. */
GLINT_API glint_status glint_ndf_open_source(const glint_source* source, const glint_open_options* options, glint_ndf** ndf);

/* Closes a handle; null and closed handles are ignored. No thread may be asking it. BRDFs of the handle stay usable: the asset
 * stays open until the last of them is destroyed. */
GLINT_API void glint_ndf_close(glint_ndf* ndf);

/* What a handle is. Members are added at the end; the library fills those that fit into struct_size. */
typedef struct glint_ndf_info {
  size_t struct_size;          /* set by the caller: sizeof(glint_ndf_info) */
  const char* kind;            /* "normals", "ndf-pyramid", ...; lives as long as the handle */
  int32_t width;               /* of the normal map, texels */
  int32_t height;              /* of the normal map, texels */
  int32_t resolution;          /* pixels along each axis of a stored NDF image; 256 where there are none */
  int32_t level_count;         /* footprint sizes that are stored; 0: all sizes are answered from the texels */
  float sigma_r;               /* intrinsic roughness, disk units; bin-map: alpha / sqrt(2); even bins of
                                  histogram-sat: 0, they have none */
  float finest_sigma_texels;   /* footprint of level 0, deviation in texels; 0 where there are no levels */
  int32_t surface;             /* GLINT_SURFACE_* */
  int32_t boundary;            /* GLINT_BOUNDARY_* */
  int32_t has_normals;         /* 1: footprints below level 0 are answered from the texels */
  float coarsest_sigma_texels; /* footprint of the last level, above which answers tend to the mean of the map; 0 where
                                  there are no levels */
  uint64_t file_bytes;         /* size of the asset */
  float smallest_sigma_texels; /* smallest footprint that is answered as wide as it is asked for, deviation in texels; smaller
                                  ones are answered up to this wide. 0 where there are no levels, or the normals are given or
                                  kept */
  int32_t udim_tiles;          /* tiles of a UDIM set, whose kind is that of its tiles; 0: no set */
} glint_ndf_info;

/* Fills info. Returns GLINT_ERROR_USAGE for null arguments or a struct_size that does not reach beyond itself or is
 * above GLINT_MOST_STRUCT_SIZE. */
GLINT_API glint_status glint_ndf_get_info(const glint_ndf* ndf, glint_ndf_info* info);

/* Moments of the map's slopes (dz/dx, dz/dy), from which masking follows: mean, and covariance xx, xy, yy. For kind normals this
 * may read all texels. Returns GLINT_ERROR_USAGE for null arguments, else GLINT_OK. */
GLINT_API glint_status glint_ndf_slopes(const glint_ndf* ndf, float mean[2], float covariance[3]);

/* Packs the model, and the normals that it was opened with or keeps, into one buffer without addresses, for a GPU or another process: the
 * layout of glint/model/packed_ndf.h, which glint/query/packed_ndf_view.h reads.
 *
 * buffer: receives the bytes; null to ask for the size only, which costs as much. capacity: bytes of the buffer. size: receives
 * the bytes of the packed model.
 * Returns GLINT_ERROR_USAGE for null ndf or size, or a capacity that is too small; UNSUPPORTED for kinds without a packed form,
 * which the message tells apart. */
GLINT_API glint_status glint_ndf_pack(const glint_ndf* ndf, void* buffer, size_t capacity, size_t* size);

/* The region of texture space that a shading point sees. Made by the functions below; who fills it by hand begins with {0}. */
enum { GLINT_FOOTPRINT_GAUSSIAN = 0, GLINT_FOOTPRINT_BOX = 1 };
typedef struct glint_footprint {
  int32_t kind; /* GLINT_FOOTPRINT_*; other values count as Gaussian */
  double u, v;  /* centre, in maps: the whole parts count on planes without end (kind tiny-example, in sizes of the example;
                   kinds wang-cp, wang-pyramid and wang-tiles, and UDIM sets, in tiles), for BRDFs as far as floats tell positions apart; maps repeat */
  float m[4];   /* Gaussian: covariance xx, xy, yy in texels^2, and unused. Box: a parallelogram's half axes ax, ay, bx, by
                   in texels */
  /* On a curved surface, half widths of the box of half vectors that the pixel sees, since the surface's normal turns under it:
     glint_footprint_set_spread. Densities, means, samples and BRDFs are averaged over the box, at the cost of a mean, so that
     narrow highlights do not alias. 0, and what is not above 0: flat. Colours of kind wave-pyramid and Beckmann facets leave it
     out. */
  float spread[2];
} glint_footprint;

/* Isotropic Gaussian of deviation sigma, texels. */
GLINT_API glint_footprint glint_footprint_isotropic(double u, double v, float sigma_texels);

/* Parallelogram with the half axes a and b, texels. */
GLINT_API glint_footprint glint_footprint_box(double u, double v, float ax, float ay, float bx, float by);

/* The Gaussian footprint of a pixel, from ray differentials: (dudx, dvdx) and (dudy, dvdy) are the changes of uv from one pixel to
 * the next along x and y. width, height: of the map, texels. The pixel filter is a Gaussian of deviation 0.5 pixels; scale the
 * differentials for another. What is not a number counts as 0. */
GLINT_API glint_footprint glint_footprint_from_differentials(double u, double v, float dudx, float dvdx, float dudy, float dvdy,
                                                             int32_t width, int32_t height);

/* The width of a path as a Gaussian beam, for bounces, which have no ray differentials. */
typedef struct glint_ray_cone {
  float width;  /* deviation across the ray at the last hit, scene units */
  float spread; /* deviation of directions, radians */
} glint_ray_cone;

/* The beam after a distance, scene units. */
GLINT_API glint_ray_cone glint_ray_cone_propagated(glint_ray_cone cone, float distance);

/* The beam after reflection by facets whose slopes have this deviation per axis: alpha / sqrt(2) of a GGX or Beckmann lobe; of a
 * map, the square root of the mean variance of glint_ndf_slopes plus sigma_r^2. */
GLINT_API glint_ray_cone glint_ray_cone_bounced(glint_ray_cone cone, float slope_sigma);

/* The footprint of a beam on a surface, stretched along the ray. direction: unit vector of the tangent frame towards the ray's
 * origin; null: straight above. texels_per_unit: texels in a scene unit, > 0. What is not a number counts as 0. */
GLINT_API glint_footprint glint_footprint_from_cone(glint_ray_cone cone, double u, double v, const float direction[3],
                                                    float texels_per_unit);

/* Sets the spread of a footprint on a curved surface, for light from wi that is seen from wo.
 *
 * wi, wo: unit vectors of the tangent frame. dndx, dndy: change of the surface's unit normal, without the map, from one pixel to
 * the next along x and along y, in the tangent frame. dwodx, dwody: change of wo, minus that of the ray; null: none. filter_sigma:
 * deviation of the pixel filter, pixels: 0.5, or for one of n samples of a pixel 0.5 / sqrt(n).
 * What is not a number gives a spread of 0. Returns GLINT_ERROR_USAGE for a null argument, else GLINT_OK. */
GLINT_API glint_status glint_footprint_set_spread(glint_footprint* footprint, const float wi[3], const float wo[3],
                                                  const float dndx[3], const float dndy[3], const float dwodx[3],
                                                  const float dwody[3], float filter_sigma);

/* Density towards one half vector.
 *
 * 0 outside the square |x|, |y| <= 1 and for half vectors that are not numbers. Footprints: a centre that is not finite counts
 * as 0; sizes that are too small or not finite count as the narrowest footprint; those longer than the map wind round it,
 * and with levels answers tend to the mean of the map above coarsest_sigma_texels (files without that mean answer as their last
 * level does). Levels know round footprints: boxes count as the Gaussian of the same moments, and stretched ones as several
 * (footprint_parts).
 * Returns GLINT_ERROR_USAGE for null arguments, else GLINT_OK. */
GLINT_API glint_status glint_density(const glint_ndf* ndf, const glint_footprint* footprint, float hx, float hy,
                                     float* density);

/* Density in linear sRGB towards a point psi, of kinds wave-pyramid and wave-cp; other kinds: the density of glint_density in each channel.
 *
 * psi = ((wi + wo) / 2)_xy: for directions near the normal, the half vector. A flat mirror is white. rgb: three floats. They are
 * finite, and may be below 0: colours of few wavelengths lie outside the gamut. Footprints and status as for glint_density. */
GLINT_API glint_status glint_density_rgb(const glint_ndf* ndf, const glint_footprint* footprint, float psi_x, float psi_y,
                                         float rgb[3]);

/* Number of channels of kinds wave-pyramid and wave-cp: 3 for CIE X, Y and Z, else one for each wavelength; 1 for other kinds. Returns
 * GLINT_ERROR_USAGE for null arguments, else GLINT_OK. */
GLINT_API glint_status glint_ndf_channels(const glint_ndf* ndf, int32_t* channels);

/* Density of each channel towards psi; other kinds than wave-pyramid and wave-cp: the density of glint_density.
 * capacity: floats of `densities`, at least the channels. Returns GLINT_ERROR_USAGE for null arguments or too small a capacity,
 * else GLINT_OK. Footprints as for glint_density. */
GLINT_API glint_status glint_density_spectrum(const glint_ndf* ndf, const glint_footprint* footprint, float psi_x, float psi_y,
                                              float* densities, size_t capacity);

/* Mean density over the box [x0, x1] x [y0, y1] of half vectors, as a light or a pixel of an NDF image asks for it.
 *
 * The average of glint_density, but for kind ndf-cp: there the density is what the compression leaves above its floors, and the
 * mean counts what lies below, so that they differ by up to the error of the compression.
 * Counts 0 outside the square [-1, 1]^2; 0 for a box that is empty or not finite. Footprints and status as for
 * glint_density. */
GLINT_API glint_status glint_mean(const glint_ndf* ndf, const glint_footprint* footprint, float x0, float y0, float x1,
                                  float y1, float* mean);

/* Draws a half vector in proportion to the density.
 *
 * (xi1, xi2): random numbers in [0, 1), stratified ones stay stratified; others are clamped, NaN counts as 0.
 * (hx, hy): the half vector. It may lie outside the unit disk, where facets near the horizon blur to: no direction.
 * pdf: its density per unit projected area, the density over its integral; 0 if nothing can be drawn, and hx = hy = 0 then.
 * Multiply by the half vector's z for a density per unit solid angle of half vectors. Footprints and status as for
 * glint_density. */
GLINT_API glint_status glint_sample(const glint_ndf* ndf, const glint_footprint* footprint, float xi1, float xi2, float* hx,
                                    float* hy, float* pdf);

/* Floats of a batch: element k is at data + k * stride bytes. A contiguous array has the stride sizeof(float), a member of an
 * array of structs that of the struct; with stride 0 all queries share one value. Every address must be that of a float. */
typedef struct glint_floats {
  const float* data; /* null: not given */
  ptrdiff_t stride;  /* bytes; may be negative */
} glint_floats;

/* Doubles of a batch, as glint_floats. */
typedef struct glint_doubles {
  const double* data; /* null: not given */
  ptrdiff_t stride;   /* bytes; may be negative */
} glint_doubles;

/* Footprints of a batch. u and v, or precise_u and precise_v, and one of sigma; xx and yy, with or without xy; ax, ay, bx and by
 * must be given. If several are given, the first of them counts. Zero the struct first. */
typedef struct glint_footprints {
  glint_floats u, v;                  /* centres */
  glint_floats sigma;                 /* isotropic Gaussians: deviation, texels */
  glint_floats xx, xy, yy;            /* Gaussians: covariance, texels^2 */
  glint_floats ax, ay, bx, by;        /* boxes: half axes, texels */
  glint_doubles precise_u, precise_v; /* centres as doubles: for positions far out. Where given, u and v are not read. For
                                         BRDFs of planes without end give u and v: here the whole parts do not count */
  glint_floats spread_x, spread_y;    /* on curved surfaces, spread of each glint_footprint; null, both: flat */
} glint_footprints;

/* densities[k] = glint_density of query k, k < count, to 1e-6 of its size; densities is contiguous.
 *
 * count = 0 is valid and reads nothing, so that pointers may then be null. Returns GLINT_ERROR_USAGE for null pointers or a
 * missing array, else GLINT_OK. Outputs must not overlap inputs. To use threads, split the batch. */
GLINT_API glint_status glint_density_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints,
                                           glint_floats hx, glint_floats hy, float* densities);

/* rgb[3 k] to rgb[3 k + 2] = glint_density_rgb of query k; rgb is contiguous. Else as glint_density_batch. */
GLINT_API glint_status glint_density_rgb_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints,
                                               glint_floats psi_x, glint_floats psi_y, float* rgb);

/* means[k] = glint_mean of query k. Else as glint_density_batch. */
GLINT_API glint_status glint_mean_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints, glint_floats x0,
                                        glint_floats y0, glint_floats x1, glint_floats y1, float* means);

/* (hx[k], hy[k]) and pdfs[k] = glint_sample of query k; the three arrays are contiguous. Else as glint_density_batch. */
GLINT_API glint_status glint_sample_batch(const glint_ndf* ndf, size_t count, const glint_footprints* footprints,
                                          glint_floats xi1, glint_floats xi2, float* hx, float* hy, float* pdfs);

/* A microfacet BRDF over a texture: a distribution of normals, what its facets are made of, and how its slopes mask each
 * other (Deng 2022, sections 5.1 and 5.2; masking: Heitz 2014, Eq. 99; Beckmann facets: Atanasov 2021, Eq. 5, 11 and 15). */
typedef struct glint_brdf glint_brdf;

enum {
  GLINT_FRESNEL_MIRROR = 0,     /* everything is reflected: for furnace tests, or where reflectance is applied elsewhere */
  GLINT_FRESNEL_DIELECTRIC = 1, /* reflection only; what is refracted is lost */
  GLINT_FRESNEL_CONDUCTOR = 2
};
enum {
  GLINT_FACETS_OF_DISTRIBUTION = 0, /* f = D F G2 / (4 wi.z wo.z), D the density of the distribution; kind wave-pyramid: f = D F
                                       G2 / 4 in colour, D of psi = ((wi + wo) / 2)_xy */
  GLINT_FACETS_BECKMANN = 1         /* kind bin-map: texels are facets of Beckmann microfacets, with masking of their own: for
                                       rough or steep maps */
};

/* What facets are made of. Zero is the default of every member but the first. Members are added at the end, as to
 * glint_open_options. */
typedef struct glint_brdf_options {
  size_t struct_size; /* sizeof(glint_brdf_options) */
  int32_t fresnel;    /* GLINT_FRESNEL_* */
  int32_t facets;     /* GLINT_FACETS_* */
  float eta[3];       /* refractive index of each channel over that of the outside. Conductor: 0 to 1e3. Dielectric: the first
                         counts, 1e-3 to 1e3 */
  float k[3];         /* conductor: extinction of each channel, 0 to 1e3 */
} glint_brdf_options;

/* clang-format off */
#define GLINT_BRDF_OPTIONS_INIT { sizeof(glint_brdf_options), 0, 0, { 0.0f, 0.0f, 0.0f }, { 0.0f, 0.0f, 0.0f } }
/* clang-format on */

/* Makes a BRDF of a distribution, whose handle may be closed before that of the BRDF. It is masked by the slopes of the whole
 * map (Smith, heights correlated), which every kind holds but normals: for those this reads all texels once.
 *
 * options: null for the defaults. brdf: receives the handle, not null.
 * Returns GLINT_ERROR_USAGE for null ndf or brdf, or options out of range; UNSUPPORTED for GLINT_FACETS_BECKMANN of another
 * kind than bin-map. */
GLINT_API glint_status glint_brdf_create(const glint_ndf* ndf, const glint_brdf_options* options, glint_brdf** brdf);

/* Destroys a handle, not the distribution; null and destroyed handles are ignored. No thread may be asking it. */
GLINT_API void glint_brdf_destroy(glint_brdf* brdf);

/* The BRDF inside a footprint and the density of its samples.
 *
 * f: red, green and blue, 1/sr, each >= 0, without the cosine wi.z. pdf: density with which glint_brdf_sample draws wi for this
 * wo, per unit solid angle. Either may be null; together they cost one density.
 * 0 for directions below the horizon or within 1e-6 of it, longer than a unit vector, or not finite. Reciprocal but for
 * rounding. With all facets white, f wi.z integrates to at most 1 so far as the slopes of the map are normally distributed;
 * single footprints that lean towards wo may exceed that. Footprints: as for glint_density.
 * Returns GLINT_ERROR_USAGE for null arguments (f and pdf: both), else GLINT_OK. */
GLINT_API glint_status glint_brdf_evaluate(const glint_brdf* brdf, const glint_footprint* footprint, const float wi[3],
                                           const float wo[3], float f[3], float* pdf);

/* Draws wi for a view wo.
 *
 * (xi1, xi2): as for glint_sample. weight: f wi.z / pdf of each channel, bounded. pdf: per unit solid angle; where it is 0
 * nothing was drawn, and wi and weight are 0: half vectors outside the disk, and facets that reflect below the horizon. No
 * argument may be null. Else as for glint_brdf_evaluate. */
GLINT_API glint_status glint_brdf_sample(const glint_brdf* brdf, const glint_footprint* footprint, const float wo[3], float xi1,
                                         float xi2, float wi[3], float weight[3], float* pdf);

/* Directions of a batch; all three must be given. An array of structs of three floats has them at strides of that struct. */
typedef struct glint_directions {
  glint_floats x, y, z;
} glint_directions;

/* f[3 k] to f[3 k + 2] and pdfs[k] = glint_brdf_evaluate of query k, k < count, to 1e-6 of their size; f or pdfs may be null.
 * Else as for glint_density_batch. */
GLINT_API glint_status glint_brdf_evaluate_batch(const glint_brdf* brdf, size_t count, const glint_footprints* footprints,
                                                 const glint_directions* wi, const glint_directions* wo, float* f, float* pdfs);

/* wi[3 k] to wi[3 k + 2], weights[3 k] to weights[3 k + 2] and pdfs[k] = glint_brdf_sample of query k. Else as for
 * glint_density_batch. */
GLINT_API glint_status glint_brdf_sample_batch(const glint_brdf* brdf, size_t count, const glint_footprints* footprints,
                                               const glint_directions* wo, glint_floats xi1, glint_floats xi2, float* wi,
                                               float* weights, float* pdfs);

/* A lobe of light: radiance amplitude exp(sharpness (w . axis - 1)) from each direction w. An environment or a large lamp is a list
 * of lobes. Lobes that are not finite, of a sharpness outside (0, 1e10), or without a unit axis give no light. */
typedef struct glint_spherical_gaussian {
  float axis[3];      /* unit vector, tangent frame of the shading point */
  float sharpness;    /* > 0; the deviation is about 1 / sqrt(sharpness) radians */
  float amplitude[3]; /* radiance along the axis: red, green and blue */
} glint_spherical_gaussian;

enum { GLINT_MOST_LOBE_CELLS = 8 };

/* Radiance that a surface reflects towards wo from all lobes, without sampling: D is averaged over the half vectors of each lobe
 * (Deng 2022, section 5.4).
 *
 * cells: cells along each axis that a lobe is cut into, 1 to GLINT_MOST_LOBE_CELLS; 0: 3. More follow wide lobes more closely.
 * radiance: red, green and blue; 0 for wo below the horizon. lobes may be null if count is 0.
 * Returns GLINT_ERROR_USAGE for null arguments, cells out of range, and a BRDF of Beckmann facets or of
 * kind wave-pyramid. */
GLINT_API glint_status glint_lobes_reflected(const glint_brdf* brdf, const glint_footprint* footprint, const float wo[3],
                                             const glint_spherical_gaussian* lobes, size_t count, int32_t cells,
                                             float radiance[3]);

/* Prepares sampling of lobes for one BRDF, footprint and wo: shares[k] receives the probability of lobe k, by the light that it
 * adds towards wo. One mean for each lobe. Returns as glint_lobes_reflected. */
GLINT_API glint_status glint_lobes_shares(const glint_brdf* brdf, const glint_footprint* footprint, const float wo[3],
                                          const glint_spherical_gaussian* lobes, size_t count, float* shares);

/* Draws a direction towards the lobes, by the shares that glint_lobes_shares has filled.
 *
 * (xi1, xi2): as for glint_sample. radiance: of all lobes along wi. pdf: per unit solid angle; 0 if there is no light. wi may lie
 * below the horizon. Returns GLINT_ERROR_USAGE for null arguments, else GLINT_OK. */
GLINT_API glint_status glint_lobes_sample(const glint_spherical_gaussian* lobes, size_t count, const float* shares, float xi1,
                                          float xi2, float wi[3], float radiance[3], float* pdf);

/* Radiance of all lobes along w, and the density with which glint_lobes_sample draws w, per unit solid angle: to weigh samples of
 * the BRDF against those of the light. Either may be null; without pdf, shares may be. Returns as glint_lobes_sample. */
GLINT_API glint_status glint_lobes_evaluate(const glint_spherical_gaussian* lobes, size_t count, const float* shares,
                                            const float w[3], float radiance[3], float* pdf);

/* A displacement map at several levels of detail, each a coarse surface and the light that it reflects, shadowing and
 * interreflections of all that is finer included (Wu 2019, Eq. 11 and 18). */
typedef struct glint_displaced glint_displaced;

enum { GLINT_DISPLACED_MAX_LEVELS = 8 };
enum { GLINT_BASE_DIFFUSE = 0, GLINT_BASE_GGX = 1, GLINT_BASE_TABLE = 2 };
enum {
  GLINT_DISPLACED_FULL = 0,
  GLINT_DISPLACED_LOBES = 1, /* the lobes of normals alone: no shadowing, no interreflections */
  GLINT_DISPLACED_SINGLE = 2 /* one Beckmann lobe with Smith's shadowing */
};

/* Opens an asset of kind displacement; as glint_ndf_open. verify_hashes: as glint_open_options. */
GLINT_API glint_status glint_displaced_open(const char* path, int32_t verify_hashes, glint_displaced** displaced);

/* The same for bytes in memory; as glint_ndf_open_memory. copy: as glint_open_options. */
GLINT_API glint_status glint_displaced_open_memory(const void* bytes, size_t size_bytes, const char* name,
                                                   int32_t verify_hashes, int32_t copy, glint_displaced** displaced);

/* The same for bytes that a function reads; as glint_ndf_open_source. */
GLINT_API glint_status glint_displaced_open_source(const glint_source* source, int32_t verify_hashes,
                                                   glint_displaced** displaced);

/* Closes a handle; null and closed handles are ignored. No thread may be asking it. */
GLINT_API void glint_displaced_close(glint_displaced* displaced);

/* What a handle is. Members are added at the end; the library fills those that fit into struct_size. */
typedef struct glint_displaced_info {
  size_t struct_size;  /* set by the caller: sizeof(glint_displaced_info) */
  int32_t width;       /* of the original map, texels */
  int32_t height;      /* of the original map, texels */
  int32_t level_count; /* 1 to GLINT_DISPLACED_MAX_LEVELS */
  int32_t channels;    /* 3, or 1: red, green and blue are the same */
  int32_t base;        /* GLINT_BASE_*: what the original surface is made of */
  float texel_size_um; /* of the original; 0: unknown */
  uint64_t file_bytes; /* size of the asset */
  /* Of each level, increasing; 0 beyond level_count. Texels of the original along a side of a cell where this divides the map; else
     the number of cells is the nearest whole one. */
  int32_t factors[GLINT_DISPLACED_MAX_LEVELS];
} glint_displaced_info;

/* Fills info. Returns GLINT_ERROR_USAGE for null arguments or a struct_size that does not reach beyond itself or is
 * above GLINT_MOST_STRUCT_SIZE. */
GLINT_API glint_status glint_displaced_get_info(const glint_displaced* displaced, glint_displaced_info* info);

/* The coarse surface of one level, on which its reflectance is asked: heights in texels of the original, [rows][columns],
 * bottom row first, periodic. Vertex (i, j) lies over texel (i width / columns, j height / rows), counted between centres of
 * texels; the cell above and to the right of it is two triangles that meet along the diagonal from vertex (i + 1, j) to (i, j + 1).
 *
 * heights: receives a pointer into the file, which lives as long as the handle. Returns GLINT_ERROR_USAGE for null arguments or
 * a level that is not there. */
GLINT_API glint_status glint_displaced_heights(const glint_displaced* displaced, int32_t level, const float** heights,
                                               int32_t* columns, int32_t* rows);

/* Level of detail for an isotropic Gaussian footprint of deviation sigma, texels of the original: 1.25 is three parts of level
 * 1 and one of level 2. In [0, level_count - 1]; 0 for NaN. Returns GLINT_ERROR_USAGE for null arguments, else GLINT_OK. */
GLINT_API glint_status glint_displaced_level(const glint_displaced* displaced, float sigma_texels, float* level);

/* Light reflected from wi to wo at a point of the coarse surface, and the density of its samples.
 *
 * variant: GLINT_DISPLACED_*; other values count as FULL. level: clamped, NaN counts as 0; between two levels both are asked,
 * each with the facet of its own. (u, v): any; what is not finite counts as 0.
 * reflected: red, green and blue, BRDF times the cosine between wi and the facet, 1/sr, each >= 0: multiply by radiance and
 * solid angle. It is that of all the relief below the level; whether the coarse surface hides wi or wo is the caller's to say.
 * 0 for directions behind the facet or within 1e-6 of its plane. Reciprocal but for rounding.
 * pdf: density with which glint_displaced_sample draws wi for this wo, per unit solid angle, behind the facet too. Either may be
 * null. Both are 0 for directions longer than a unit vector, or not finite. Returns GLINT_ERROR_USAGE for null arguments
 * (reflected and pdf: both), else GLINT_OK. */
GLINT_API glint_status glint_displaced_evaluate(const glint_displaced* displaced, int32_t variant, float level, double u,
                                                double v, const float wi[3], const float wo[3], float reflected[3], float* pdf);

/* Draws wi for a view wo, by the lobes of whichever variant.
 *
 * (xi1, xi2): as for glint_sample. weight: reflected / pdf of each channel. pdf: per unit solid angle; where it is 0 nothing
 * was drawn, and wi and weight are 0. Directions behind the facet are drawn, with weight 0. No argument may be null. Else as
 * for glint_displaced_evaluate. */
GLINT_API glint_status glint_displaced_sample(const glint_displaced* displaced, int32_t variant, float level, double u,
                                              double v, const float wo[3], float xi1, float xi2, float wi[3], float weight[3],
                                              float* pdf);

/* Points of a batch: level, and u and v, or precise_u and precise_v. Zero the struct first. */
typedef struct glint_displaced_points {
  glint_floats level, u, v;
  glint_doubles precise_u, precise_v; /* as of glint_footprints */
} glint_displaced_points;

/* reflected[3 k] to reflected[3 k + 2] and pdfs[k] = glint_displaced_evaluate of query k; reflected or pdfs may be null. Else
 * as for glint_density_batch. */
GLINT_API glint_status glint_displaced_evaluate_batch(const glint_displaced* displaced, int32_t variant, size_t count,
                                                      const glint_displaced_points* points, const glint_directions* wi,
                                                      const glint_directions* wo, float* reflected, float* pdfs);

/* wi[3 k] to wi[3 k + 2], weights[3 k] to weights[3 k + 2] and pdfs[k] = glint_displaced_sample of query k. Else as for
 * glint_density_batch. */
GLINT_API glint_status glint_displaced_sample_batch(const glint_displaced* displaced, int32_t variant, size_t count,
                                                    const glint_displaced_points* points, const glint_directions* wo,
                                                    glint_floats xi1, glint_floats xi2, float* wi, float* weights, float* pdfs);

#ifdef __cplusplus
}
#endif

#endif
