// Opens arbitrary bytes as an asset and follows every index of what opens. Anything but a clean refusal or a valid asset is a
// defect: a crash, a hang, a sanitizer report or an exception that is no glint::Error.

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>

#include "glint/formats/asset_reader.h"
#include "glint/formats/validate.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const int file = memfd_create("glint-fuzz", MFD_CLOEXEC);
  if (file < 0) return 0;
  const std::string path = "/proc/self/fd/" + std::to_string(file);
  if (write(file, data, size) == static_cast<ssize_t>(size)) {
    try {
      const glint::formats::Asset asset = glint::formats::Asset::open(path);
      // Data checks evaluate every block and cluster, through the same indices as queries.
      glint::formats::validateAsset(path);
    } catch (const glint::Error&) {
    }
  }
  close(file);
  return 0;
}
