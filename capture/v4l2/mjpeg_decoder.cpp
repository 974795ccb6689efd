#include "capture/v4l2/mjpeg_decoder.h"

#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <new>

// jpeglib.h needs stdio.h before it.
#include <jerror.h>
#include <jpeglib.h>

namespace volto::capture::v4l2 {

namespace {

// Damage to the picture itself. What is not in the list is a flaw around it.
bool isDamage(int warning) {
  switch (warning) {
    case JWRN_BOGUS_PROGRESSION:
    case JWRN_HIT_MARKER:
    case JWRN_HUFF_BAD_CODE:
    case JWRN_JPEG_EOF:
    case JWRN_MUST_RESYNC:
    case JWRN_NOT_SEQUENTIAL:
      return true;
    default:
      return false;
  }
}

constexpr std::uint8_t kEndOfImage[2] = {0xFF, JPEG_EOI};

}  // namespace

struct MjpegDecoder::State {
  jpeg_decompress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg_source_mgr source{};
  std::jmp_buf leave;
  std::string problem;
  int warnings = 0;
  bool damaged = false;

  static State& of(j_common_ptr jpeg) { return *static_cast<State*>(jpeg->client_data); }

  void say(const char* text) {
    problem.assign(text);  // within what was reserved
  }
  static void describe(j_common_ptr jpeg) {
    char text[JMSG_LENGTH_MAX];
    jpeg->err->format_message(jpeg, text);
    of(jpeg).say(text);
  }

  State() {
    problem.reserve(2 * JMSG_LENGTH_MAX);
    jpeg.err = jpeg_std_error(&errors);
    errors.error_exit = [](j_common_ptr j) {
      describe(j);
      std::longjmp(of(j).leave, 1);
    };
    errors.emit_message = [](j_common_ptr j, int level) {
      if (level >= 0) return;  // a trace
      ++of(j).warnings;
      if (isDamage(j->err->msg_code)) of(j).damaged = true;
      describe(j);
    };
    errors.output_message = [](j_common_ptr) {};
    jpeg.client_data = this;
    if (setjmp(leave) != 0) throw std::bad_alloc();
    jpeg_create_decompress(&jpeg);
    jpeg.client_data = this;

    source.init_source = [](j_decompress_ptr) {};
    // The bytes are all there from the start; what is missing at their end is an end marker, and often only that.
    source.fill_input_buffer = [](j_decompress_ptr j) -> boolean {
      j->src->next_input_byte = kEndOfImage;
      j->src->bytes_in_buffer = sizeof(kEndOfImage);
      return TRUE;
    };
    source.skip_input_data = [](j_decompress_ptr j, long count) {
      if (count <= 0) return;
      const auto skip = static_cast<std::size_t>(count);
      if (skip > j->src->bytes_in_buffer) {
        j->src->fill_input_buffer(j);
        return;
      }
      j->src->next_input_byte += skip;
      j->src->bytes_in_buffer -= skip;
    };
    source.resync_to_restart = jpeg_resync_to_restart;
    source.term_source = [](j_decompress_ptr) {};
    jpeg.src = &source;
  }
  ~State() { jpeg_destroy_decompress(&jpeg); }

  // No object with a destructor lives in here: errors leave it by longjmp.
  Result decode(const std::uint8_t* data, std::size_t size, int width, int height, std::uint8_t* bgr) {
    warnings = 0;
    damaged = false;
    source.next_input_byte = data;
    source.bytes_in_buffer = size;
    if (setjmp(leave) != 0) {
      jpeg_abort_decompress(&jpeg);
      return Result::corrupt;
    }
    if (jpeg_read_header(&jpeg, TRUE) != JPEG_HEADER_OK) return refuse("no picture in it");
    if (jpeg.image_width != static_cast<JDIMENSION>(width) || jpeg.image_height != static_cast<JDIMENSION>(height)) {
      char text[96];
      std::snprintf(text, sizeof(text), "the picture is %ux%u and not %dx%d as agreed", jpeg.image_width,
                    jpeg.image_height, width, height);
      return refuse(text);
    }
    if (jpeg.progressive_mode) return refuse("a progressive JPEG, which no camera sends");
    if (jpeg.arith_code) return refuse("an arithmetic-coded JPEG, which no camera sends");
    if (jpeg_has_multiple_scans(&jpeg)) return refuse("a JPEG of several scans, which no camera sends");
    if (jpeg.num_components != 1 && jpeg.num_components != 3) return refuse("neither colour nor grey");
    jpeg.out_color_space = JCS_EXT_BGR;
    jpeg.do_fancy_upsampling = FALSE;
    jpeg.do_block_smoothing = FALSE;
    jpeg_start_decompress(&jpeg);
    const std::size_t row_bytes = static_cast<std::size_t>(width) * 3;
    while (jpeg.output_scanline < jpeg.output_height && !damaged) {
      JSAMPROW row = bgr + jpeg.output_scanline * row_bytes;
      jpeg_read_scanlines(&jpeg, &row, 1);
    }
    jpeg_abort_decompress(&jpeg);  // what follows the last row is nobody's business
    if (damaged) return Result::corrupt;
    return warnings == 0 ? Result::good : Result::good_with_warnings;
  }

  Result refuse(const char* why) {
    say(why);
    jpeg_abort_decompress(&jpeg);
    return Result::corrupt;
  }
};

MjpegDecoder::MjpegDecoder() : state_(std::make_unique<State>()) {}
MjpegDecoder::~MjpegDecoder() = default;

const std::string& MjpegDecoder::problem() const { return state_->problem; }

MjpegDecoder::Result MjpegDecoder::decode(std::span<const std::uint8_t> data, int width, int height,
                                          std::span<std::uint8_t> bgr) {
  if (width < 1 || height < 1 || bgr.size() < static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * 3) {
    state_->say("no room for the picture");
    return Result::corrupt;
  }
  // Some cameras put their own header before the picture.
  constexpr std::size_t kLongestPreamble = 1024;
  std::size_t start = 0;
  while (start + 3 <= data.size() && start < kLongestPreamble &&
         !(data[start] == 0xFF && data[start + 1] == 0xD8 && data[start + 2] == 0xFF))
    ++start;
  if (start + 3 > data.size() || start == kLongestPreamble) {
    state_->say("not a JPEG picture");
    return Result::corrupt;
  }
  return state_->decode(data.data() + start, data.size() - start, width, height, bgr.data());
}

}  // namespace volto::capture::v4l2
