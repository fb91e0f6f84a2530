#include <png.h>

#include <bit>
#include <cerrno>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>

#include "common/image_formats.h"
#include "common/tiff_tags.h"
#include "glint/formats/system_error.h"

namespace glint::apps {
namespace {

/// A PNG while it is read. libpng reports errors by a long jump to the `setjmp` of the step that is running, so each step is a
/// function without objects that need destruction.
struct PngReader {
  std::FILE* file = nullptr;
  png_structp png = nullptr;
  png_infop info = nullptr;
  char message[128] = "";

  bool memory_ran_out = false;

  explicit PngReader(const std::string& path) : file(std::fopen(path.c_str(), "rb")) {
    if (!file) formats::throwUnreadable(path, "cannot be opened", errno);
    png = png_create_read_struct_2(
        PNG_LIBPNG_VER_STRING, this, fail, [](png_structp, png_const_charp) {}, this, allocate,
        [](png_structp, png_voidp memory) { std::free(memory); });
    info = png_create_info_struct(png);
    if (info) return;
    png_destroy_read_struct(&png, nullptr, nullptr);
    std::fclose(file);
    throw std::bad_alloc();
  }
  ~PngReader() {
    png_destroy_read_struct(&png, &info, nullptr);
    if (file) std::fclose(file);
  }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  static png_voidp allocate(png_structp png, png_alloc_size_t size) {
    void* memory = std::malloc(size);
    if (!memory) static_cast<PngReader*>(png_get_mem_ptr(png))->memory_ran_out = true;
    return memory;
  }

  [[noreturn]] void throwFault(const std::string& path) const {
    if (memory_ran_out) throw std::bad_alloc();
    if (std::ferror(file)) formats::throwUnreadable(path, "cannot be read", EIO);
    throwDamagedImage(path, message);
  }

  [[noreturn]] static void fail(png_structp png, png_const_charp text) {
    auto* self = static_cast<PngReader*>(png_get_error_ptr(png));
    std::snprintf(self->message, sizeof self->message, "%s", text);
    png_longjmp(png, 1);
  }

  /// Reads the header and asks for whole samples in the order of this machine.
  bool readHeader() {
    if (setjmp(png_jmpbuf(png))) return false;
    png_init_io(png, file);
    png_read_info(png, info);
    png_set_expand(png);
    if constexpr (std::endian::native == std::endian::little) png_set_swap(png);
    png_set_interlace_handling(png);
    png_read_update_info(png, info);
    return true;
  }

  /// Of the Exif metadata, which may come before or after the pixels.
  int orientation() {
#ifdef PNG_eXIf_SUPPORTED
    png_uint_32 size = 0;
    png_bytep exif = nullptr;
    if (png_get_eXIf_1(png, info, &size, &exif) != 0) return exifOrientation(std::as_bytes(std::span(exif, size)));
#endif
    return 1;
  }

  bool readRows(png_bytepp rows) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_image(png, rows);
    png_read_end(png, info);
    return true;
  }
};

template <class T>
PixelVector<T> readPixels(PngReader& reader, const Image& image, const std::string& path) {
  const std::size_t row = static_cast<std::size_t>(image.width) * image.channels;
  PixelVector<T> pixels(row * image.height);
  std::vector<png_bytep> rows(image.height);
  for (int j = 0; j < image.height; ++j) rows[j] = reinterpret_cast<png_bytep>(pixels.data() + row * (image.height - 1 - j));
  if (!reader.readRows(rows.data())) reader.throwFault(path);
  return pixels;
}

}  // namespace

bool isPng(const std::string& path) {
  png_byte signature[8] = {};
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  return file && std::fread(signature, 1, sizeof signature, file.get()) == sizeof signature &&
         png_sig_cmp(signature, 0, 8) == 0;
}

StoredImage readPng(const std::string& path, std::uint64_t most_bytes) {
  PngReader reader(path);
  if (!reader.readHeader()) reader.throwFault(path);
  static const std::vector<std::string> kNames[] = {{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
  StoredImage stored;
  Image& image = stored.image;
  image.width = static_cast<int>(png_get_image_width(reader.png, reader.info));
  image.height = static_cast<int>(png_get_image_height(reader.png, reader.info));
  image.channels = png_get_channels(reader.png, reader.info);
  image.channel_names = kNames[image.channels - 1];
  image.format = "png";
  image.bits = png_get_bit_depth(reader.png, reader.info);
  image.code_scale = image.bits == 16 ? 65535 : 255;
  image.alpha = image.channels % 2 == 0 ? image.channels - 1 : -1;
  image.parts = {""};
  stored.display = {0, 0, image.width, image.height};
  checkDeclaredSize(path, image.format, std::uint64_t{png_get_rowbytes(reader.png, reader.info)} * image.height, most_bytes);
  if (image.bits == 16) {
    image.pixels = readPixels<std::uint16_t>(reader, image, path);
  } else {
    image.pixels = readPixels<std::uint8_t>(reader, image, path);
  }
  stored.orientation = reader.orientation();
  return stored;
}

}  // namespace glint::apps
