#include "rig/measure/measure_expression_table.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "frames/arkit_blendshapes.h"
#include "rig/build_rig.h"
#include "rig/fapu.h"
#include "rig/head_frame.h"
#include "rig/mesh_io.h"

namespace volto::rig {
namespace {

namespace fs = std::filesystem;

constexpr double kNoiseFloor_fapu = 5e-4;  // smaller displacements are the sculptor's brush, not the expression

// ICT-FaceKit splits by side what ARKit has in one, and writes _L and _R.
std::vector<std::string> ictNames(const std::string& arkit) {
  if (arkit == "browInnerUp" || arkit == "cheekPuff") return {arkit + "_L", arkit + "_R"};
  for (const std::string middle : {"jawLeft", "jawRight", "mouthLeft", "mouthRight"})
    if (arkit == middle) return {arkit};
  if (arkit.ends_with("Left")) return {arkit.substr(0, arkit.size() - 4) + "_L"};
  if (arkit.ends_with("Right")) return {arkit.substr(0, arkit.size() - 5) + "_R"};
  return {arkit};
}

}  // namespace

std::string measureExpressionTable(const fs::path& ict, const fs::path& points_file) {
  std::ifstream file(points_file);
  if (!file) throw InputError(points_file.string() + ": cannot be opened");
  const std::string json{std::istreambuf_iterator<char>(file), {}};
  const FeaturePointChoices points = parseFeaturePoints(json, points_file.string());
  const Mesh neutral = readMesh(ict / "neutral.obj");

  const auto positionsOn = [&points](const Mesh& mesh) {
    FeaturePointPositions positions;
    for (std::size_t i = 0; i < kFeaturePointCount; ++i)
      positions.row(static_cast<Eigen::Index>(i)) = mesh.positions.row(std::get<std::uint32_t>(points.at(i)));
    return positions;
  };
  const FeaturePointPositions rest = positionsOn(neutral);
  const Eigen::Matrix3d mesh_from_head = meshFromHead(rest);
  const FeaturePointPositions scale = fapuScale(measureFapu(rest * mesh_from_head).fapu);

  std::vector<FeaturePointPositions> measured(kArkitBlendshapeCount, FeaturePointPositions::Zero());
  std::vector<std::string> sources(kArkitBlendshapeCount);
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k)
    for (const std::string& name : ictNames(std::string(kArkitBlendshapeNames[k]))) {
      const fs::path expression = ict / "expressions" / (name + ".obj");
      if (!fs::exists(expression)) continue;
      measured[k] += (((positionsOn(readMesh(expression)) - rest) * mesh_from_head).array() / scale.array()).matrix();
      sources[k] += (sources[k].empty() ? "" : " + ") + name;
    }

  char line[160];
  std::string text =
      "# Volto's expression table: how each of the 52 ARKit blendshapes at weight 1 moves the 84 feature points of the "
      "control mask.\n"
      "# x (to the subject's left), y (up), z (out of the face): displacement from neutral divided by the FAPU of that "
      "point's axis\n"
      "# (rig/feature_points.cpp). A point without a row does not move. Left and right are mirror images of each other "
      "by construction.\n"
      "# Measured by rig/measure/measure_expression_table.cpp on the artist-made expressions of ICT-FaceKit (USC ICT "
      "Vision and Graphics\n"
      "# Lab, MIT licence) at 84 annotated vertices; numbers only, no mesh data. Displacements under 0.0005 FAPU are "
      "left "
      "out.\n#\n";
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const std::string& mirror = sources[arkitMirrorIndex(k)];
    const std::string source = sources[k].empty() ? "not observed: moves no skin that the mask could show"
                               : mirror == sources[k]
                                   ? "measured: ICT-FaceKit " + sources[k] + ", symmetrised"
                                   : "measured: ICT-FaceKit " + sources[k] + " averaged with " + mirror + " mirrored";
    text += "# source " + std::string(kArkitBlendshapeNames[k]) + ": " + source + "\n";
  }
  text += "shape,feature_point,x,y,z\n";
  for (std::size_t k = 0; k < kArkitBlendshapeCount; ++k) {
    const FeaturePointPositions& other = measured[arkitMirrorIndex(k)];
    for (std::size_t i = 0; i < kFeaturePointCount; ++i) {
      const Eigen::RowVector3d mirrored =
          other.row(featurePoints()[i].mirror).cwiseProduct(Eigen::RowVector3d(-1, 1, 1));
      const Eigen::RowVector3d d = 0.5 * (measured[k].row(static_cast<Eigen::Index>(i)) + mirrored);
      if (d.cwiseAbs().maxCoeff() < kNoiseFloor_fapu) continue;
      const auto rounded = [](double value) { return std::round(value * 1e4) / 1e4 + 0.0; };  // + 0.0: no -0
      std::snprintf(line, sizeof line, "%s,%s,%.4f,%.4f,%.4f\n", std::string(kArkitBlendshapeNames[k]).c_str(),
                    std::string(featurePoints()[i].id).c_str(), rounded(d.x()), rounded(d.y()), rounded(d.z()));
      text += line;
    }
  }
  return text;
}

}  // namespace volto::rig
