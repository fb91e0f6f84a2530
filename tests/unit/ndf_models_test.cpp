// The list of models and their traits.

#include "glint/api/ndf_models.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

#include "glint/api/alternatives.h"
#include "glint/api/any_ndf.h"
#include "glint/bake/common/slopes.h"
#include "glint/query/reference.h"
#include "support/c_api.h"

namespace glint::ndf_models_test {
namespace {

/// A model of colours, as a model of waves has them.
struct ToyColours {
  Rgb density(const Footprint&, Vec2) const { return {1, 2, 3}; }
  Rgb mean(const Footprint&, const Box2&) const { return {1, 2, 3}; }
  HalfVectorSample sample(const Footprint&, Vec2) const { return {}; }
};

/// A model whose mean is of another type than its density.
struct ToyMixed : ToyColours {
  float mean(const Footprint&, const Box2&) const { return 0; }
};

/// A plane of two tiles that may be of several models: the models of its tiles do not multiply it.
struct ToyPlane {
  using Tile = std::variant<Reference, BinMapNdf>;
  float density(const Footprint& p, Vec2 h) const {
    return std::visit([&](const auto& tile) { return tile.density(p, h); }, tileOf(p));
  }
  float mean(const Footprint& p, const Box2& range) const {
    return std::visit([&](const auto& tile) { return tile.mean(p, range); }, tileOf(p));
  }
  HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    return std::visit([&](const auto& tile) { return tile.sample(p, xi); }, tileOf(p));
  }
  const Tile& tileOf(const Footprint& p) const { return tiles[p.centre.x < 0.5f ? 0 : 1]; }
  Tile tiles[2];
};
struct ToyPlaneAsset {
  NormalMap left;
  BinMap right;
};

struct ToyWithoutTraits : ToyColours {};

}  // namespace
}  // namespace glint::ndf_models_test

namespace glint::api {

using ndf_models_test::ToyColours, ndf_models_test::ToyMixed, ndf_models_test::ToyPlane, ndf_models_test::ToyPlaneAsset;

template <>
struct NdfTraits<ToyColours> {
  using Asset = NormalMap;
  static constexpr std::string_view kKind = "toy-colours";
  static ToyColours open(const NdfSource<NormalMap>&) { return {}; }
  static NdfInfo info(const NdfSource<NormalMap>&) { return {}; }
  static MapSlopes slopes(const NormalMap&) { return {}; }
  static constexpr bool kPacks = false;
};

/// Says that it has a packed form, and has none.
template <>
struct NdfTraits<ToyMixed> : NdfTraits<ToyColours> {
  static ToyMixed open(const NdfSource<NormalMap>&) { return {}; }
  static constexpr bool kPacks = true;
};

template <>
struct NdfTraits<ToyPlane> {
  using Asset = ToyPlaneAsset;
  static constexpr std::string_view kKind = "toy-plane";
  static ToyPlane open(const NdfSource<ToyPlaneAsset>& source) {
    return {{NdfTraits<Reference>::open({source.asset.left, source.options}),
             NdfTraits<BinMapNdf>::open({source.asset.right, source.options})}};
  }
  static NdfInfo info(const NdfSource<ToyPlaneAsset>& source) {
    return NdfTraits<Reference>::info({source.asset.left, source.options});
  }
  static MapSlopes slopes(const ToyPlaneAsset& asset) { return asset.right.slopes; }
  static constexpr bool kPacks = false;
};

}  // namespace glint::api

namespace glint::ndf_models_test {
namespace {

static_assert(NdfModel<ToyColours> && std::same_as<NdfValueOf<ToyColours>, Rgb>);
static_assert(std::same_as<NdfValueOf<Reference>, float>);
static_assert(!NdfModel<ToyMixed>, "density and mean have one type");
static_assert(api::DescribedNdf<ToyColours> && api::DescribedNdf<ToyPlane>);
static_assert(!api::DescribedNdf<ToyWithoutTraits> && !api::DescribedNdf<ToyMixed>);

TEST(NdfModels, OfTilesAreOneModelThatOpensEachTileByItsTraits) {
  const auto normals = test::sampleNormals(test::kSize, test::kSize);
  const auto bins = test::sampleBinMap(test::kSize, test::kSize);
  const ToyPlaneAsset asset = {normals.map, bins.map};
  api::NdfOptions options;
  options.sigma_r = 0.05f;
  const api::NdfModelList<Reference, ToyPlane>::Any any = api::NdfTraits<ToyPlane>::open({asset, options});
  const auto ask = [&](float u) {
    const Footprint p = Footprint::isotropic({u, 0.5f}, 9);
    return std::visit([&](const auto& model) { return model.density(p, {0.1f, 0}); }, any);
  };
  const Reference left(normals.map, 0.05f);
  EXPECT_NEAR(ask(0.2f), left.density(Footprint::isotropic({0.2f, 0.5f}, 9), {0.1f, 0}), 1e-5f * ask(0.2f));
  EXPECT_EQ(ask(0.7f), BinMapNdf(bins.map).density(Footprint::isotropic({0.7f, 0.5f}, 9), {0.1f, 0}));
}

TEST(NdfModels, HaveAKindEach) {
  std::vector<std::string> kinds(test::kKinds.begin(), test::kKinds.end());
  for (const std::string& kind : kinds) EXPECT_TRUE(api::answersNdf(kind));
  EXPECT_FALSE(api::answersNdf("heights"));
  std::sort(kinds.begin(), kinds.end());
  EXPECT_EQ(std::adjacent_find(kinds.begin(), kinds.end()), kinds.end());
  EXPECT_EQ(api::ndfKinds().size(), kinds.size());
  EXPECT_EQ(api::alternatives({"one"}), "one");
  EXPECT_EQ(api::alternatives({"one", "two", "three"}), "one, two or three");
}

template <class... Models>
::testing::Types<Models...> typesOf(api::NdfModelList<Models...>);
using AllModels = decltype(typesOf(api::NdfModels{}));

/// A model of a small asset.
template <class Model>
class EveryNdfModel : public ::testing::Test {
 protected:
  static constexpr std::string_view kKind = api::NdfTraits<Model>::kKind;
  const api::OpenedNdf opened = api::OpenedNdf::open(test::assets().path(std::string(kKind)));
  const Model& model() const { return std::get<Model>(opened.model()); }
};

struct KindName {
  template <class Model>
  static std::string GetName(int) {
    std::string name(api::NdfTraits<Model>::kKind);
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
  }
};
TYPED_TEST_SUITE(EveryNdfModel, AllModels, KindName);

TYPED_TEST(EveryNdfModel, IsOpenedFromItsKind) {
  EXPECT_EQ(this->opened.asset().kind(), this->kKind);
  ASSERT_TRUE(std::holds_alternative<TypeParam>(this->opened.model()));
  const api::NdfInfo& info = this->opened.info();
  // Sizes of images of tiles are those of a tile.
  const bool tiles = this->kKind == "wang-pyramid" || this->kKind == "wang-cp";
  EXPECT_EQ(info.width, tiles ? WangTiles::kLeastSize : test::kSize);
  EXPECT_EQ(info.height, info.width);
  EXPECT_TRUE(info.resolution == 64 || info.resolution == api::kDefaultResolution);
  EXPECT_TRUE(info.shapes.gaussians || info.shapes.boxes);
  EXPECT_EQ(info.level_count > 0, info.finest_sigma_texels > 0);
  EXPECT_LE(info.finest_sigma_texels, info.coarsest_sigma_texels);
}

/// A shape that a model does not answer as it is counts as the other one of the same second moments.
TYPED_TEST(EveryNdfModel, AnswersTheShapesThatItsInfoSays) {
  constexpr float kRounding = 1e-4f, kSeen = 1e-2f;
  const float sigma = 12, half_side = std::sqrt(3.0f) * sigma;
  double difference = 0, sum = 0;
  for (int k = 0; k < 20; ++k) {
    const Vec2 uv = {0.05f * static_cast<float>(k), 0.3f}, h = {0.02f * static_cast<float>(k) - 0.2f, 0.05f};
    const float gaussian = this->model().density(Footprint::isotropic(uv, sigma), h);
    const float box = this->model().density(Footprint::box(uv, {half_side, 0}, {0, half_side}), h);
    difference += std::fabs(gaussian - box);
    sum += gaussian;
  }
  ASSERT_GT(sum, 0);
  const api::FootprintShapes shapes = this->opened.info().shapes;
  if (shapes.gaussians && shapes.boxes)
    EXPECT_GT(difference / sum, kSeen);
  else
    EXPECT_LT(difference / sum, kRounding);
}

TYPED_TEST(EveryNdfModel, HasTheSlopesOfItsAsset) {
  // The builders sum slopes on several threads and with other instructions: rounding of floats.
  constexpr float kSlopeError = 2e-6f;
  const MapSlopes slopes = this->opened.slopes();
  if constexpr (std::is_same_v<TypeParam, Reference>) {
    const MapSlopes built = bake::mapSlopes(this->opened.asset().template get<NormalMap>());
    EXPECT_NEAR(slopes.mean.x, built.mean.x, kSlopeError);
    EXPECT_NEAR(slopes.covariance.xx, built.covariance.xx, kSlopeError);
    EXPECT_NEAR(slopes.covariance.xy, built.covariance.xy, kSlopeError);
  }
  EXPECT_GE(slopes.covariance.xx, 0);
  EXPECT_GE(slopes.covariance.yy, 0);
}

}  // namespace
}  // namespace glint::ndf_models_test
