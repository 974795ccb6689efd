// MjpegDecoder: the JPEG pictures of real cameras, which are not quite what the standard says.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace volto::capture::v4l2 {

class MjpegDecoder {
 public:
  enum class Result : std::uint8_t {
    good,
    good_with_warnings,  // stray bytes before a marker and the like: many cameras send them in good pictures
    corrupt,             // `bgr` holds nothing of use; problem() says why
  };

  MjpegDecoder();
  ~MjpegDecoder();

  // Decodes one baseline JPEG of exactly width x height into `bgr` (3 * width * height bytes). Forgives missing Huffman
  // tables (those of the standard are meant), a missing end marker, and anything before the picture or after it. Before
  // any pixel is decoded the header is checked: another size, a progressive, arithmetic or several-scan picture is
  // corrupt. Allocates nothing itself; libjpeg-turbo does, a few blocks.
  Result decode(std::span<const std::uint8_t> data, int width, int height, std::span<std::uint8_t> bgr);

  // Of the last picture that was not good: "premature end of data". Empty before the first.
  const std::string& problem() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::capture::v4l2
