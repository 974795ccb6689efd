#include "tools/picture/png.h"

#include <stdexcept>

#include <png.h>

#include "tools/picture/write_file.h"

namespace volto::picture {

std::vector<std::byte> encodePng(const Picture& picture) {
  std::vector<std::byte> bytes;
  if (picture.width < 1 || picture.height < 1) throw std::invalid_argument("the picture is empty");
  png_structp png = png_create_write_struct(
      PNG_LIBPNG_VER_STRING, nullptr, [](png_structp, png_const_charp text) { throw std::runtime_error(text); },
      [](png_structp, png_const_charp) {});
  png_infop info = png != nullptr ? png_create_info_struct(png) : nullptr;
  if (info == nullptr) {
    png_destroy_write_struct(&png, nullptr);
    throw std::runtime_error("libpng does not start");
  }
  try {
    png_set_write_fn(
        png, &bytes,
        [](png_structp self, png_bytep data, png_size_t size) {
          auto& out = *static_cast<std::vector<std::byte>*>(png_get_io_ptr(self));
          const auto* begin = reinterpret_cast<const std::byte*>(data);
          out.insert(out.end(), begin, begin + size);
        },
        nullptr);
    png_set_compression_level(png, 6);
    png_set_filter(png, 0, PNG_FILTER_SUB | PNG_FILTER_UP | PNG_FILTER_PAETH);
    png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width), static_cast<png_uint_32>(picture.height), 8,
                 PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_write_info(png, info);
    const std::size_t stride = 3 * static_cast<std::size_t>(picture.width);
    for (std::size_t y = 0; y < static_cast<std::size_t>(picture.height); ++y)
      png_write_row(png, picture.rgb.data() + y * stride);
    png_write_end(png, info);
  } catch (...) {
    png_destroy_write_struct(&png, &info);
    throw;
  }
  png_destroy_write_struct(&png, &info);
  return bytes;
}

void writePng(const std::filesystem::path& path, const Picture& picture) { writeWholeFile(path, encodePng(picture)); }

}  // namespace volto::picture
