// Characters and performances in other programs' formats.
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include <gtest/gtest.h>

#include "capture/livelink_csv.h"
#include "retarget/eyes.h"
#include "retarget/face_deformer.h"
#include "rig/gltf_document.h"
#include "rig/gltf_skin.h"
#include "rig/mesh_io.h"
#include "tests/retarget/synthetic_rig.h"
#include "tests/support/test_data.h"
#include "tools/export/character_parts.h"
#include "tools/export/glb_file.h"
#include "tools/export/livelink_csv.h"
#include "tools/export/movement.h"
#include "tools/export/shape_folder.h"

namespace volto::exporter {
namespace {

constexpr std::uint32_t kSide = 12;

// The synthetic character with a surface: quads of skin, triangles on the eyes, two materials, a seam of texture
// coordinates down the middle.
rig::Rig character() {
  rig::Rig rig = test::syntheticRig({.skin_side = kSide});
  rig.name = "sheet";
  rig::Mesh& mesh = rig.neutral;
  mesh.materials = {{"skin", {0.5F, 0.25F, 0.125F}}, {"iris", {0.1F, 0.2F, 0.3F}}};
  mesh.polygon_start = {0};
  const auto polygon = [&](std::initializer_list<std::uint32_t> corners, std::uint32_t material) {
    for (const std::uint32_t v : corners) {
      mesh.corner_vertices.push_back(v);
      mesh.corner_texcoords.push_back({static_cast<float>(v % kSide) / kSide, material == 0 ? 0.25F : 0.75F});
    }
    mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
    mesh.polygon_material.push_back(material);
  };
  for (std::uint32_t row = 0; row + 1 < kSide; ++row)
    for (std::uint32_t column = 0; column + 1 < kSide; ++column) {
      const std::uint32_t a = row * kSide + column;
      // The right half's texture lies elsewhere: vertices of the middle column have two coordinates.
      polygon({a, a + 1, a + 1 + kSide, a + kSide}, 0);
      if (column >= kSide / 2)
        for (std::size_t c = mesh.corner_texcoords.size() - 4; c < mesh.corner_texcoords.size(); ++c)
          mesh.corner_texcoords[c][1] = 0.5F;
    }
  for (const rig::RigidPart& part : rig.rigid_parts)
    for (std::size_t i = 0; i + 2 < part.vertices.size(); ++i)
      polygon({part.vertices[i], part.vertices[i + 1], part.vertices[i + 2]}, 1);
  return rig;
}

TEST(CharacterParts, EyesAreApartAndSeamsAreCut) {
  const rig::Rig rig = character();
  const CharacterParts parts = takeApart(rig);
  ASSERT_EQ(parts.parts.size(), 3U);
  EXPECT_EQ(parts.parts[0].name, "face");
  EXPECT_EQ(parts.parts[0].vertex.size(), kSide * kSide + kSide) << "the vertices of one column twice";
  for (std::uint32_t v = 0; v < kSide * kSide; ++v) EXPECT_EQ(parts.parts[0].vertex[v], v) << "in the artist's order";
  EXPECT_EQ(parts.parts[1].name, "leftEye");
  EXPECT_EQ(parts.parts[1].vertex.size(), 60U);
  EXPECT_EQ(parts.parts[1].origin, rig.rigid_parts[0].centre);
  ASSERT_EQ(parts.materials.size(), 2U);
  EXPECT_EQ(parts.materials[0].colour, (std::array<float, 3>{0.5F, 0.25F, 0.125F}));
  EXPECT_GT(parts.materials[0].roughness, parts.materials[1].roughness) << "an eye is wet";
}

TEST(CharacterParts, EyeThatIsJoinedToTheFaceStaysInIt) {
  rig::Rig rig = character();
  for (const std::uint32_t v : {0U, 1U, rig.rigid_parts[0].vertices[0]}) {
    rig.neutral.corner_vertices.push_back(v);
    rig.neutral.corner_texcoords.push_back({0.0F, 0.0F});
  }
  rig.neutral.polygon_start.push_back(static_cast<std::uint32_t>(rig.neutral.corner_vertices.size()));
  rig.neutral.polygon_material.push_back(0);
  const CharacterParts parts = takeApart(rig);
  ASSERT_EQ(parts.parts.size(), 2U);
  EXPECT_EQ(parts.parts[1].name, "rightEye");
  std::size_t corners = 0;
  for (const ExportPart& part : parts.parts)
    for (const ExportPart::Group& group : part.groups) corners += group.corners.size();
  EXPECT_EQ(corners, 3 * rig::triangulate(rig.neutral).size()) << "no triangle is lost";
}

TEST(Glb, ReadBackItIsTheSameMesh) {
  const rig::Rig rig = character();
  const rig::Mesh mesh = rig::parseGltf(formatGlb(rig), "sheet.glb");
  ASSERT_EQ(mesh.vertexCount(), rig.neutral.vertexCount());
  EXPECT_LT((mesh.positions - rig.neutral.positions).cwiseAbs().maxCoeff(), 1e-6);
  // The face's triangles in order, then the eyes'.
  const auto triangles = rig::triangulate(rig.neutral);
  ASSERT_EQ(mesh.polygonCount(), triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (std::size_t c = 0; c < 3; ++c) EXPECT_EQ(mesh.corner_vertices[3 * t + c], triangles[t][c]);
  EXPECT_EQ(mesh.materials[0].name, "skin");
  EXPECT_NEAR(mesh.materials[0].colour[2], 0.125F, 1e-4);
  EXPECT_NEAR(mesh.corner_texcoords[0][1], 0.25F, 1e-6);
  // And once more: not a bit changes.
  rig::Rig again = rig;
  again.neutral.positions = mesh.positions;
  EXPECT_EQ(rig::parseGltf(formatGlb(again), "m").positions.topRows(kSide * kSide),
            mesh.positions.topRows(kSide * kSide));
}

TEST(Glb, ASkinComesBackAndLeavesTheFaceAtRestWhereItIs) {
  const rig::Rig rig = character();
  rig::GltfSkin skin;
  const auto joint = [&](const char* name, int parent, double angle, double x) {
    rig::GltfSkin::Joint out{name, parent, Eigen::Affine3d::Identity()};
    out.mesh_from_joint.translate(Eigen::Vector3d(x, 0.5 * x, -x));
    out.mesh_from_joint.rotate(Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, 3).normalized()));
    skin.joints.push_back(out);
  };
  joint("spine", -1, 0.3, 0.1);
  joint("skull", 0, -0.8, 0.4);
  joint("jaw", 1, 1.1, 0.7);
  for (std::size_t v = 0; v < rig.neutral.vertexCount(); ++v) {
    const float w = static_cast<float>(v % 4) / 4;
    skin.joint.push_back({static_cast<std::uint16_t>(v % 3), 2, 0, 0});
    skin.weight.push_back({1 - w, w, 0, 0});
  }
  const std::string bytes = formatGlb(rig, nullptr, &skin);
  const rig::GltfSkin back = rig::parseGltfSkin(bytes, "m");
  ASSERT_EQ(back.joints.size(), 3U);
  for (std::size_t j = 0; j < 3; ++j) {
    EXPECT_EQ(back.joints[j].name, skin.joints[j].name);
    EXPECT_EQ(back.joints[j].parent, skin.joints[j].parent);
    EXPECT_LT((back.joints[j].mesh_from_joint.matrix() - skin.joints[j].mesh_from_joint.matrix()).cwiseAbs().maxCoeff(),
              1e-6);
  }
  for (std::size_t v = 0; v < kSide * kSide; ++v) {
    EXPECT_EQ(back.joint[v][0], v % 4 == 0 || v % 3 != 2 ? v % 3 : 2);
    EXPECT_NEAR(back.weight[v][1], static_cast<float>(v % 4) / 4, 1e-6F);
  }
  EXPECT_LT((rig::parseGltf(bytes, "m").positions - rig.neutral.positions).cwiseAbs().maxCoeff(), 1e-6);

  // As any program places it: node upon node, times the bind matrix, leaves a vertex alone.
  const rig::GltfDocument document = rig::openGltf(bytes, "m", {});
  ASSERT_EQ(document.model.skins.size(), 1U);
  const auto bind = rig::readAccessor(document, document.model.skins[0].inverseBindMatrices, 16, 100, "m");
  std::map<int, Eigen::Affine3d> scene_from_node;
  const std::function<void(int, const Eigen::Affine3d&)> walk = [&](int number, const Eigen::Affine3d& above) {
    const tinygltf::Node& node = document.model.nodes[static_cast<std::size_t>(number)];
    Eigen::Affine3d here = above;
    if (!node.translation.empty())
      here.translate(Eigen::Vector3d(node.translation[0], node.translation[1], node.translation[2]));
    if (!node.rotation.empty())
      here.rotate(Eigen::Quaterniond(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]));
    EXPECT_TRUE(node.scale.empty());
    scene_from_node[number] = here;
    for (const int child : node.children) walk(child, here);
  };
  for (const int root : document.model.scenes[0].nodes) walk(root, Eigen::Affine3d::Identity());
  const Eigen::Affine3d upright = scene_from_node.at(0);
  for (std::size_t j = 0; j < 3; ++j) {
    const Eigen::Matrix4d at_rest = scene_from_node.at(document.model.skins[0].joints[j]).matrix() *
                                    Eigen::Map<const Eigen::Matrix4d>(bind.data() + 16 * j);
    EXPECT_LT((at_rest - upright.matrix()).cwiseAbs().maxCoeff(), 1e-6);
  }
  skin.joint.pop_back();
  EXPECT_THROW(formatGlb(rig, nullptr, &skin), std::invalid_argument);
}

TEST(Glb, SameCharacterSameBytes) { EXPECT_EQ(formatGlb(character()), formatGlb(character())); }

TEST(Glb, MorphTargetsAreTheShapesAtWeightOne) {
  const rig::Rig rig = character();
  const std::string bytes = formatGlb(rig);
  // With targets: the reader for meshes leaves them out.
  tinygltf::Model model;
  std::string error, warning;
  tinygltf::TinyGLTF loader;
  ASSERT_TRUE(loader.LoadBinaryFromMemory(&model, &error, &warning,
                                          reinterpret_cast<const unsigned char*>(bytes.data()),
                                          static_cast<unsigned>(bytes.size())))
      << error;
  rig::GltfDocument document;
  document.model = model;
  document.buffers.emplace_back(reinterpret_cast<const char*>(model.buffers[0].data.data()),
                                model.buffers[0].data.size());
  ASSERT_EQ(model.meshes.size(), 3U);
  const tinygltf::Mesh& face = model.meshes[0];
  const tinygltf::Value names = face.extras.Get("targetNames");
  ASSERT_EQ(names.ArrayLen(), 52U);
  ASSERT_EQ(face.primitives[0].targets.size(), 52U);
  EXPECT_TRUE(model.meshes[1].primitives[0].targets.empty());
  std::vector<float> weights(52, 0.0F);
  std::size_t moving = 0;
  for (const std::size_t k : {std::size_t{0}, std::size_t{17}, std::size_t{33}}) {
    EXPECT_EQ(names.Get(static_cast<int>(k)).Get<std::string>(), rig.blendshapes[k].name);
    weights[k] = 1.0F;
    const std::vector<retarget::Vertex> shaped = retarget::deformAtWeights(rig, weights);
    weights[k] = 0.0F;
    const std::vector<double> move =
        rig::readAccessor(document, face.primitives[0].targets[k].at("POSITION"), 3, 100'000, "m");
    ASSERT_EQ(move.size(), 3U * (kSide * kSide + kSide));
    for (std::uint32_t v = 0; v < kSide * kSide; ++v)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double wanted =
            static_cast<double>(shaped[v][axis]) - rig.neutral.positions(v, static_cast<Eigen::Index>(axis));
        EXPECT_NEAR(move[3 * v + axis], wanted, 2e-5);
        moving += std::abs(wanted) > 1e-3 ? 1 : 0;
      }
  }
  EXPECT_GT(moving, 20U) << "or nothing was compared";
}

AvatarFrame frameAt(const rig::Rig& rig, double seconds) {
  AvatarFrame frame;
  frame.t_capture_ns = static_cast<std::int64_t>(seconds * 1e9);
  frame.weights.assign(rig.blendshapes.size(), 0.0F);
  frame.observed.assign(rig.blendshapes.size(), 1);
  frame.weights[17] = static_cast<float>(seconds);
  frame.head.observed = true;
  frame.head.yaw_rad = static_cast<float>(seconds);
  frame.head.rotation = {0.0F, static_cast<float>(std::sin(seconds / 2)), 0.0F,
                         static_cast<float>(std::cos(seconds / 2))};
  frame.gaze = {{0.25F, 0.0F}, {0.0F, -0.125F}, 1.0F};
  return frame;
}

TEST(Movement, HoldsTrueTimesAndTurnsInTheMeshsFrame) {
  rig::Rig rig = character();
  rig.mesh_from_head << 0, 0, 1, 1, 0, 0, 0, 1, 0;  // up is z
  MovementRecorder recorder(rig);
  for (const double seconds : {5.0, 5.25, 5.25, 6.0})
    recorder.add(frameAt(rig, seconds - 5.0), static_cast<std::int64_t>(seconds * 1e9));
  const Movement& m = recorder.movement();
  EXPECT_EQ(m.time_s, (std::vector<double>{0.0, 0.25, 1.0})) << "one that does not advance is left out";
  EXPECT_EQ(m.weights[52 * 2 + 17], 1.0F);
  EXPECT_NEAR(m.head[2][2], std::sin(0.5), 1e-6) << "a turn about y of the head is one about z of the mesh";
  EXPECT_NEAR(m.head[2][1], 0.0, 1e-6);
  EXPECT_TRUE(m.head_moves && m.left_eye_moves && m.right_eye_moves);
}

TEST(Movement, EyesAreReadOffTheirVertices) {
  const rig::Rig rig = character();
  std::vector<retarget::Vertex> vertices;
  for (Eigen::Index v = 0; v < rig.neutral.positions.rows(); ++v) {
    const auto p = rig.neutral.positions.row(v);
    vertices.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
  }
  AvatarFrame frame = frameAt(rig, 0.0);
  retarget::Eyes(rig).turn(frame.gaze, vertices);
  MovementRecorder from_gaze(rig), from_vertices(rig);
  from_gaze.add(frame, 0);
  frame.vertices = vertices;
  frame.gaze = {};
  from_vertices.add(frame, 0);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(from_gaze.movement().left_eye[0][i], from_vertices.movement().left_eye[0][i], 1e-4);
    EXPECT_NEAR(from_gaze.movement().right_eye[0][i], from_vertices.movement().right_eye[0][i], 1e-4);
  }
  EXPECT_NEAR(from_gaze.movement().left_eye[0][1], std::sin(0.125), 1e-4);
}

TEST(Glb, AnimationHasTheFramesOfThePerformance) {
  const rig::Rig rig = character();
  MovementRecorder recorder(rig);
  for (int f = 0; f < 7; ++f) recorder.add(frameAt(rig, f / 60.0), f * 16'666'667LL);
  const std::string bytes = formatGlb(rig, &recorder.movement());
  tinygltf::Model model;
  std::string error, warning;
  ASSERT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromMemory(&model, &error, &warning,
                                                        reinterpret_cast<const unsigned char*>(bytes.data()),
                                                        static_cast<unsigned>(bytes.size())));
  ASSERT_EQ(model.animations.size(), 1U);
  ASSERT_EQ(model.animations[0].channels.size(), 4U) << "weights, two eyes, head";
  for (const auto& channel : model.animations[0].channels) {
    const auto& sampler = model.animations[0].samplers[static_cast<std::size_t>(channel.sampler)];
    EXPECT_EQ(model.accessors[static_cast<std::size_t>(sampler.input)].count, 7U);
    EXPECT_EQ(model.accessors[static_cast<std::size_t>(sampler.output)].count,
              channel.target_path == "weights" ? 7U * 52U : 7U);
    EXPECT_NEAR(model.accessors[static_cast<std::size_t>(sampler.input)].maxValues[0], 0.1, 1e-6);
  }
}

TEST(LiveLink, WhatIsWrittenIsReadAgain) {
  const rig::Rig rig = character();
  const LiveLinkRows rows(rig);
  std::string text = liveLinkHeader();
  // 23:59:59.5 and over midnight; a time that is no multiple of a frame.
  const std::int64_t start = (std::int64_t{24} * 3600 * 10 - 5) * 100'000'000;
  for (const std::int64_t t : {std::int64_t{0}, std::int64_t{123'456'789}, std::int64_t{700'000'000}})
    rows.append(text, start + t, frameAt(rig, static_cast<double>(t) * 1e-9));
  EXPECT_EQ(text.substr(text.find('\n') + 1, 19), "23:59:59:30.000,61,");
  EXPECT_NE(text.find("\n00:00:00:12.000,61,"), std::string::npos);
  EXPECT_EQ(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find('\n')), ','), 62);
  capture::LiveLinkCsvReader reader(text, "w.csv");
  WeightFrame frame;
  for (const double seconds : {0.0, 0.123456789, 0.7}) {
    ASSERT_TRUE(reader.next(frame));
    EXPECT_NEAR(static_cast<double>(frame.t_capture_ns) * 1e-9, seconds, 1e-5) << "true times, not frame numbers";
    EXPECT_NEAR(frame.weights[17], seconds, 1e-6);
    EXPECT_NEAR(frame.head.yaw_rad, seconds, 1e-6);
    EXPECT_NEAR(frame.gaze.left.yaw_rad, 0.25, 1e-6);
    EXPECT_NEAR(frame.gaze.right.pitch_rad, -0.125, 1e-6);
  }
  EXPECT_FALSE(reader.next(frame));
  rig::Rig other = rig;
  other.blendshapes.resize(1);
  other.blendshapes[0].name = "frown of my own";
  EXPECT_THROW(LiveLinkRows{other}, rig::InputError);
}

TEST(ShapeFolder, HoldsTheNeutralAndEveryShape) {
  const test::TemporaryDir folder;
  rig::Rig rig = character();
  rig.blendshapes.resize(3);
  writeShapeFolder(folder.path(), rig, [](std::size_t) { return true; });
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 5)
      << "neutral, three shapes, materials";
  const rig::Mesh neutral = rig::readMesh(folder / "neutral.obj");
  EXPECT_EQ(neutral.positions, rig.neutral.positions);
  EXPECT_EQ(neutral.corner_vertices, rig.neutral.corner_vertices);
  EXPECT_EQ(neutral.materials[0].colour, rig.neutral.materials[0].colour);
  const rig::Mesh shape = rig::readMesh(folder / (rig.blendshapes[1].name + ".obj"));
  EXPECT_NO_THROW(rig::requireSameTopology(neutral, shape, "shape"));
  EXPECT_NE(shape.positions, neutral.positions);
  rig.blendshapes[0].name = "../escape";
  EXPECT_THROW(writeShapeFolder(folder.path(), rig, [](std::size_t) { return true; }), rig::InputError);
}

}  // namespace
}  // namespace volto::exporter
