#include <algorithm>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "rig/build_rig.h"
#include "rig/mesh_io.h"
#include "tests/support/test_data.h"
#include "tools/picture/head_renderer.h"
#include "tools/picture/rig_look.h"

namespace volto::picture {
namespace {

// Volto's own head, as if its file knew no colours.
const rig::Rig& bareHead() {
  static const rig::Rig head = [] {
    const auto assets = test::sourceDir() / "rig/assets";
    rig::Mesh mesh = rig::readMesh(assets / "volto_head.obj");
    mesh.materials.clear();
    mesh.polygon_material.clear();
    mesh.vertex_colours.clear();
    std::ifstream file(assets / "volto_head.points.json");
    const std::string json((std::istreambuf_iterator<char>(file)), {});
    return rig::buildRig(mesh, rig::parseFeaturePoints(json, "volto_head.points.json"));
  }();
  return head;
}

Vec3 tintAt(const Look& look, const char* feature_point) {
  const auto vertex = bareHead().feature_vertex[*rig::featurePointIndex(feature_point)];
  EXPECT_GE(vertex, 0) << feature_point;
  return look.vertex_tint[static_cast<std::size_t>(vertex)];
}

TEST(RigLook, LipsAreRedderThanTheSkinAroundThem) {
  const Look look = lookOfRig(bareHead());
  ASSERT_EQ(look.vertex_tint.size(), bareHead().neutral.vertexCount());
  for (const char* lip : {"2.2", "2.3"}) EXPECT_LT(tintAt(look, lip).y, 0.8F * tintAt(look, lip).x) << lip;
  for (const char* skin : {"2.1", "5.1", "5.2", "11.1", "9.15"}) {
    EXPECT_FLOAT_EQ(tintAt(look, skin).x, 1.0F) << skin;
    EXPECT_FLOAT_EQ(tintAt(look, skin).y, 1.0F) << skin;
  }
}

TEST(RigLook, EyesLookOutOfTheFace) {
  const Look look = lookOfRig(bareHead());
  EXPECT_GE(look.eyeballs.size(), 2U);
  for (const Eyeball& eye : look.eyeballs) {
    EXPECT_NEAR(dot(eye.axis, {static_cast<float>(bareHead().mesh_from_head(0, 2)),
                               static_cast<float>(bareHead().mesh_from_head(1, 2)),
                               static_cast<float>(bareHead().mesh_from_head(2, 2))}),
                1.0F, 1e-5F);
  }
}

TEST(RigLook, MaterialsOfTheFileAreKept) {
  rig::Rig head;
  head.neutral = rig::readMesh(test::sourceDir() / "rig/assets/volto_head.obj");
  head.neutral.vertex_colours.clear();
  head.neutral.materials.resize(1);
  head.neutral.materials[0] = {"skin", {0.2F, 0.3F, 0.4F}};
  head.neutral.polygon_material.assign(head.neutral.polygonCount(), 0);
  const Look look = lookOfRig(head);
  EXPECT_TRUE(look.vertex_tint.empty());
  EXPECT_FLOAT_EQ(look.surfaces[0].albedo.z, 0.4F);
}

TEST(RigLook, ShippedCharactersHaveTheirOwnColours) {
  for (const char* name : {"volto_head.obj", "volto_creature.obj"}) {
    const rig::Mesh mesh = rig::readMesh(test::sourceDir() / "rig/assets" / name);
    EXPECT_TRUE(mesh.notes.empty()) << name;
    const Look look = lookOf(mesh);
    EXPECT_TRUE(look.eyeballs.empty()) << name << ": iris and pupil are materials, nothing is painted over them";
    const auto skin = std::find_if(look.surfaces.begin(), look.surfaces.end(),
                                   [](const Surface& surface) { return surface.name == "skin"; });
    ASSERT_NE(skin, look.surfaces.end()) << name;
    const bool creature = std::string_view(name) == "volto_creature.obj";
    EXPECT_EQ(skin->albedo.y > skin->albedo.x, creature) << name << ": one is green";
  }
}

TEST(RigLook, FacePointsMakeACloserPicture) {
  HeadRenderer renderer(bareHead().neutral, lookOfRig(bareHead()));
  const float whole = renderer.render(frontView(64)).camera.distance;
  renderer.focusOn(facePoints(bareHead()));
  EXPECT_LT(renderer.render(frontView(64)).camera.distance, 0.8F * whole);
}

}  // namespace
}  // namespace volto::picture
