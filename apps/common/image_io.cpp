#include "common/image_io.h"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <new>

#include "common/files.h"
#include "common/image_formats.h"
#include "common/image_layout.h"
#include "common/memory.h"
#include "common/tiff_tags.h"
#include "glint/formats/atomic_file.h"
#include "glint/model/error.h"

namespace glint::apps {

const ImageFormats& imageFormats() {
  static const ImageFormats& loaded = []() -> const ImageFormats& {
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe");
    const std::string path = (program.parent_path() / GLINT_IMAGE_FORMATS).lexically_normal();
    errno = 0;
    void* object = ::dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    void* table = object ? ::dlsym(object, "glint_image_formats") : nullptr;
    if (!table) {
      if (errno == ENOMEM) throw std::bad_alloc();
      const char* text = ::dlerror();
      const std::string reason = text ? " (" + std::string(text) + ")" : "";             // the text goes with the next call
      for (const char* of_memory : {"failed to map segment", "cannot allocate memory"})  // the linker sets no errno
        if (reason.find(of_memory) != std::string::npos) throw std::bad_alloc();
      if (std::filesystem::exists(path)) checkSystemReads(path);
      throw Error(ErrorCode::failed, "image.formats", path, "",
                  "the part that reads and writes images cannot be loaded" + reason,
                  "install the whole package: this file belongs to the programs");
    }
    const auto& formats = *static_cast<const ImageFormats*>(table);
    if (std::strcmp(formats.version, GLINT_VERSION) != 0) {
      throw Error(ErrorCode::failed, "image.formats", path, "",
                  "is of another version (" + std::string(formats.version) + ") than this program (" GLINT_VERSION ")",
                  "install the whole package: this file belongs to the programs");
    }
    return formats;
  }();
  return loaded;
}

namespace {
/// libjpeg fills the missing rest of a truncated file with grey and only warns, so the end marker is looked for here.
void checkJpegComplete(const std::string& path) {
  const std::vector<std::byte> bytes = readFile(path);
  static constexpr std::array kEndOfImage = {std::byte{0xff}, std::byte{0xd9}};
  if (std::find_end(bytes.begin(), bytes.end(), kEndOfImage.begin(), kEndOfImage.end()) == bytes.end())
    throwDamagedImage(path, "the end marker of the JPEG is missing");
}

/// Takes from the tags of a TIFF what OpenImageIO does not tell, or tells wrongly.
void readTiffTags(Image& image, const std::string& path) {
  if (lacksBitsPerSample(path, image.part)) {
    throw Error(ErrorCode::unsupported, "image.bits", path, "",
                "is a TIFF that does not say how many bits a sample has (tag 258), which means 1 bit and cannot be read",
                "export it with 8 bits or as PNG");
  }
  image.no_data = geoTiffNoData(path, image.part);
}
}  // namespace

Image readImage(const std::string& path, const ImageChoice& choice) {
  checkRegular(path);
  const bool png = isPng(path);
  const std::uint64_t most_bytes = choice.of_any_size ? std::numeric_limits<std::uint64_t>::max() : availableMemory();
  StoredImage stored = png ? readPng(path, most_bytes) : imageFormats().read(path, choice.part, choice.layer, most_bytes);
  Image& image = stored.image;
  if (png) findPart(path, choice.part, image.parts);
  if (image.format == "jpeg") checkJpegComplete(path);
  if (image.format == "webp") stored.orientation = webpOrientation(path);
  if (image.format == "tiff") readTiffTags(image, path);
  if (choice.window == ImageChoice::Window::display) cropToDisplay(stored, choice, path);
  orient(stored);
  const bool full_names = choice.channels.find('.') != std::string::npos;
  if (!full_names || !choice.layer.empty()) selectLayer(image, choice.layer, path);

  std::vector<int> channels;
  if (!choice.channels.empty()) channels = findChannels(image, choice.channels, path);
  const bool alpha_chosen = std::find(channels.begin(), channels.end(), image.alpha) != channels.end();
  const bool divides =
      choice.alpha == ImageChoice::Alpha::divide || (choice.alpha == ImageChoice::Alpha::automatic && image.associated);
  if (divides && !alpha_chosen) divideByAlpha(image, choice, path);
  if (!channels.empty()) selectChannels(image, channels);
  return std::move(image);
}

std::vector<float> channelsOf(const Image& image, int channels) {
  const auto texels = static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  std::vector<float> values;
  values.reserve(texels * static_cast<std::size_t>(channels));
  std::visit(
      [&](const auto& pixels) {
        using Code = typename std::decay_t<decltype(pixels)>::value_type;
        const float scale = std::is_same_v<Code, std::uint8_t>    ? 1 / 255.0f
                            : std::is_same_v<Code, std::uint16_t> ? 1 / 65535.0f
                                                                  : 1.0f;
        for (std::size_t k = 0; k < texels; ++k)
          for (int c = 0; c < channels; ++c)
            values.push_back(
                scale * static_cast<float>(pixels[k * static_cast<std::size_t>(image.channels) + static_cast<std::size_t>(c)]));
      },
      image.pixels);
  return values;
}

float linearFromSrgb(float code) { return code <= 0.04045f ? code / 12.92f : std::pow((code + 0.055f) / 1.055f, 2.4f); }

void writeImage(const std::string& path, int width, int height, int channels, std::span<const float> pixels,
                PixelFormat format) {
  const auto bytes = imageFormats().encode(path, width, height, channels, pixels, format);
  formats::writeFile(path, std::as_bytes(std::span(bytes)));
}

bool isWritableImageName(const std::string& path) { return imageFormats().isWritableName(path); }

}  // namespace glint::apps
