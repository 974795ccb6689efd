// Which face to follow, where there are several.
#pragma once

#include <cstdint>
#include <string>

namespace volto::capture {

struct FaceChoice {
  enum class Kind : std::uint8_t {
    in_front,   // the largest: the nearest to the camera
    number,     // counted from the left of the image, from 1
    nearest_to  // a place, as fractions of the image
  } kind = Kind::in_front;
  int number = 1;
  float x = 0.5F, y = 0.5F;
};

// "front", "2", "0.25,0.5". Throws std::invalid_argument with one line for people.
FaceChoice parseFaceChoice(const std::string& text);

}  // namespace volto::capture
