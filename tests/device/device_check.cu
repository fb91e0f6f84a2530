// Asks an asset on the GPU and on the host, and compares: glint-device-check ASSET [NORMALS]. Exit code 77: there is no GPU.

#include <cuda_runtime.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <random>
#include <string>
#include <variant>
#include <vector>

#include "device/kernels.h"
#include "glint/api/pack.h"

namespace {

using namespace glint;

constexpr int kQueries = 1'000'000;
constexpr int kThreads = 256;
/// Of the largest answer: GPUs contract products and sums, and have an exponential of their own.
constexpr double kTolerance = 1e-5;
constexpr float kReach = 0.05f;
constexpr int kNoGpu = 77;

void require(cudaError_t status, const char* what) {
  if (status != cudaSuccess) throw Error(ErrorCode::failed, "", "", what, cudaGetErrorString(status));
}

/// An array on the device.
template <class T>
class DeviceArray {
 public:
  explicit DeviceArray(std::size_t count) : count_(count) { require(cudaMalloc(&data_, count * sizeof(T)), "cudaMalloc"); }
  explicit DeviceArray(const std::vector<T>& values) : DeviceArray(values.size()) {
    require(cudaMemcpy(data_, values.data(), count_ * sizeof(T), cudaMemcpyHostToDevice), "upload");
  }
  ~DeviceArray() { cudaFree(data_); }
  DeviceArray(const DeviceArray&) = delete;
  DeviceArray& operator=(const DeviceArray&) = delete;

  T* data() const { return static_cast<T*>(data_); }
  std::vector<T> download() const {
    std::vector<T> values(count_);
    require(cudaMemcpy(values.data(), data_, count_ * sizeof(T), cudaMemcpyDeviceToHost), "download");
    return values;
  }

 private:
  void* data_ = nullptr;
  std::size_t count_;
};

struct Queries {
  std::vector<Footprint> footprints;
  std::vector<Vec2> halves;
};

/// Footprints that the asset has levels for, or of a few texels; half vectors where normals are.
Queries randomQueries(const api::NdfInfo& info) {
  std::mt19937 random(1);
  const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
  const float finest = info.level_count > 0 ? info.finest_sigma_texels : 1, octaves = info.level_count > 0 ? 4 : 2;
  Queries q;
  for (int k = 0; k < kQueries; ++k) {
    const float u = unit(), v = unit(), sigma = finest * std::exp2(octaves * unit());
    q.footprints.push_back(Footprint::isotropic({u, v}, sigma));
    const float x = unit() + unit() - 1, y = unit() + unit() - 1;
    q.halves.push_back({0.5f * x, 0.5f * y});
  }
  return q;
}

/// Largest difference, relative to the largest answer.
double difference(const std::vector<float>& device, const std::vector<float>& host) {
  double largest = 0, worst = 0;
  for (std::size_t k = 0; k < host.size(); ++k) {
    largest = std::max(largest, static_cast<double>(host[k]));
    worst = std::max(worst, std::fabs(static_cast<double>(device[k]) - host[k]));
  }
  return largest > 0 ? worst / largest : 1;
}

template <class Model>
bool compare(const Model& host_model, const Model& device_model, const void* buffer, const Queries& q) {
  const DeviceArray<Footprint> footprints(q.footprints);
  const DeviceArray<Vec2> halves(q.halves);
  const DeviceArray<float> densities(q.halves.size()), means(q.halves.size()), packed(q.halves.size());
  const int blocks = (kQueries + kThreads - 1) / kThreads;
  device::answer<<<blocks, kThreads>>>(device_model, footprints.data(), halves.data(), kReach, kQueries, densities.data(),
                                       means.data());
  require(cudaGetLastError(), "launch");
  device::answerPacked<<<blocks, kThreads>>>(buffer, footprints.data(), halves.data(), kQueries, packed.data());
  require(cudaGetLastError(), "launch");
  require(cudaDeviceSynchronize(), "answer");
  std::vector<float> expected, expected_means;
  for (int k = 0; k < kQueries; ++k) {
    const Vec2 h = q.halves[k];
    expected.push_back(host_model.density(q.footprints[k], h));
    expected_means.push_back(host_model.mean(q.footprints[k], {h - Vec2{kReach, kReach}, h + Vec2{kReach, kReach}}));
  }
  const double density = difference(densities.download(), expected), mean = difference(means.download(), expected_means),
               by_itself = difference(packed.download(), expected);
  std::printf("%d queries: density differs by %.2g, mean by %.2g, density of models made on the device by %.2g\n", kQueries,
              density, mean, by_itself);
  return density <= kTolerance && mean <= kTolerance && by_itself <= kTolerance;
}

bool check(const std::string& path, const std::string& normals) {
  api::NdfOptions options;
  options.normals = normals;
  options.sigma_r = 0.05f;
  const auto opened = api::OpenedNdf::open(path, options);
  const std::vector<std::byte> buffer = api::pack(opened);
  const DeviceArray<std::byte> uploaded(buffer);
  const Queries q = randomQueries(opened.info());
  // The header is read here, and the arrays are where the device sees them.
  const PackedNdfView here(buffer.data()), there(*reinterpret_cast<const PackedHeader*>(buffer.data()), uploaded.data());
  switch (here.kind()) {
    case PackedKind::pyramid:
      return compare(here.pyramidNdf(), there.pyramidNdf(), uploaded.data(), q);
    case PackedKind::compressed:
      return compare(here.cpNdf(), there.cpNdf(), uploaded.data(), q);
    default:
      return compare(here.reference(), there.reference(), uploaded.data(), q);
  }
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: glint-device-check ASSET [NORMALS]\n");
    return 1;
  }
  int devices = 0;
  if (cudaGetDeviceCount(&devices) != cudaSuccess || devices == 0) {
    std::fprintf(stderr, "there is no GPU\n");
    return kNoGpu;
  }
  return check(argv[1], argc > 2 ? argv[2] : "") ? 0 : static_cast<int>(ErrorCode::differs);
} catch (const std::exception& error) {
  std::fprintf(stderr, "glint-device-check: error: %s\n", error.what());
  return 4;
}
