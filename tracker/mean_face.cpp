#include "tracker/mean_face.h"

#include "tracker/csv_row.h"

namespace volto::tracker {

extern const char* const kMeanFaceText;  // assets/mean_face.csv

rig::FeaturePointPositions parseMeanFace(std::string_view csv, const std::string& name) {
  rig::FeaturePointPositions face;
  int next = -1;  // -1: header
  forEachCsvRow(csv, name, [&](CsvRow& row) {
    if (next >= static_cast<int>(kFeaturePointCount))
      row.fail("belongs to a row too many; there are 84 feature points");
    const std::string_view expected =
        next < 0 ? "feature_point" : rig::featurePoints()[static_cast<std::size_t>(next)].id;
    const std::string_view first = row.field();
    if (first != expected) row.fail(std::string("is ").append(first).append(", expected ").append(expected));
    if (next >= 0) {
      for (int c = 0; c < 3; ++c) face(next, c) = row.number(-1000, 1000);
      row.expectEnd();
    }
    ++next;
  });
  if (next != static_cast<int>(kFeaturePointCount))
    throw std::invalid_argument(std::string(name).append(": does not hold all 84 feature points"));
  return face;
}

const rig::FeaturePointPositions& meanFace() {
  static const rig::FeaturePointPositions face = parseMeanFace(kMeanFaceText, "mean_face.csv");
  return face;
}

}  // namespace volto::tracker
