#include "common/image_layout.h"

#include <algorithm>
#include <cctype>
#include <limits>

#include "common/name_list.h"
#include "glint/model/counted.h"
#include "glint/model/error.h"
#include "glint/model/texel_name.h"

namespace glint::apps {
namespace {

constexpr const char* kChannelLetters[] = {"rx", "gy", "bz", "a"};

/// Makes an image of another size: pixel (i, j) is pixel source(i, j) of the old one, rows counted from the top.
template <class Source>
void rearrange(Image& image, int width, int height, const Source& source) {
  const auto channels = static_cast<std::size_t>(image.channels);
  std::visit(
      [&](auto& pixels) {
        std::decay_t<decltype(pixels)> moved(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * channels);
        auto target = moved.begin();
        for (int j = height - 1; j >= 0; --j) {  // the bottom row is stored first
          for (int i = 0; i < width; ++i) {
            const auto [column, row] = source(i, j);
            const std::size_t texel = static_cast<std::size_t>(image.height - 1 - row) * static_cast<std::size_t>(image.width) +
                                      static_cast<std::size_t>(column);
            target = std::copy_n(pixels.begin() + static_cast<std::ptrdiff_t>(texel * channels), channels, target);
          }
        }
        pixels = std::move(moved);
      },
      image.pixels);
  image.width = width;
  image.height = height;
}

std::string channelList(const Image& image) {
  return nameList(image.channel_names, [](std::size_t, const std::string& name) { return name; });
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// "x" of "normal.X", "r" of "R".
std::string layerPart(const std::string& channel) { return lower(channel.substr(channel.rfind('.') + 1)); }

/// The channel of a letter, or -1.
int channelOfLetter(const Image& image, char letter) {
  for (int c = 0; c < image.channels; ++c) {
    if (layerPart(image.channel_names[static_cast<std::size_t>(c)]) == std::string(1, letter)) return c;
  }
  // Grey and alpha are red, green, blue and alpha in fewer bytes.
  if (image.channels == 2 && image.alpha >= 0 && std::string("rgb").find(letter) != std::string::npos) return 1 - image.alpha;
  for (int c = 0; c < std::min(image.channels, 4); ++c)
    if (std::string(kChannelLetters[c]).find(letter) != std::string::npos) return c;
  return -1;
}

/// A pixel value, between 0 and 1 if the file stores integers.
template <class T>
float valueOf(T code) {
  if constexpr (std::is_floating_point_v<T>) return code;
  return static_cast<float>(code) / static_cast<float>(std::numeric_limits<T>::max());
}

[[noreturn]] void throwNotAssociated(const Image& image, const ImageChoice& choice, std::size_t texel, const std::string& what,
                                     const std::string& path) {
  throw Error(ErrorCode::invalid_input, "image.alpha", path, texelName(image.width, image.height, texel),
              what + ", although the file says that colours are multiplied by alpha",
              std::string("export the image without alpha") +
                  (choice.has_options ? ", or read the colours as they are with --alpha ignore" : ""));
}

/// Colours of a WebP are multiplied by alpha with 8 bits where they are read: under half an alpha a normal is off by more than a code.
void checkAlphaBits(const Image& image, const std::string& path) {
  const auto* pixels = std::get_if<PixelVector<std::uint8_t>>(&image.pixels);
  if (image.format != "webp" || !pixels) return;
  constexpr std::uint8_t kLeast = 128;
  TexelTally thin(image.width, image.height);
  const auto channels = static_cast<std::size_t>(image.channels);
  for (std::size_t k = 0; k < pixels->size(); k += channels) {
    const std::uint8_t alpha = (*pixels)[k + static_cast<std::size_t>(image.alpha)];
    if (alpha > 0 && alpha < kLeast) thin.add(k / channels);
  }
  if (thin.count() == 0) return;
  throw Error(ErrorCode::invalid_input, "image.alpha_bits", path, "",
              counted(thin.count(), {"pixel has", "pixels have"}) +
                  " an alpha below a half, under which a WebP loses bits of colour (first at " + thin.firstName() + ")",
              "export the image without alpha, or as PNG");
}

/// The colours of all pixels divided by their alpha; NaN where alpha is 0.
template <class T>
PixelVector<float> divided(const Image& image, const ImageChoice& choice, const PixelVector<T>& pixels, TexelTally& lost,
                           const std::string& path) {
  const auto channels = static_cast<std::size_t>(image.channels), alpha = static_cast<std::size_t>(image.alpha);
  PixelVector<float> values(pixels.size());
  for (std::size_t k = 0; k < pixels.size(); k += channels) {
    const float a = valueOf(pixels[k + alpha]);
    if (!(a >= 0)) throwNotAssociated(image, choice, k / channels, "alpha is no number of 0 or more", path);
    for (std::size_t c = 0; c < channels; ++c) {
      const float value = valueOf(pixels[k + c]);
      if (a == 0 && value != 0) throwNotAssociated(image, choice, k / channels, "alpha is 0 and the colour is not", path);
      if (!std::is_floating_point_v<T> && value > a)
        throwNotAssociated(image, choice, k / channels, "a colour is larger than alpha", path);
      values[k + c] = c == alpha ? a : a == 0 ? std::numeric_limits<float>::quiet_NaN() : value / a;
    }
    if (a == 0) lost.add(k / channels);
  }
  return values;
}

}  // namespace

void cropToDisplay(StoredImage& stored, const ImageChoice& choice, const std::string& path) {
  Image& image = stored.image;
  const auto [column, row, width, height] = stored.display;
  if (column == 0 && row == 0 && width == image.width && height == image.height) return;
  if (column < 0 || row < 0 || column + width > image.width || row + height > image.height) {
    // How much of one axis is both shown and stored.
    const auto overlap = [](std::int64_t first, std::int64_t shown, std::int64_t stored_size) {
      return std::max<std::int64_t>(0, std::min(first + shown, stored_size) - std::max<std::int64_t>(first, 0));
    };
    const std::int64_t missing = width * height - overlap(column, width, image.width) * overlap(row, height, image.height);
    throw Error(ErrorCode::invalid_input, "image.window", path, "",
                "the image has " + std::to_string(width) + " x " + std::to_string(height) + " pixels, of which " +
                    std::to_string(missing) + " are missing: the file stores " + std::to_string(image.width) + " x " +
                    std::to_string(image.height) + " from column " + std::to_string(-column) + ", row " + std::to_string(-row) +
                    " from the top on",
                std::string("export the whole image") +
                    (choice.has_options ? ", or take the stored pixels for a map with --window data" : ""));
  }
  image.notes.push_back("its " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                        " pixels reach beyond the display window, of which the " + std::to_string(width) + " x " +
                        std::to_string(height) + " pixels were read");
  const int left = static_cast<int>(column), top = static_cast<int>(row);
  rearrange(image, static_cast<int>(width), static_cast<int>(height), [=](int i, int j) {
    return std::pair{i + left, j + top};
  });
  stored.display = {0, 0, width, height};
}

void orient(StoredImage& stored) {
  const int w = stored.image.width - 1, h = stored.image.height - 1, orientation = stored.orientation;
  if (orientation <= 1 || orientation > 8) return;
  const bool turned = orientation >= 5;
  rearrange(stored.image, turned ? h + 1 : w + 1, turned ? w + 1 : h + 1, [=](int i, int j) {
    switch (orientation) {
      case 2:
        return std::pair{w - i, j};
      case 3:
        return std::pair{w - i, h - j};
      case 4:
        return std::pair{i, h - j};
      case 5:
        return std::pair{j, i};
      case 6:
        return std::pair{j, h - i};
      case 7:
        return std::pair{w - j, h - i};
      default:
        return std::pair{w - j, i};
    }
  });
  stored.orientation = 1;
}

void selectLayer(Image& image, const std::string& layer, const std::string& path) {
  for (const std::string& channel : image.channel_names) {
    const std::string name = layerOf(channel);
    if (std::find(image.layers.begin(), image.layers.end(), name) == image.layers.end()) image.layers.push_back(name);
  }
  const bool known = std::find(image.layers.begin(), image.layers.end(), layer) != image.layers.end();
  const bool is_part = !known && !image.parts.empty() && image.parts[static_cast<std::size_t>(image.part)] == layer;
  image.layer = layer.empty() || is_part ? image.layers.front() : layer;
  std::vector<int> kept;
  for (int c = 0; c < image.channels; ++c)
    if (layerOf(image.channel_names[static_cast<std::size_t>(c)]) == image.layer) kept.push_back(c);
  if (kept.empty()) {
    throw Error(
        ErrorCode::invalid_input, "image.layer", path, "", "has no layer \"" + layer + "\"",
        (image.parts.size() > 1 ? "its images are " + partList(image.parts) + "; the channels of the one that was read are "
                                : "its channels are ") +
            channelList(image));
  }
  // Each layer of an OpenEXR file may have an alpha of its own.
  const auto alpha = std::find_if(kept.begin(), kept.end(),
                                  [&](int c) { return layerPart(image.channel_names[static_cast<std::size_t>(c)]) == "a"; });
  if (image.format == "openexr" && alpha != kept.end()) image.alpha = *alpha, image.associated = true;
  selectChannels(image, kept);
}

std::vector<int> findChannels(const Image& image, const std::string& channels, const std::string& path) {
  std::vector<int> found;
  const auto add = [&](int channel, const std::string& name) {
    if (channel < 0) {
      throw Error(ErrorCode::invalid_input, "image.channels", path, "", "has no channel \"" + name + "\"",
                  "its channels are " + channelList(image) + "; choose among them with --channels");
    }
    found.push_back(channel);
  };
  const auto named = [&](const std::string& name) {
    const auto at = std::find(image.channel_names.begin(), image.channel_names.end(), name);
    return at == image.channel_names.end() ? -1 : static_cast<int>(at - image.channel_names.begin());
  };
  if (channels.find(',') == std::string::npos && named(channels) < 0) {
    for (const char letter : lower(channels)) add(channelOfLetter(image, letter), std::string(1, letter));
    return found;
  }
  for (std::size_t first = 0; first <= channels.size();) {
    const std::size_t end = std::min(channels.find(',', first), channels.size());
    const std::string name = channels.substr(first, end - first);
    add(name.size() == 1 && named(name) < 0 ? channelOfLetter(image, lower(name)[0]) : named(name), name);
    first = end + 1;
  }
  return found;
}

void selectChannels(Image& image, const std::vector<int>& channels) {
  bool all = static_cast<int>(channels.size()) == image.channels;
  for (std::size_t k = 0; k < channels.size(); ++k) all &= channels[k] == static_cast<int>(k);
  if (all) return;
  std::visit(
      [&](auto& pixels) {
        std::decay_t<decltype(pixels)> kept;
        kept.reserve(pixels.size() / static_cast<std::size_t>(image.channels) * channels.size());
        for (std::size_t k = 0; k < pixels.size(); k += static_cast<std::size_t>(image.channels))
          for (const int channel : channels) kept.push_back(pixels[k + static_cast<std::size_t>(channel)]);
        pixels = std::move(kept);
      },
      image.pixels);
  std::vector<std::string> names;
  for (const int channel : channels) names.push_back(image.channel_names[static_cast<std::size_t>(channel)]);
  const auto alpha = std::find(channels.begin(), channels.end(), image.alpha);
  image.alpha = image.alpha < 0 || alpha == channels.end() ? -1 : static_cast<int>(alpha - channels.begin());
  image.associated &= image.alpha >= 0;
  image.channel_names = std::move(names);
  image.channels = static_cast<int>(channels.size());
}

void divideByAlpha(Image& image, const ImageChoice& choice, const std::string& path) {
  if (image.alpha < 0 || image.channels < 2)
    throw Error(ErrorCode::invalid_input, "image.alpha", path, "", "has no alpha to divide by", "leave out --alpha divide");
  image.associated = false;
  checkAlphaBits(image, path);
  TexelTally lost(image.width, image.height);
  PixelVector<float> values;
  std::visit(
      [&](const auto& pixels) {
        const auto channels = static_cast<std::size_t>(image.channels);
        for (std::size_t k = static_cast<std::size_t>(image.alpha); k < pixels.size(); k += channels) {
          if (valueOf(pixels[k]) == 1) continue;
          values = divided(image, choice, pixels, lost, path);
          return;
        }
      },
      image.pixels);
  if (lost.count() > 0 && !choice.transparent_holes) {
    throw Error(ErrorCode::invalid_input, "image.transparent", path, "",
                counted(lost.count(), {"pixel is", "pixels are"}) +
                    " transparent: alpha 0 left nothing of the colour (first at " + lost.firstName() + ")",
                std::string(choice.has_options ? "fill them with --fix-invalid, or " : "") + "export the image without alpha");
  }
  if (!values.empty()) image.pixels = std::move(values);
}

}  // namespace glint::apps
