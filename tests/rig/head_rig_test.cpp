// The shipped characters driven by the expression table through Volto's own rigging.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "retarget/face_deformer.h"
#include "rig/build_rig.h"
#include "rig/closest_point.h"
#include "rig/mesh_io.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

class HeadRig : public ::testing::TestWithParam<const char*> {
 protected:
  static const Rig& rig() {
    static std::map<std::string, Rig> made;
    const std::string name = GetParam();
    if (const auto it = made.find(name); it != made.end()) return it->second;
    const auto folder = test::sourceDir() / "rig/assets";
    std::ifstream file(folder / (name + ".points.json"));
    const std::string json{std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
    return made[name] = buildRig(readMesh(folder / (name + ".obj")), parseFeaturePoints(json, name + ".points.json"));
  }
  // The character with these shapes at full weight, as every program deforms it.
  static const std::vector<retarget::Vertex>& posed(std::initializer_list<std::string_view> shapes) {
    static std::map<std::string, std::vector<retarget::Vertex>> made;
    static std::map<std::string, retarget::FaceDeformer> deformers;
    std::string key = GetParam();
    std::vector<std::pair<std::string_view, float>> weights;
    for (const std::string_view shape : shapes) {
      key += ' ' + std::string(shape);
      weights.emplace_back(shape, 1.0F);
    }
    if (const auto it = made.find(key); it != made.end()) return it->second;
    const auto [deformer, is_new] = deformers.try_emplace(GetParam(), rig());
    std::vector<retarget::Vertex>& out = made[key];
    out.resize(rig().neutral.vertexCount());
    deformer->second.deformAtWeights(retarget::weightsByName(rig(), weights), out);
    return out;
  }
  // Where a vertex is with these shapes at full weight.
  static Eigen::Vector3d moved(std::size_t v, std::initializer_list<std::string_view> shapes) {
    const retarget::Vertex& at = posed(shapes)[v];
    return {at[0], at[1], at[2]};
  }
  static std::size_t vertexOf(std::string_view id) {
    return static_cast<std::size_t>(rig().feature_vertex[featurePointIndex(id).value()]);
  }
};

TEST_P(HeadRig, NeedsNoSubstituteForAnyFapu) { EXPECT_TRUE(rig().fapu.substitutions.empty()); }

TEST_P(HeadRig, FindsEyeballsTeethAndTongue) {
  int left_eye = 0, right_eye = 0, jaw = 0, fixed = 0, skin = 0;
  for (const RigidPart& part : rig().rigid_parts) {
    left_eye += part.follows == RigidPart::Follows::left_eye;
    right_eye += part.follows == RigidPart::Follows::right_eye;
    jaw += part.follows == RigidPart::Follows::jaw;
    fixed += part.follows == RigidPart::Follows::head;
    skin += part.follows == RigidPart::Follows::skin;
  }
  EXPECT_EQ(left_eye, 1);
  EXPECT_EQ(right_eye, 1);
  EXPECT_EQ(jaw, 2);    // lower teeth, tongue
  EXPECT_EQ(fixed, 1);  // upper teeth
  EXPECT_EQ(skin, 4);   // lashes, brows
}

TEST_P(HeadRig, BlinkClosesTheLidsOverTheEyeball) {
  const auto blink = {std::string_view("eyeBlinkLeft")};
  const double open = moved(vertexOf("3.1"), {}).y() - moved(vertexOf("3.3"), {}).y();
  const double closed = moved(vertexOf("3.1"), blink).y() - moved(vertexOf("3.3"), blink).y();
  EXPECT_LT(std::fabs(closed), 0.08 * open);
  // The eyeball does not show: the skin over it (not the rim of the lids, which faces it) stays outside.
  const Mesh& mesh = rig().neutral;
  const RigidPart* eye = nullptr;
  for (const RigidPart& part : rig().rigid_parts)
    if (part.follows == RigidPart::Follows::left_eye) eye = &part;
  ASSERT_NE(eye, nullptr);
  const Eigen::Vector3d centre(eye->centre[0], eye->centre[1], eye->centre[2]);
  const double radius = (moved(eye->vertices.front(), {}) - centre).norm();
  double deepest = 0;
  int over_the_eye = 0;
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    if (mesh.materials[mesh.polygon_material[p]].name != "skin") continue;
    for (std::uint32_t c = mesh.polygon_start[p]; c < mesh.polygon_start[p + 1]; ++c) {
      const Eigen::Vector3d at = moved(mesh.corner_vertices[c], blink) - centre;
      if (at.head<2>().norm() > 0.8 * radius || at.z() < 0) continue;
      ++over_the_eye;
      deepest = std::max(deepest, radius - at.norm());
    }
  }
  EXPECT_GT(over_the_eye, 100);
  std::cerr << GetParam() << " deepest " << deepest << " of " << rig().fapu.fapu.eye_separation << " closed " << closed
            << " of " << open << "\n";
  EXPECT_LT(deepest, 0.005 * rig().fapu.fapu.eye_separation);
}

TEST_P(HeadRig, JawOpenPartsTheLipsAndTakesTheLowerTeethAlong) {
  const auto open = {std::string_view("jawOpen")};
  const double gap = moved(vertexOf("2.2"), open).y() - moved(vertexOf("2.3"), open).y();
  EXPECT_GT(gap, 0.5 * rig().fapu.fapu.mouth_nose);
  for (const RigidPart& part : rig().rigid_parts) {
    const std::size_t v = part.vertices.front();
    const double down = moved(v, {}).y() - moved(v, open).y();
    if (part.follows == RigidPart::Follows::jaw) {
      EXPECT_GT(down, 0.3 * gap) << part.name;
    } else {
      EXPECT_NEAR(down, 0, 0.05) << part.name;
    }
  }
}

// A triangle has flipped when it faces away from where it faced at rest.
TEST_P(HeadRig, NoTriangleFlipsOverThe52Shapes) {
  const Mesh& mesh = rig().neutral;
  const Eigen::MatrixXd rest = mesh.positions.cast<double>();
  std::size_t flipped = 0, worst = 0;
  std::string worst_shape;
  for (const Blendshape& shape : rig().blendshapes) {
    Eigen::MatrixXd at(rest.rows(), 3);
    for (std::size_t v = 0; v < mesh.vertexCount(); ++v)
      at.row(static_cast<Eigen::Index>(v)) = moved(v, {shape.name}).transpose();
    std::size_t here = 0;
    for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
      for (std::uint32_t c = mesh.polygon_start[p] + 1; c + 1 < mesh.polygon_start[p + 1]; ++c) {
        const auto normal = [&](const Eigen::MatrixXd& x) {
          const Eigen::RowVector3d a = x.row(mesh.corner_vertices[mesh.polygon_start[p]]);
          const Eigen::RowVector3d b = x.row(mesh.corner_vertices[c]), d = x.row(mesh.corner_vertices[c + 1]);
          return Eigen::RowVector3d((b - a).cross(d - a));
        };
        here += normal(at).dot(normal(rest)) < 0;
      }
    }
    flipped += here;
    if (here > worst) {
      worst = here;
      worst_shape = shape.name;
    }
  }
  EXPECT_EQ(flipped, 0U) << "most in " << worst_shape;
}

// The lining of the mouth lies a few millimetres behind cheeks and chin. Told by the materials of the head and by rays,
// not by what the rig takes for a lining.
TEST_P(HeadRig, MouthsLiningStaysBehindTheSkinInAll52Shapes) {
  const Mesh& mesh = rig().neutral;
  std::vector<bool> lining(mesh.vertexCount(), false), skin(mesh.vertexCount(), false);
  std::vector<std::array<std::uint32_t, 3>> outer;
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::string& name = mesh.materials[mesh.polygon_material[p]].name;
    const std::uint32_t first = mesh.polygon_start[p], last = mesh.polygon_start[p + 1];
    for (std::uint32_t c = first; c < last; ++c) {
      if (name == "mouth") lining[mesh.corner_vertices[c]] = true;
      if (name == "skin" || name == "lips") skin[mesh.corner_vertices[c]] = true;
      if (name == "skin" && c + 2 < last)
        outer.push_back({mesh.corner_vertices[first], mesh.corner_vertices[c + 1], mesh.corner_vertices[c + 2]});
    }
  }
  const ClosestPoint surface(mesh.positions, std::move(outer));
  const double es = rig().fapu.fapu.eye_separation;
  const auto normalOf = [](const auto& at, const std::array<std::uint32_t, 3>& t) {
    return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).normalized().eval();
  };
  const auto atRest = [&](std::uint32_t v) -> Eigen::Vector3d { return mesh.positions.row(v).transpose(); };
  std::size_t followed = 0;
  for (std::uint32_t v = 0; v < mesh.vertexCount(); ++v) {
    if (!lining[v] || skin[v]) continue;
    const SurfacePoint front = surface.find(atRest(v), 0.12 * es);
    if (front.triangle < 0) continue;
    const auto& t = surface.triangle(front.triangle);
    // What is straight behind the triangle, not beside it.
    if (-normalOf(atRest, t).dot(atRest(v) - atRest(t[0])) < 0.9 * front.distance) continue;
    ++followed;
    for (const std::string_view shape : kArkitBlendshapeNames) {
      const auto in = [&](std::uint32_t u) { return moved(u, {shape}); };
      EXPECT_LT(normalOf(in, t).dot(in(v) - in(t[0])), 0) << shape << ", vertex " << v;
    }
  }
  EXPECT_GT(followed, 20U);
}

TEST_P(HeadRig, NeckBorderAndBackOfTheHeadStayWhereTheyAre) {
  const Mesh& mesh = rig().neutral;
  const double back = mesh.positions.col(2).minCoeff();
  for (const Blendshape& shape : rig().blendshapes)
    for (std::size_t v = 0; v < mesh.vertexCount(); v += 7) {
      const auto at = mesh.positions.row(static_cast<Eigen::Index>(v));
      if (at[1] > -17 && at[2] > 0.85 * back) continue;
      EXPECT_LT((moved(v, {shape.name}) - moved(v, {})).norm(), 1e-6) << shape.name << " moves vertex " << v;
    }
}

INSTANTIATE_TEST_SUITE_P(Of, HeadRig, ::testing::Values("volto_head", "volto_creature"),
                         [](const auto& which) { return std::string(which.param); });

}  // namespace
}  // namespace volto::rig
