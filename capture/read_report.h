// What a reader left out of a file, so that no loss is silent.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace volto::capture {

struct ReadReport {
  std::uint64_t rows_read = 0;         // complete data rows of the file, those below included
  std::uint64_t rows_equal_time = 0;   // dropped: the same time as the row before
  std::uint64_t rows_other_faces = 0;  // dropped: another face than the first one of the file
  std::uint64_t rows_lost = 0;         // kept as frames without a face
  bool last_row_cut = false;           // dropped: the file ends in the middle of its last row
  // One line for each kind of loss or repair, with its count and the first line it happened on: "take.csv:12: ...". For
  // people. Complete after the last frame has been read.
  std::vector<std::string> warnings;
};

}  // namespace volto::capture
