#pragma once

#include <variant>

#include "glint/api/models/bin_map.h"
#include "glint/api/models/compressed.h"
#include "glint/api/models/histogram.h"
#include "glint/api/models/moments.h"
#include "glint/api/models/pyramid.h"
#include "glint/api/models/reference.h"
#include "glint/api/models/tiny.h"
#include "glint/api/models/wang.h"
#include "glint/api/models/wave.h"
#include "glint/api/ndf_model_list.h"
#include "glint/api/udim_ndf.h"

namespace glint::api {

/// Every kind of model that an asset can hold, for footprints of any shape. A new model is a line here and a file of traits in
/// models/: opening, the C interface, packing, the tools, and the tests of all models take it from here.
///
/// A plane of tiles is a line for each form of its tiles. A plane of tiles of several models holds them as a variant over a list of
/// these models, and visits the variant once in each question, after it has chosen the tile: its models do not multiply it.
using AssetModels = NdfModelList<Reference, AnisotropicNdf<PyramidNdf>, AnisotropicNdf<CpNdf>, BinMapNdf, HistogramNdf,
                                 MomentsNdf, TinyExampleNdf, WangReference, WangPlane<PyramidTiles>, WangPlane<CompressedTiles>,
                                 AnisotropicNdf<WaveNdf>, AnisotropicNdf<WaveCpNdf>>;

/// These models, and that of a UDIM set, which is several assets. forEach visits the models of assets only.
struct NdfModels : AssetModels {
  using Variant = ExtendedVariant<AssetModels::Variant, UdimNdf>;
  using Any = OneOfNdfs<NdfModels>;
};

/// Compiled once, in any_ndf.cpp: the models are large.
extern template class OneOfNdfs<NdfModels>;

}  // namespace glint::api
