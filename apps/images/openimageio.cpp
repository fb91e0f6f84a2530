#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>
#include <OpenImageIO/strutil.h>
#include <fmt/format.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <memory>
#include <string_view>

#include "common/image_formats.h"
#include "common/image_layout.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

/// OpenImageIO sometimes appends a line break to its messages.
std::string trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ' || text.back() == '.')) text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

/// Reads all pixels bottom row first: a negative stride writes the file's first row into the array's last.
template <class T>
PixelVector<T> readFlipped(OIIO::ImageInput& input, int part, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
                           const std::string& path) {
  const std::size_t row = static_cast<std::size_t>(spec.width) * spec.nchannels;
  PixelVector<T> pixels(row * spec.height);
  const auto row_bytes = static_cast<OIIO::stride_t>(row * sizeof(T));
  T* last_row = pixels.data() + row * (spec.height - 1);
  errno = 0;
  const bool complete = input.read_image(part, 0, 0, spec.nchannels, type, last_row, OIIO::AutoStride, -row_bytes);
  const int reason = errno;
  if (complete && !input.has_error()) return pixels;
  checkSystemReason(path, reason);
  throwDamagedImage(path, trimmed(input.geterror()));
}

void checkSize(const OIIO::ImageSpec& spec, const std::string& path, const std::string& format, std::uint64_t most_bytes) {
  if (spec.depth > 1) {
    throw Error(ErrorCode::unsupported, "image.planar", path, "", "volumes are not supported", "export one slice as an image");
  }
  if (spec.deep) {
    throw Error(ErrorCode::unsupported, "image.planar", path, "", "deep images are not supported", "flatten the image first");
  }
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) throwDamagedImage(path, "it has no pixels");
  checkDeclaredSize(path, format, spec.image_bytes(true), most_bytes);
}

/// OpenImageIO leaves tiles of such TIFFs unread, and reports success: it forgets all but 1 to 16 and 32 bits.
void checkTiledBits(const OIIO::ImageSpec& spec, const std::string& path, std::string_view format) {
  const int bits = spec.get_int_attribute("oiio:BitsPerSample", static_cast<int>(spec.format.basesize()) * 8);
  const bool is_read = bits <= 16 || bits == 32;
  if (format != "tiff" || spec.tile_width == 0 || (is_read && spec.format != OIIO::TypeDesc::DOUBLE)) return;
  throw Error(ErrorCode::unsupported, "image.tiled_bits", path, "",
              fmt::format("is a TIFF in tiles whose numbers have {} bits, which cannot be read", bits),
              "export it with 32 bits (float32), or in strips instead of tiles");
}

/// @throws Error usage if a value does not fit
template <class T>
std::vector<T> toCodes(std::span<const float> values, const std::string& path) {
  constexpr float kFull = std::numeric_limits<T>::max();
  std::vector<T> codes(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!(values[i] >= 0 && values[i] <= 1)) {
      throw Error(ErrorCode::usage, "image.range", path, "",
                  fmt::format("the value {} does not fit an integer image", values[i]),
                  "write a floating-point format such as .exr");
    }
    codes[i] = static_cast<T>(std::lround(values[i] * kFull));
  }
  return codes;
}

OIIO::TypeDesc fileType(PixelFormat format) {
  switch (format) {
    case PixelFormat::u8:
      return OIIO::TypeDesc::UINT8;
    case PixelFormat::u16:
      return OIIO::TypeDesc::UINT16;
    case PixelFormat::f16:
      return OIIO::TypeDesc::HALF;
    case PixelFormat::f32:
      return OIIO::TypeDesc::FLOAT;
  }
  return OIIO::TypeDesc::FLOAT;
}

/// Encodes one image in memory, so that the file can be replaced in one step.
template <class T>
std::vector<unsigned char> encode(const std::string& path, const OIIO::ImageSpec& wanted, std::span<const T> pixels) {
  const auto output = OIIO::ImageOutput::create(path);
  if (!output) {
    throw Error(ErrorCode::usage, "image.format", path, "", "no image format has this extension: " + trimmed(OIIO::geterror()),
                "name the output .exr or .png");
  }
  if (!output->supports("ioproxy")) {
    throw Error(ErrorCode::unsupported, "image.format", path, "", "this image format cannot be written", "use .exr or .png");
  }
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  output->set_ioproxy(&memory);
  const auto type = OIIO::TypeDescFromC<T>::value();
  const auto row_bytes = static_cast<OIIO::stride_t>(static_cast<std::size_t>(wanted.width) * wanted.nchannels * sizeof(T));
  const T* last_row = pixels.data() + static_cast<std::size_t>(wanted.width) * wanted.nchannels * (wanted.height - 1);
  if (!output->open(path, wanted) || output->spec().format != wanted.format ||
      !output->write_image(type, last_row, OIIO::AutoStride, -row_bytes) || !output->close()) {
    const std::string reason = output->has_error() ? trimmed(output->geterror()) : "it does not hold this type of pixel";
    throw Error(ErrorCode::usage, "image.format", path, "", "the image cannot be written: " + reason,
                "use .exr for floating point, .png for 8 or 16 bits");
  }
  return bytes;
}

/// What to do about a file that OpenImageIO cannot read.
std::string unreadableRemedy(const std::string& reason) {
  if (reason.find("compression") != std::string::npos)
    return "convert it to .png, or if it is a DDS of two signed channels (BC5_SNORM) to an unsigned one (BC5_UNORM)";
  return "check that the file is complete and in a format that oiiotool --info can read";
}

/// Names of readers to try: the one of the file name extension, then all.
std::vector<std::string> readersFor(const std::string& path) {
  // "tiff:tif,tiff;jpeg:jpg,jpe": names, and extensions, which are names as well.
  const std::string known = ":" + std::string(OIIO::get_string_attribute("extension_list")) + ";";
  const std::string extension = OIIO::Strutil::lower(OIIO::Filesystem::extension(path, false));
  std::vector<std::string> readers = OIIO::Strutil::splits(OIIO::get_string_attribute("input_format_list"), ",");
  for (const char* const end : {",", ";"})
    for (const char* const start : {",", ":"})
      if (!extension.empty() && known.find(start + extension + end) != std::string::npos) {
        readers.insert(readers.begin(), extension);
        return readers;
      }
  return readers;
}

/// Opens a file by one reader after the other. ImageInput::open takes text after a question mark in a name for options of a
/// reader; readers themselves do not.
/// @param reason  of the first reader, if none opens the file
std::unique_ptr<OIIO::ImageInput> openByReaders(const std::string& path, const OIIO::ImageSpec& config, std::string& reason) {
  OIIO::ImageSpec patient = config, spec;
  patient.attribute("nowait", 1);  // for readers of sockets
  for (const std::string& reader : readersFor(path)) {
    auto input = OIIO::ImageInput::create(reader);
    if (input && input->open(path, spec, patient)) return input;
    if (input && reason.empty()) reason = input->geterror();
  }
  return nullptr;
}

std::unique_ptr<OIIO::ImageInput> open(const std::string& path) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  errno = 0;
  std::string reason;
  auto input =
      path.find('?') == std::string::npos ? OIIO::ImageInput::open(path, &config) : openByReaders(path, config, reason);
  if (input) return input;
  checkSystemReason(path, errno);
  checkSystemReads(path);
  reason = trimmed(reason.empty() ? OIIO::geterror() : reason);
  throw Error(ErrorCode::invalid_input, "image.readable", path, "", "cannot be read as an image: " + reason,
              unreadableRemedy(reason));
}

/// What a file says about its images (parts of OpenEXR, pages of TIFF) before their pixels are read.
struct Parts {
  std::vector<std::string> names;
  int first_with_layer = -1;  ///< number of the first part that has the layer, or its name; -1: none
};

bool hasLayer(const OIIO::ImageSpec& spec, const std::string& layer) {
  return std::any_of(spec.channelnames.begin(), spec.channelnames.end(),
                     [&](const std::string& channel) { return layerOf(channel) == layer; });
}

/// Parts after the most are not looked for.
Parts findParts(const std::string& path, const std::string& layer) {
  constexpr int kMost = 1000;
  const auto input = open(path);  // of its own: some readers (WebP) cannot go back
  Parts parts;
  int of_that_name = -1;
  do {
    const int number = static_cast<int>(parts.names.size());
    parts.names.push_back(std::string(input->spec().get_string_attribute("oiio:subimagename")));
    if (parts.first_with_layer < 0 && hasLayer(input->spec(), layer)) parts.first_with_layer = number;
    if (of_that_name < 0 && parts.names.back() == layer) of_that_name = number;
  } while (static_cast<int>(parts.names.size()) < kMost && input->seek_subimage(static_cast<int>(parts.names.size()), 0));
  if (parts.first_with_layer < 0) parts.first_with_layer = of_that_name;
  (void)input->geterror();  // says that there is no further one
  return parts;
}

/// Whether the other channels are multiplied by alpha. Readers of formats that are not listed tell nothing and do nothing.
bool isAssociated(const OIIO::ImageInput& input, const OIIO::ImageSpec& spec) {
  static constexpr std::array kFormats = {"openexr", "tiff", "targa", "webp", "psd", "rla", "iff"};
  return std::find(kFormats.begin(), kFormats.end(), std::string_view(input.format_name())) != kFormats.end() &&
         spec.get_int_attribute("oiio:UnassociatedAlpha") == 0;
}

/// The names of all channels. A reader that names fewer than it has (FITS) knows none: R, G, B, A in their order, then others.
std::vector<std::string> channelNames(const OIIO::ImageSpec& spec) {
  if (static_cast<int>(spec.channelnames.size()) == spec.nchannels) return spec.channelnames;
  return OIIO::ImageSpec(1, 1, spec.nchannels, spec.format).channelnames;
}

/// Number in the file that a value of 1 stands for.
double codeScale(const OIIO::ImageSpec& spec) {
  if (spec.format.is_floating_point()) return 1;
  const int bits = static_cast<int>(spec.format.basesize()) * 8 - (spec.format.is_signed() ? 1 : 0);
  return std::ldexp(1.0, bits) - 1;
}

/// OpenImageIO inverts images in which 0 is white for up to 8 bits only.
void invertWhiteZero(const OIIO::ImageSpec& spec, const std::string& path, Image& image) {
  if (image.format != "tiff" || spec.get_int_attribute("tiff:PhotometricInterpretation", 1) != 0) return;
  image.inverted = true;
  if (spec.format == OIIO::TypeDesc::UINT8) return;
  auto* codes = std::get_if<PixelVector<std::uint16_t>>(&image.pixels);
  if (!codes) {
    throw Error(ErrorCode::unsupported, "image.white_zero", path, "",
                "0 is white in this image of signed or floating-point pixels",
                "export it with 0 as black (PhotometricInterpretation 1)");
  }
  for (std::uint16_t& code : *codes) code = static_cast<std::uint16_t>(65535 - code);
}

StoredImage readImageFile(const std::string& path, const std::string& part, const std::string& layer,
                          std::uint64_t most_bytes) {
  // OpenImageIO has threads of its own, which --threads is to limit as well.
  OIIO::attribute("threads", static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism)));
  StoredImage stored;
  Image& image = stored.image;
  const Parts parts = findParts(path, layer);
  image.parts = parts.names;
  image.part = part.empty() && !layer.empty() ? std::max(parts.first_with_layer, 0) : findPart(path, part, image.parts);
  const auto input = open(path);
  if (image.part > 0 && !input->seek_subimage(image.part, 0)) throwDamagedImage(path, trimmed(input->geterror()));
  const OIIO::ImageSpec spec = input->spec();
  checkSize(spec, path, input->format_name(), most_bytes);
  checkTiledBits(spec, path, input->format_name());
  image.width = spec.width;
  image.height = spec.height;
  image.channels = spec.nchannels;
  image.channel_names = channelNames(spec);
  image.format = input->format_name();
  image.bits = spec.get_int_attribute("oiio:BitsPerSample", static_cast<int>(spec.format.basesize()) * 8);
  image.floating = spec.format.is_floating_point();
  image.code_scale = codeScale(spec);
  image.alpha = spec.alpha_channel < spec.nchannels ? spec.alpha_channel : -1;
  image.associated = image.alpha >= 0 && isAssociated(*input, spec);
  stored.orientation = spec.get_int_attribute("Orientation", 1);
  stored.display = {std::int64_t{spec.full_x} - spec.x, std::int64_t{spec.full_y} - spec.y, spec.full_width, spec.full_height};
  if (spec.format == OIIO::TypeDesc::UINT8) {
    image.pixels = readFlipped<std::uint8_t>(*input, image.part, spec, OIIO::TypeDesc::UINT8, path);
  } else if (spec.format == OIIO::TypeDesc::UINT16) {
    image.pixels = readFlipped<std::uint16_t>(*input, image.part, spec, OIIO::TypeDesc::UINT16, path);
  } else {
    image.pixels = readFlipped<float>(*input, image.part, spec, OIIO::TypeDesc::FLOAT, path);
  }
  invertWhiteZero(spec, path, image);
  return stored;
}

std::vector<unsigned char> encodeImage(const std::string& path, int width, int height, int channels,
                                       std::span<const float> pixels, PixelFormat format) {
  OIIO::ImageSpec spec(width, height, channels, fileType(format));
  if (channels == 1) spec.channelnames = {"Y"};
  spec.attribute("compression", "zip");
  if (format == PixelFormat::f16 || format == PixelFormat::f32)
    spec.attribute("DateTime", "");  // or OpenEXR files hold the time
  if (format == PixelFormat::u8) return encode<std::uint8_t>(path, spec, toCodes<std::uint8_t>(pixels, path));
  if (format == PixelFormat::u16) return encode<std::uint16_t>(path, spec, toCodes<std::uint16_t>(pixels, path));
  return encode<float>(path, spec, pixels);
}

std::vector<unsigned char> encodeTexture(const std::string& path, std::span<const std::string> channels,
                                         std::span<const MipLevel> levels, PixelFormat format, bool periodic) {
  constexpr int kTile = 64;
  const auto output = OIIO::ImageOutput::create(path);
  if (!output || !output->supports("ioproxy") || !output->supports("mipmap")) {
    (void)OIIO::geterror();
    throw Error(ErrorCode::usage, "image.format", path, "", "this image format holds no levels", "name the output .exr");
  }
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  output->set_ioproxy(&memory);
  bool complete = true;
  for (std::size_t l = 0; complete && l < levels.size(); ++l) {
    const MipLevel& level = levels[l];
    OIIO::ImageSpec spec(level.width, level.height, static_cast<int>(channels.size()), fileType(format));
    spec.channelnames.assign(channels.begin(), channels.end());
    spec.tile_width = spec.tile_height = kTile;
    spec.attribute("compression", "zip");
    spec.attribute("DateTime", "");
    spec.attribute("textureformat", "Plain Texture");
    spec.attribute("wrapmodes", periodic ? "periodic,periodic" : "clamp,clamp");
    spec.attribute("openexr:roundingmode", 0);  // down
    const std::size_t row = static_cast<std::size_t>(level.width) * channels.size();
    const float* last_row = level.pixels.data() + row * static_cast<std::size_t>(level.height - 1);
    complete = output->open(path, spec, l == 0 ? OIIO::ImageOutput::Create : OIIO::ImageOutput::AppendMIPLevel) &&
               output->write_image(OIIO::TypeDesc::FLOAT, last_row, OIIO::AutoStride,
                                   -static_cast<OIIO::stride_t>(row * sizeof(float)));
  }
  if (!complete || !output->close()) {
    throw Error(ErrorCode::failed, "image.format", path, "", "the texture cannot be written: " + trimmed(output->geterror()),
                "name the output .exr");
  }
  return bytes;
}

bool isWritableName(const std::string& path) {
  const auto output = OIIO::ImageOutput::create(path);
  if (!output) (void)OIIO::geterror();  // an error nobody fetches is printed at exit
  return output && output->supports("ioproxy");
}

std::vector<float> infernoColours(int size, std::span<const float> grey) {
  const OIIO::ImageSpec grey_spec(size, size, 1, OIIO::TypeDesc::FLOAT), colour_spec(size, size, 3, OIIO::TypeDesc::FLOAT);
  const OIIO::ImageBuf source(grey_spec, const_cast<float*>(grey.data()));
  std::vector<float> colours(3 * grey.size());
  OIIO::ImageBuf target(colour_spec, colours.data());
  if (!OIIO::ImageBufAlgo::color_map(target, source, 0, "inferno"))
    throw Error(ErrorCode::failed, "image.colours", "", "", target.geterror());
  return colours;
}

}  // namespace
}  // namespace glint::apps

/// What imageFormats() looks up.
extern "C" const glint::apps::ImageFormats glint_image_formats;
const glint::apps::ImageFormats glint_image_formats = {GLINT_VERSION,
                                                       glint::apps::readImageFile,
                                                       glint::apps::encodeImage,
                                                       glint::apps::encodeTexture,
                                                       glint::apps::isWritableName,
                                                       glint::apps::infernoColours};
