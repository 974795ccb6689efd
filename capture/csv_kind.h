// Which of the CSV formats that Volto reads a header line belongs to.
#pragma once

#include <cstdint>
#include <string_view>

namespace volto::capture {

enum class CsvKind : std::uint8_t {
  unknown,
  openface,   // landmarks or action units by OpenFace: openface_csv.h
  live_link,  // weights by Live Link Face: livelink_csv.h
};

// `start`: the first bytes of a file, up to and including the header line (64 KiB are plenty). Never throws: a file of
// no known kind is `unknown`, and what is wrong with a file of a known kind is the reader's to say.
CsvKind csvKind(std::string_view start);

}  // namespace volto::capture
