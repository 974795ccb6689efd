#include "capture/face_choice.h"

#include <charconv>
#include <stdexcept>

namespace volto::capture {

FaceChoice parseFaceChoice(const std::string& text) {
  FaceChoice choice;
  if (text == "front") return choice;
  const char* const end = text.data() + text.size();
  const auto is_number = [&](auto& value, const char* from, const char* to) {
    const auto result = std::from_chars(from, to, value);
    return result.ec == std::errc() && result.ptr == to;
  };
  if (const std::size_t comma = text.find(','); comma != std::string::npos) {
    choice.kind = FaceChoice::Kind::nearest_to;
    if (is_number(choice.x, text.data(), text.data() + comma) && is_number(choice.y, text.data() + comma + 1, end) &&
        choice.x >= 0 && choice.x <= 1 && choice.y >= 0 && choice.y <= 1)
      return choice;
  } else {
    choice.kind = FaceChoice::Kind::number;
    if (is_number(choice.number, text.data(), end) && choice.number >= 1 && choice.number <= 64) return choice;
  }
  throw std::invalid_argument(text +
                              " is no face; give front, a number counted from the left (1, 2, ...), or a place as "
                              "fractions of the picture (0.25,0.5)");
}

}  // namespace volto::capture
