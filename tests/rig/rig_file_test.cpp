// The rig file: what was written is what is read, and nothing else is accepted.
#include "rig/rig_file.h"

#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <sys/stat.h>

#include <gtest/gtest.h>

#include "tests/rig/test_head.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

class RigFile : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    const test::TestHead head = test::makeTestHead({.subdivisions = 1, .parts = true});
    RigOptions options;
    options.name = "Anna";
    options.mesh_file = "anna.obj";
    rig_ = new Rig(buildRig(head.mesh, head.points, options));
    rig_->neutral.materials = {{"skin", {0.9F, 0.7F, 0.6F}}, {"eye", {1, 1, 1}}};
    rig_->neutral.polygon_material.assign(rig_->neutral.polygonCount(), 1);
    rig_->neutral.corner_texcoords.assign(rig_->neutral.corner_vertices.size(), {0.25F, 0.75F});
    rig_->fapu.substitutions = {"IRISD0: closed eyes"};
    bytes_ = new std::vector<std::byte>(encodeRig(*rig_));
  }
  static void TearDownTestSuite() {
    delete rig_;
    delete bytes_;
  }

  static std::string refused(std::span<const std::byte> bytes) {
    try {
      decodeRig(bytes, "anna.rig");
    } catch (const InputError& e) {
      EXPECT_TRUE(std::string(e.what()).starts_with("anna.rig: ")) << e.what();
      return e.what();
    }
    return "accepted";
  }

  static Rig* rig_;
  static std::vector<std::byte>* bytes_;
};
Rig* RigFile::rig_ = nullptr;
std::vector<std::byte>* RigFile::bytes_ = nullptr;

// Bit by bit, as the definition says: made independently of the reader's tables.
std::uint32_t crc32cByDefinition(std::vector<std::byte> bytes) {
  for (std::size_t i = 12; i < 16; ++i) bytes.at(i) = std::byte{0};
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const std::byte b : bytes) {
    crc ^= static_cast<std::uint32_t>(b);
    for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ ((crc & 1) != 0 ? 0x82F63B78U : 0U);
  }
  return ~crc;
}

TEST_F(RigFile, WhatWasWrittenIsRead) {
  const Rig again = decodeRig(*bytes_, "anna.rig");
  EXPECT_EQ(again.name, "Anna");
  EXPECT_EQ(again.mesh_file, "anna.obj");
  EXPECT_EQ(again.neutral.positions, rig_->neutral.positions);
  EXPECT_EQ(again.neutral.corner_vertices, rig_->neutral.corner_vertices);
  EXPECT_EQ(again.neutral.polygon_start, rig_->neutral.polygon_start);
  EXPECT_EQ(again.neutral.corner_texcoords, rig_->neutral.corner_texcoords);
  EXPECT_EQ(again.neutral.polygon_material, rig_->neutral.polygon_material);
  EXPECT_EQ(again.neutral.materials[0].name, "skin");
  EXPECT_EQ(again.neutral.materials[0].colour, rig_->neutral.materials[0].colour);
  EXPECT_EQ(again.feature_vertex, rig_->feature_vertex);
  EXPECT_EQ(again.feature_positions, rig_->feature_positions);
  EXPECT_EQ(again.mesh_from_head, rig_->mesh_from_head);
  EXPECT_EQ(again.fapu.fapu.mouth_nose, rig_->fapu.fapu.mouth_nose);
  EXPECT_EQ(again.fapu.substitutions, rig_->fapu.substitutions);
  EXPECT_EQ(again.association.triangle, rig_->association.triangle);
  EXPECT_EQ(again.association.kind, rig_->association.kind);
  EXPECT_EQ(again.region_of_influence, rig_->region_of_influence);
  EXPECT_EQ(again.deformation.row_start, rig_->deformation.row_start);
  EXPECT_EQ(again.deformation.point, rig_->deformation.point);
  EXPECT_EQ(again.deformation.weight, rig_->deformation.weight);
  ASSERT_EQ(again.rigid_parts.size(), rig_->rigid_parts.size());
  EXPECT_EQ(again.rigid_parts[0].vertices, rig_->rigid_parts[0].vertices);
  EXPECT_EQ(again.rigid_parts[0].centre, rig_->rigid_parts[0].centre);
  ASSERT_EQ(again.blendshapes.size(), rig_->blendshapes.size());
  EXPECT_EQ(again.blendshapes[17].mask_displacement, rig_->blendshapes[17].mask_displacement);
  EXPECT_EQ(encodeRig(again), *bytes_) << "the same rig gives the same bytes";
}

TEST_F(RigFile, CutAnywhereItIsRefused) {
  for (std::size_t length = 0; length < bytes_->size();
       length += length < 256 || length + 64 > bytes_->size() ? 1 : 997)
    ASSERT_NE(refused(std::span(*bytes_).first(length)), "accepted") << length;
  EXPECT_NE(refused(std::span(*bytes_).first(1000)).find("cut off at byte 1000"), std::string::npos);
}

TEST_F(RigFile, AnyFlippedBitIsNoticed) {
  std::vector<std::byte> bytes = *bytes_;
  for (std::size_t i = 0; i < bytes.size(); i += i < 128 ? 1 : 4801) {
    const std::byte bit{static_cast<unsigned char>(1U << (i % 8))};
    bytes[i] ^= bit;
    ASSERT_NE(refused(bytes), "accepted") << "byte " << i;
    bytes[i] ^= bit;
  }
  EXPECT_EQ(refused(bytes), "accepted");
}

TEST_F(RigFile, BytesTooManyAreRefused) {
  std::vector<std::byte> bytes = *bytes_;
  bytes.push_back(std::byte{0});
  EXPECT_NE(refused(bytes).find("too many"), std::string::npos);
}

TEST_F(RigFile, ANewerVersionIsNamed) {
  std::vector<std::byte> bytes = *bytes_;
  bytes[8] = std::byte{2};
  const std::uint32_t crc = crc32cByDefinition(bytes);
  std::memcpy(bytes.data() + 12, &crc, 4);
  EXPECT_NE(refused(bytes).find("version 2"), std::string::npos);
}

TEST_F(RigFile, AnotherKindOfFileIsNamed) {
  const std::string obj = "v 0 0 0\nv 1 0 0\n";
  EXPECT_NE(refused(std::as_bytes(std::span(obj))).find("not a rig file"), std::string::npos);
  EXPECT_NE(refused({}).find("not a rig file"), std::string::npos);
}

TEST_F(RigFile, BytesMayLieAnywhereInMemory) {
  std::vector<std::byte> shifted(bytes_->size() + 1);
  std::memcpy(shifted.data() + 1, bytes_->data(), bytes_->size());
  EXPECT_EQ(refused(std::span(shifted).subspan(1)), "accepted");
}

// A file with a good checksum can still be wrong: a program wrote it so.
TEST_F(RigFile, ContentsThatMakeNoSenseAreRefused) {
  const std::vector<std::pair<const char*, std::function<void(Rig&)>>> damages = {
      {"weight NaN", [](Rig& r) { r.deformation.weight[5] = std::nanf(""); }},
      {"point out of range", [](Rig& r) { r.deformation.point.back() = 84; }},
      {"rows too long", [](Rig& r) { r.deformation.row_start.back() += 1; }},
      {"rows backward", [](Rig& r) { r.deformation.row_start[3] = 1'000'000; }},
      {"row missing", [](Rig& r) { r.deformation.row_start.pop_back(); }},
      {"points without weights", [](Rig& r) { r.deformation.weight.pop_back(); }},
      {"unsorted row",
       [](Rig& r) {
         for (std::size_t i = 1; i < r.deformation.point.size(); ++i) r.deformation.point[i] = 3;
       }},
      {"vertex NaN", [](Rig& r) { r.neutral.positions(0, 0) = std::nan(""); }},
      {"corner out of range", [](Rig& r) { r.neutral.corner_vertices[0] = 1'000'000; }},
      {"polygon of two", [](Rig& r) { r.neutral.polygon_start[1] = 2; }},
      {"no polygons",
       [](Rig& r) {
         r.neutral.polygon_start = {0};
         r.neutral.corner_vertices.clear();
       }},
      {"texcoords missing", [](Rig& r) { r.neutral.corner_texcoords.pop_back(); }},
      {"material out of range", [](Rig& r) { r.neutral.polygon_material[0] = 9; }},
      {"feature vertex out of range", [](Rig& r) { r.feature_vertex[0] = 1'000'000; }},
      {"feature position inf", [](Rig& r) { r.feature_positions(3, 1) = INFINITY; }},
      {"no rotation", [](Rig& r) { r.mesh_from_head *= 2; }},
      {"unit zero", [](Rig& r) { r.fapu.fapu.mouth_nose = 0; }},
      {"triangle out of range", [](Rig& r) { r.association.triangle[0] = 136; }},
      {"association short", [](Rig& r) { r.association.triangle.pop_back(); }},
      {"kind unknown", [](Rig& r) { r.association.kind[0] = static_cast<AssociationKind>(9); }},
      {"region unsorted",
       [](Rig& r) {
         r.region_of_influence[0] = {5, 4};
       }},
      {"part out of range", [](Rig& r) { r.rigid_parts[0].vertices.back() = 1'000'000; }},
      {"part centre NaN", [](Rig& r) { r.rigid_parts[0].centre[1] = std::nan(""); }},
      {"part follows unknown", [](Rig& r) { r.rigid_parts[0].follows = static_cast<RigidPart::Follows>(7); }},
      {"blendshape unnamed", [](Rig& r) { r.blendshapes[0].name.clear(); }},
      {"blendshape twice", [](Rig& r) { r.blendshapes[1].name = r.blendshapes[0].name; }},
      {"blendshape inf", [](Rig& r) { r.blendshapes[2].mask_displacement[0][0] = INFINITY; }},
      {"name of a megabyte", [](Rig& r) { r.name.assign(1'000'000, 'x'); }},
  };
  for (const auto& [what, damage] : damages) {
    Rig rig = *rig_;
    damage(rig);
    EXPECT_NE(refused(encodeRig(rig)).find("damaged rig file"), std::string::npos) << what;
  }
}

TEST_F(RigFile, IsWrittenWholeOrNotAtAllAndReadFromRegularFilesOnly) {
  const test::TemporaryDir folder;
  EXPECT_THROW(writeRig(folder / "absent/anna.rig", *rig_), std::system_error);
  EXPECT_THROW(readRig(folder / "anna.rig"), std::system_error);
  writeRig(folder / "anna.rig", *rig_);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);
  EXPECT_EQ(encodeRig(readRig(folder / "anna.rig")), *bytes_);
  std::filesystem::create_directory(folder / "folder.rig");
  EXPECT_THROW(readRig(folder / "folder.rig"), InputError);
  EXPECT_THROW(writeRig(folder / "folder.rig", *rig_), std::system_error);
  ASSERT_EQ(mkfifo((folder / "pipe.rig").c_str(), 0600), 0);
  EXPECT_THROW(readRig(folder / "pipe.rig"), InputError);
  EXPECT_THROW(readRig("/dev/zero"), InputError);
}

}  // namespace
}  // namespace volto::rig
