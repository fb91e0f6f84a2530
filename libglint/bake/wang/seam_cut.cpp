#include "glint/bake/wang/seam_cut.h"

#include <array>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/property_map/property_map.hpp>
#include <cmath>
#include <cstddef>
#include <utility>

namespace glint::bake {
namespace {

using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, boost::no_property, boost::no_property,
                                                 std::uint32_t, std::uint32_t>;
using Vertex = boost::graph_traits<Graph>::vertex_descriptor;
using Edge = boost::graph_traits<Graph>::edge_descriptor;
using Cost = std::int64_t;  // the library sums the cost of a whole seam in it

constexpr float kCostScale = 65536;  // a difference of 1 of normals; differences below 2^-16 count alike
constexpr Cost kShortSeam = 1;       // of each pair, so that seams are short where images agree
constexpr std::int32_t kNoNode = -1;

/// Right, up, left, down.
constexpr int kSteps[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};

/// The graph of the free texels of a problem. Texels whose side is given are merged into the source (first) and the sink
/// (second). Edges are sorted by their first vertex, as the compressed graph stores them.
class SeamGraph {
 public:
  explicit SeamGraph(const SeamProblem& problem) : problem_(problem) {
    numberNodes();
    addEdges();
  }

  int nodeCount() const { return node_count_; }
  std::int32_t nodeOf(std::size_t texel) const { return nodes_[texel]; }

  /// Whether each node is on the side of the source in the minimum cut.
  std::vector<bool> cut();

 private:
  void numberNodes() {
    nodes_.assign(problem_.sides.size(), kNoNode);
    for (std::size_t k = 0; k < nodes_.size(); ++k)
      if (problem_.sides[k] == SeamSide::free) {
        nodes_[k] = node_count_++;
        texels_.push_back(k);
      }
  }

  /// Index of a neighbour, or the number of texels where there is none.
  std::size_t neighbour(std::size_t texel, int direction) const {
    const int x = static_cast<int>(texel % static_cast<std::size_t>(problem_.width)) + kSteps[direction][0];
    const int y = static_cast<int>(texel / static_cast<std::size_t>(problem_.width)) + kSteps[direction][1];
    if (x < 0 || y < 0 || x >= problem_.width || y >= problem_.height) return nodes_.size();
    return rowMajorIndex(x, y, problem_.width);
  }

  Cost costOf(std::size_t p, std::size_t q) const {
    const float difference = seamDifference(problem_.first[p], problem_.second[p], problem_.first[q], problem_.second[q]);
    return static_cast<Cost>(std::lround(kCostScale * difference)) + kShortSeam;
  }

  void addEdges();

  const SeamProblem& problem_;
  std::vector<std::int32_t> nodes_;  // of texels
  std::vector<std::size_t> texels_;  // of nodes
  std::vector<std::pair<Vertex, Vertex>> edges_;
  std::vector<Cost> capacities_;
  std::vector<std::uint32_t> reverses_;  // index of the reverse of each edge
  int node_count_ = 0;
};

void SeamGraph::addEdges() {
  const auto source = static_cast<Vertex>(node_count_), sink = source + 1;
  std::vector<Cost> to_first(texels_.size()), to_second(texels_.size());
  std::vector<std::array<std::uint32_t, 6>> index(texels_.size());  // of the edges to four neighbours, source and sink
  for (std::size_t node = 0; node < texels_.size(); ++node) {
    const auto add = [&](Vertex to, Cost cost, int slot) {
      index[node][static_cast<std::size_t>(slot)] = static_cast<std::uint32_t>(edges_.size());
      edges_.emplace_back(static_cast<Vertex>(node), to);
      capacities_.push_back(cost);
    };
    for (int d = 0; d < 4; ++d) {
      const std::size_t there = neighbour(texels_[node], d);
      if (there == nodes_.size() || problem_.sides[there] == SeamSide::none) continue;
      const Cost cost = costOf(texels_[node], there);
      if (problem_.sides[there] == SeamSide::first) to_first[node] += cost;
      if (problem_.sides[there] == SeamSide::second) to_second[node] += cost;
      if (nodes_[there] != kNoNode) add(static_cast<Vertex>(nodes_[there]), cost, d);
    }
    if (to_first[node] > 0) add(source, 0, 4);
    if (to_second[node] > 0) add(sink, to_second[node], 5);
  }
  // Edges of the source, and the reverse edges of the sink.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> terminal_pairs;
  const auto addFrom = [&](Vertex terminal, const std::vector<Cost>& costs, std::size_t slot, bool forward) {
    for (std::size_t node = 0; node < texels_.size(); ++node) {
      if (costs[node] == 0) continue;
      terminal_pairs.emplace_back(index[node][slot], static_cast<std::uint32_t>(edges_.size()));
      edges_.emplace_back(terminal, static_cast<Vertex>(node));
      capacities_.push_back(forward ? costs[node] : 0);
    }
  };
  addFrom(source, to_first, 4, true);
  addFrom(sink, to_second, 5, false);
  reverses_.resize(edges_.size());
  for (const auto& [a, b] : terminal_pairs) reverses_[a] = b, reverses_[b] = a;
  for (std::size_t node = 0; node < texels_.size(); ++node)
    for (int d = 0; d < 4; ++d) {
      const std::size_t there = neighbour(texels_[node], d);
      if (there == nodes_.size() || nodes_[there] == kNoNode) continue;
      const auto opposite = static_cast<std::size_t>((d + 2) % 4);
      reverses_[index[node][static_cast<std::size_t>(d)]] = index[static_cast<std::size_t>(nodes_[there])][opposite];
    }
}

std::vector<bool> SeamGraph::cut() {
  const auto source = static_cast<Vertex>(node_count_), sink = source + 1;
  const std::size_t vertex_count = std::size_t{sink} + 1;
  const Graph graph(boost::edges_are_sorted, edges_.begin(), edges_.end(), static_cast<std::uint32_t>(vertex_count));
  std::vector<Edge> reverses;
  reverses.reserve(edges_.size());
  for (const std::uint32_t r : reverses_) reverses.emplace_back(edges_[r].first, r);
  std::vector<Cost> residual(edges_.size());
  std::vector<Edge> predecessor(vertex_count);
  std::vector<boost::default_color_type> color(vertex_count);
  std::vector<std::int32_t> distance(vertex_count);
  const auto by_edge = get(boost::edge_index, graph);
  const auto by_vertex = get(boost::vertex_index, graph);
  const auto of = [](auto& values, const auto& by) { return boost::make_iterator_property_map(values.begin(), by); };
  boost::boykov_kolmogorov_max_flow(graph, of(capacities_, by_edge), of(residual, by_edge), of(reverses, by_edge),
                                    of(predecessor, by_vertex), of(color, by_vertex), of(distance, by_vertex), by_vertex,
                                    source, sink);
  std::vector<bool> on_first(texels_.size());
  for (std::size_t node = 0; node < texels_.size(); ++node) on_first[node] = color[node] == color[source];
  return on_first;
}

}  // namespace

float seamDifference(Vec2 first_here, Vec2 second_here, Vec2 first_there, Vec2 second_there) {
  const Vec2 here = first_here - second_here, there = first_there - second_there;
  return std::sqrt(dot(here, here)) + std::sqrt(dot(there, there));
}

std::vector<SeamSide> cutSeam(const SeamProblem& problem) {
  std::vector<SeamSide> sides(problem.sides.begin(), problem.sides.end());
  SeamGraph graph(problem);
  if (graph.nodeCount() == 0) return sides;
  const std::vector<bool> on_first = graph.cut();
  for (std::size_t k = 0; k < sides.size(); ++k)
    if (const std::int32_t node = graph.nodeOf(k); node != kNoNode)
      sides[k] = on_first[static_cast<std::size_t>(node)] ? SeamSide::first : SeamSide::second;
  return sides;
}

}  // namespace glint::bake
