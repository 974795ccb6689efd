#include "capture/csv_kind.h"

#include <cctype>
#include <string>

namespace volto::capture {

CsvKind csvKind(std::string_view start) {
  if (start.starts_with("\xEF\xBB\xBF")) start.remove_prefix(3);
  std::string header;
  for (const char c : start) {
    if (c == '\n' && !header.empty()) break;
    if (c == ' ' || c == '\t' || c == '\r' || c == '\n') continue;
    header += c == ';' ? ',' : static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  header = "," + header + ",";
  const auto has = [&](std::string_view name) { return header.find(name) != std::string::npos; };
  if (has(",timecode,") && (has(",blendshapecount,") || has(",jawopen,"))) return CsvKind::live_link;
  if (has(",timestamp,") || has(",frame,") || has(",face,")) {
    if (has(",x_0,") || has(",au01_r,") || has(",pose_tx,") || has(",pose_rx,") || has(",success,"))
      return CsvKind::openface;
  }
  return CsvKind::unknown;
}

}  // namespace volto::capture
