// Heads of the public test material with their 84 annotated vertices.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "rig/feature_points.h"
#include "rig/mesh.h"

namespace volto::rig::test {

// What a head's own file says: `points` is one of tests/rig/*_feature_points.json, the same for all meshes of one
// topology.
class AnnotatedHead {
 public:
  AnnotatedHead(const std::filesystem::path& mesh, const std::string& points);

  const FeaturePointPositions& neutral() const { return neutral_; }
  // The annotated vertices on another mesh of the same topology: an expression, another person.
  FeaturePointPositions on(const std::filesystem::path& mesh) const;

 private:
  FeaturePointPositions positionsOn(const Mesh& mesh) const;

  std::array<std::uint32_t, kFeaturePointCount> vertices_{};
  FeaturePointPositions neutral_;
};

}  // namespace volto::rig::test
