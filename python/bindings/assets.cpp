#include "assets.h"

#include <nanobind/stl/string.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "glint-info/summary.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/atomic_file.h"
#include "glint/formats/validate.h"

namespace glint::python {
namespace {

namespace nb = nanobind;

/// The result of `glint-info --json`, as text.
std::string summary(const std::string& path) {
  const nb::gil_scoped_release others_may_run;
  return apps::summarize(formats::Asset::open(path)).dump();
}

nb::tuple validate(const std::string& path, bool hashes, bool data) {
  formats::ValidationReport report;
  {
    const nb::gil_scoped_release others_may_run;
    report = formats::validateAsset(path, {hashes, data});
  }
  nb::list findings;
  for (const formats::Finding& f : report.findings)
    findings.append(nb::make_tuple(f.rule, std::string(formats::name(f.severity)), f.object, f.message, f.remedy));
  return nb::make_tuple(report.kind, findings);
}

std::string kindOf(const std::string& path) {
  const nb::gil_scoped_release others_may_run;
  return std::string(formats::Asset::open(path).kind());
}

/// Copies a file, which appears whole or not at all.
void copyFile(const std::string& from, const std::string& to, bool overwrite) {
  const nb::gil_scoped_release others_may_run;
  formats::AtomicFile target(to);
  std::ifstream source(from, std::ios::binary);
  std::vector<char> part(std::size_t{1} << 20);
  std::uint64_t offset = 0;
  while (source.read(part.data(), static_cast<std::streamsize>(part.size())), source.gcount() > 0) {
    target.write(part.data(), static_cast<std::uint64_t>(source.gcount()), offset);
    offset += static_cast<std::uint64_t>(source.gcount());
  }
  if (!source.eof()) throw Error(ErrorCode::io, "", from, "", "cannot be read");
  target.publish(overwrite);
}

}  // namespace

void bindAssets(nb::module_& m) {
  m.def("summary", &summary);
  m.def("validate", &validate);
  m.def("kind_of", &kindOf);
  m.def("copy_file", &copyFile);
  m.def("version", [] { return std::string(GLINT_VERSION); });
}

}  // namespace glint::python
