#pragma once

#include <nanobind/nanobind.h>
#include <tbb/global_control.h>

#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/hash.h"

namespace glint::python {

namespace nb = nanobind;

/// Where a builder writes, what it records of itself, and whom it tells how far it is.
struct BuildJob {
  std::string output;        ///< file that is made; none of this name exists
  std::string command_json;  ///< every parameter that changed the result
  std::string input;         ///< asset that is read; empty: an array
  std::string input_name;    ///< name of the input in the record
  std::string array_hash;    ///< of an array
  int threads = 0;           ///< 0: as many as the processor has
  nb::object progress;       ///< callable (done, total), or None
};

/// The value of a word, or an Error that lists the words.
template <class E>
E choose(const char* option, const std::string& word, std::initializer_list<std::pair<const char*, E>> words) {
  std::string known;
  for (const auto& [name, value] : words) {
    if (word == name) return value;
    known += (known.empty() ? "" : ", ") + std::string(name);
  }
  throw Error(ErrorCode::usage, "api.arguments", "", option, "\"" + word + "\" is not known", "give one of: " + known);
}

/// Calls a Python function from whichever thread a builder works on. The first exception of the function ends the calls, and is
/// thrown again when the builder is done.
class PythonProgress {
 public:
  explicit PythonProgress(const nb::object& function) : function_(function) {}

  bake::ProgressFn callback() {
    if (function_.is_none()) return {};
    return [this](std::size_t done, std::size_t total) {
      const nb::gil_scoped_acquire python;
      if (failure_) return;
      try {
        function_(done, total);
      } catch (nb::python_error& error) {
        failure_.emplace(std::move(error));
      }
    };
  }

  /// Call with the interpreter's lock.
  void rethrow() {
    if (failure_) throw nb::python_error(std::move(*failure_));
  }

 private:
  nb::object function_;
  std::optional<nb::python_error> failure_;
};

/// Work of the library without the interpreter's lock.
template <class Work>
auto unlocked(Work&& work) {
  const nb::gil_scoped_release others_may_run;
  return work();
}

/// The asset that a builder reads, with hashes and values checked.
inline formats::Asset openInput(const BuildJob& job) {
  return unlocked([&] {
    formats::Asset asset = formats::Asset::openForBuilding(job.input);
    if (asset.info().udim)
      throw Error(ErrorCode::unsupported, "udim.unsupported", job.input, "",
                  "is a tile of a UDIM set, with margins of its neighbours, which builders in Python do not take",
                  "build sets with the tools, such as glint-pyramid 'name.<UDIM>.map.glint' -o 'name.<UDIM>.p.glint'");
    return asset;
  });
}

inline formats::Provenance provenanceOf(const BuildJob& job) {
  formats::Provenance p;
  p.generator = "glint-ndf " GLINT_VERSION;
  p.command_json = job.command_json;
  if (!job.input_name.empty())
    p.inputs.push_back(
        {job.input_name, job.input.empty() ? job.array_hash : unlocked([&] { return formats::hashFile(job.input); })});
  return p;
}

/// Runs a builder without the interpreter's lock: build(progress) makes the data, whose view() is written.
template <class Build>
void run(const BuildJob& job, const formats::Provenance& provenance, Build&& build) {
  PythonProgress progress(job.progress);
  {
    const nb::gil_scoped_release others_may_run;
    std::optional<tbb::global_control> limit;
    if (job.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(job.threads));
    const auto made = build(progress.callback());
    formats::writeAsset(job.output, made.view(), provenance);
  }
  progress.rethrow();
}

}  // namespace glint::python
