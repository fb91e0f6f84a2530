#include "glint-merge/shards.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <memory_resource>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/input_asset.h"
#include "common/texel_checks.h"
#include "glint/bake/ingest/near_normals.h"
#include "glint/bake/pyramid/join.h"
#include "glint/formats/hash.h"
#include "glint/formats/streamed_writer.h"

namespace glint::apps {
namespace {

using nlohmann::json;

formats::Asset openShard(const Tool& tool, const std::string& path) {
  // A mapped file counts as memory as far as it was read, so the checks have a map of their own, which is given back.
  formats::OpenOptions checks = inputChecks(tool);
  checks.hash_in_pieces = true;
  formats::Asset checked = formats::Asset::open(path, checks);
  if (checked.kind() == "ndf-pyramid")
    throw Error(ErrorCode::unsupported, "merge.kind", path, "", "is a whole pyramid, no shard",
                "give only the outputs of glint-pyramid --region");
  if (checked.kind() != "ndf-pyramid-shard")
    throw Error(ErrorCode::unsupported, "merge.kind", path, "",
                "is of kind " + std::string(checked.kind()) + ", not ndf-pyramid-shard",
                "give only the outputs of glint-pyramid --region");
  if (tool.trust()) requireTexels(checked, path);
  return formats::Asset::open(path);
}

json commandOf(const std::string& text) {
  json command = json::parse(text, nullptr, false);
  return command.is_object() ? command : json::object();
}

/// The record of the run without its region.
formats::Provenance recordOf(const formats::Asset& asset) {
  formats::Provenance record = asset.info().provenance;
  json command = commandOf(record.command_json);
  command.erase("region");
  record.command_json = command.dump(-1, ' ', true, json::error_handler_t::replace);
  return record;
}

/// "--sigma-r is 0.01, not 0.005": the first parameter in which two runs differ.
std::string firstDifference(const std::string& text, const std::string& of_first) {
  const json command = commandOf(text), first = commandOf(of_first);
  for (const auto& [key, value] : first.items()) {
    const auto found = command.find(key);
    if (found == command.end()) return "--" + key + " is not given";
    if (*found != value) return fmt::format("--{} is {}, not {}", key, found->dump(), value.dump());
  }
  return "it has more parameters";
}

/// Whether both pyramids keep normals of the same type, or none.
bool keepSame(const NdfPyramidShard& a, const NdfPyramidShard& b) {
  return a.near_normals.has_value() == b.near_normals.has_value() &&
         (!a.near_normals || a.near_normals->type == b.near_normals->type);
}

/// Whether all but the arrays are the same.
bool sameShape(const NdfPyramid& a, const NdfPyramid& b) {
  const PyramidShape &s = a.shape, &t = b.shape;
  const auto same_grid = [](const PyramidGrid& g, const PyramidGrid& h) {
    return g.stride == h.stride && g.columns == h.columns && g.rows == h.rows;
  };
  const auto same_slopes = [](const MapSlopes& m, const MapSlopes& n) {
    return m.mean.x == n.mean.x && m.mean.y == n.mean.y && m.covariance.xx == n.covariance.xx &&
           m.covariance.xy == n.covariance.xy && m.covariance.yy == n.covariance.yy;
  };
  return a.precision == b.precision && a.value_scale == b.value_scale && s.width == t.width && s.height == t.height &&
         s.resolution == t.resolution && s.sigma_r == t.sigma_r && s.surface == t.surface && s.boundary == t.boundary &&
         s.overlap == t.overlap && s.level_count == t.level_count && same_slopes(s.slopes, t.slopes) &&
         std::equal(s.levels, s.levels + s.level_count, t.levels, same_grid);
}

[[noreturn]] void refuseDifferent(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::invalid_input, "merge.different", path, "", what,
              "make all shards by runs that differ in --region only");
}

}  // namespace

Shards::Shards(const Tool& tool, const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    formats::Asset asset = openShard(tool, path);
    formats::Provenance record = recordOf(asset);
    files_.push_back({path, std::move(asset), std::move(record)});
  }
  const auto regionOf = [](const File& file) { return file.asset.get<NdfPyramidShard>().region; };
  for (const File& file : files_) requireSameRun(file, files_.front());
  std::stable_sort(files_.begin(), files_.end(),
                   [&](const File& a, const File& b) { return regionOf(a).index < regionOf(b).index; });
  for (const File& file : files_) views_.push_back(file.asset.get<NdfPyramidShard>());
  requireAllRegions();
  record_ = files_.front().record;
}

void Shards::requireSameRun(const File& file, const File& first) {
  const auto &shard = file.asset.get<NdfPyramidShard>(), &other = first.asset.get<NdfPyramidShard>();
  const formats::Provenance &run = file.record, &first_run = first.record;
  if (shard.region.count != other.region.count)
    refuseDifferent(file.path, fmt::format("is one of {} regions, and {} is one of {}", shard.region.count, first.path,
                                           other.region.count));
  if (run.generator != first_run.generator)
    refuseDifferent(file.path, fmt::format("was made by {}, and {} by {}", run.generator, first.path, first_run.generator));
  if (run.inputs != first_run.inputs)
    refuseDifferent(file.path,
                    fmt::format("was made of another map than {}, by the names and hashes of their inputs", first.path));
  if (run.command_json != first_run.command_json)
    refuseDifferent(file.path, fmt::format("was made with other parameters than {}: {}", first.path,
                                           firstDifference(run.command_json, first_run.command_json)));
  if (shard.level_choice != other.level_choice || !sameShape(shard.images, other.images) || !keepSame(shard, other))
    refuseDifferent(file.path, fmt::format("holds images of a pyramid of another shape than {}", first.path));
}

void Shards::requireAllRegions() const {
  const int count = views_.front().region.count;
  for (std::size_t k = 1; k < views_.size(); ++k) {
    if (views_[k].region.index == views_[k - 1].region.index)
      throw Error(ErrorCode::usage, "merge.double", files_[k].path, "",
                  fmt::format("is region {}/{}, as {} is", views_[k].region.index, count, files_[k - 1].path),
                  "give one shard of each region");
  }
  for (int index = 1; index <= count; ++index) {
    if (index <= static_cast<int>(views_.size()) && views_[static_cast<std::size_t>(index - 1)].region.index == index) continue;
    const int missing = count - static_cast<int>(views_.size());
    throw Error(ErrorCode::usage, "merge.missing", files_.front().path, "",
                missing == 1 ? fmt::format("belongs to {} regions, of which {}/{} is missing", count, index, count)
                             : fmt::format("belongs to {} regions, of which {} are missing, {}/{} the first", count, missing,
                                           index, count),
                fmt::format("make it with glint-pyramid --region {}/{}, and give all shards", index, count));
  }
}

namespace {

/// The bytes of an array of all shards, one after the other, read from their files.
/// @param object  path of the array, such as "/level_00/masks"
formats::ByteSource joinedArray(const Shards& shards, const std::string& object) {
  struct Piece {
    std::string path, hash;
    std::uint64_t offset, size_bytes;
  };
  std::vector<Piece> pieces;
  for (std::size_t k = 0; k < shards.views().size(); ++k) {
    const std::vector<formats::DatasetInfo>& datasets = shards.info(k).datasets;
    const auto found = std::find_if(datasets.begin(), datasets.end(), [&](const auto& d) { return d.path == object; });
    if (found->size_bytes > 0) pieces.push_back({shards.path(k), found->hash_hex, found->offset, found->size_bytes});
  }
  return [pieces, object](const formats::ByteSink& sink) {
    for (const Piece& piece : pieces) {
      formats::ByteHasher hasher;
      formats::readInPieces(piece.path, piece.offset, piece.size_bytes, [&](std::span<const std::byte> bytes) {
        hasher.add(bytes.data(), bytes.size());
        sink(bytes);
      });
      if (hasher.hash() != piece.hash)
        throw Error(ErrorCode::invalid_input, "dataset.hash", piece.path, object,
                    "has other bytes than its hash says, or has changed while shards were joined", "make the shard again");
    }
  };
}

/// The normals that the pyramid keeps, from those of all shards; nothing where they keep none.
std::optional<bake::NearNormalsData> joinedNormals(const Shards& shards, const PyramidShape& shape) {
  const std::optional<ShardNormals>& first = shards.views().front().near_normals;
  if (!first) return {};
  std::pmr::vector<Vec2> normals(rowMajorIndex(0, shape.height, shape.width));
  std::byte* to = std::as_writable_bytes(std::span(normals)).data();
  joinedArray(shards, "/near/normals")([&](std::span<const std::byte> bytes) {
    std::memcpy(to, bytes.data(), bytes.size());  // the rows of all regions are those of the map
    to += bytes.size();
  });
  NearNormals near;
  near.width = shape.width;
  near.height = shape.height;
  near.texels = normals.data();
  return bake::keepNormals(near, first->type);
}

}  // namespace

JoinedPyramid writeJoined(const Shards& shards, const OutputFile& output) {
  const std::vector<NdfPyramidShard>& views = shards.views();
  NdfPyramid pyramid;
  pyramid.shape = bake::joinedShape(views);
  pyramid.precision = views.front().images.precision;
  pyramid.value_scale = views.front().images.value_scale;
  std::vector<std::pmr::vector<std::uint32_t>> ranks(static_cast<std::size_t>(pyramid.shape.level_count));
  formats::ByteSources sources;
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    const int from = bake::levelInShards(views.front(), pyramid.shape, l);
    std::pmr::vector<std::uint32_t>& level_ranks = ranks[static_cast<std::size_t>(l)];
    level_ranks = bake::joinedRanks(views, from);
    const std::size_t blocks = level_ranks.back();
    pyramid.levels[l] = {formats::spanOfSize<std::uint64_t>(level_ranks.size() - 1), level_ranks,
                         formats::spanOfSize<float>(blocks), formats::spanOfSize<float>(1).data()};
    for (const char* name : {"masks", "block_means", "pixels"})
      sources[fmt::format("/level_{:02}/{}", l, name)] = joinedArray(shards, fmt::format("/level_{:02}/{}", from, name));
  }
  const std::optional<bake::NearNormalsData> kept = joinedNormals(shards, pyramid.shape);
  if (kept) pyramid.near_normals = kept->view();
  formats::writeStreamedAsset(output.path(), pyramid, shards.record(), sources, output.writeOptions());
  return {pyramid.shape, kept ? bake::nearBytes(kept->view()) : 0};
}

}  // namespace glint::apps
