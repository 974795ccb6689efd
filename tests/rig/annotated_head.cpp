#include "tests/rig/annotated_head.h"

#include <fstream>
#include <iterator>
#include <stdexcept>
#include <variant>

#include "rig/build_rig.h"
#include "rig/mesh_io.h"
#include "tests/support/test_data.h"

namespace volto::rig::test {

AnnotatedHead::AnnotatedHead(const std::filesystem::path& mesh, const std::string& points) {
  const std::filesystem::path file = volto::test::sourceDir() / "tests/rig" / points;
  std::ifstream stream(file);
  const std::string json{std::istreambuf_iterator<char>(stream), {}};
  const FeaturePointChoices choices = parseFeaturePoints(json, file.string());
  if (choices.size() != kFeaturePointCount) throw std::runtime_error(file.string() + ": not all 84 points");
  for (const auto& [point, choice] : choices) vertices_.at(point) = std::get<std::uint32_t>(choice);
  neutral_ = on(mesh);
}

FeaturePointPositions AnnotatedHead::on(const std::filesystem::path& mesh) const { return positionsOn(readMesh(mesh)); }

FeaturePointPositions AnnotatedHead::positionsOn(const Mesh& mesh) const {
  FeaturePointPositions positions;
  for (std::size_t i = 0; i < kFeaturePointCount; ++i)
    positions.row(static_cast<Eigen::Index>(i)) = mesh.positions.row(vertices_[i]);
  return positions;
}

}  // namespace volto::rig::test
