#include "jpeg.h"

#include <cstddef>
#include <cstdio>
// after cstdio, which it needs
#include <jpeglib.h>

#include <csetjmp>
#include <cstdlib>

namespace nido {
namespace {

constexpr std::uint32_t kLongestSide = 8192;

struct ErrorHandler {
  jpeg_error_mgr base;  // first: the library knows only this part
  std::jmp_buf jump;
};

// the library must not end the process, as it would by itself
[[noreturn]] void on_error(j_common_ptr info) {
  std::longjmp(reinterpret_cast<ErrorHandler*>(info->err)->jump, 1);
}

// No object with a destructor lives here: the library leaves by longjmp when it fails.
bool compress(const PictureView& picture, int components, J_COLOR_SPACE space, int quality,
              unsigned char** out, unsigned long* size) {
  jpeg_compress_struct job{};
  ErrorHandler handler{};
  job.err = jpeg_std_error(&handler.base);
  handler.base.error_exit = on_error;
  if (setjmp(handler.jump) != 0) {
    jpeg_destroy_compress(&job);
    return false;
  }
  jpeg_create_compress(&job);
  jpeg_mem_dest(&job, out, size);
  job.image_width = picture.width;
  job.image_height = picture.height;
  job.input_components = components;
  job.in_color_space = space;
  jpeg_set_defaults(&job);
  jpeg_set_quality(&job, quality, TRUE);
  jpeg_start_compress(&job, TRUE);
  while (job.next_scanline < job.image_height) {
    // the library does not write to what it reads
    auto* row =
        const_cast<JSAMPROW>(picture.bytes + static_cast<std::size_t>(job.next_scanline) * picture.step);
    jpeg_write_scanlines(&job, &row, 1);
  }
  jpeg_finish_compress(&job);
  jpeg_destroy_compress(&job);
  return true;
}

}  // namespace

Result<std::string> jpeg_of(const PictureView& picture, int quality) {
  const bool is_grey = picture.encoding == "mono8" || picture.encoding == "8UC1";
  if (!is_grey && picture.encoding != "rgb8" && picture.encoding != "bgr8") {
    return Error{ErrorCode::kUnsupported, "pictures of encoding '" + picture.encoding + "' are not shown"};
  }
  const std::uint32_t components = is_grey ? 1 : 3;
  if (picture.width == 0 || picture.height == 0 || picture.width > kLongestSide ||
      picture.height > kLongestSide || picture.step < picture.width * components ||
      picture.size <
          static_cast<std::size_t>(picture.step) * (picture.height - 1) + picture.width * components) {
    return Error{ErrorCode::kInvalidArgument, "the picture's size does not fit its bytes"};
  }
  unsigned char* out = nullptr;
  unsigned long size = 0;
  const bool done = compress(picture, static_cast<int>(components),
                             is_grey                      ? JCS_GRAYSCALE
                             : picture.encoding == "bgr8" ? JCS_EXT_BGR
                                                          : JCS_RGB,
                             quality, &out, &size);
  std::string bytes;
  if (done) bytes.assign(reinterpret_cast<const char*>(out), size);
  std::free(out);
  if (!done) return Error{ErrorCode::kFailed, "the picture could not be compressed"};
  return bytes;
}

}  // namespace nido
