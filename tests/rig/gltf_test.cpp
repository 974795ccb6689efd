// glTF and GLB in.
#include <fstream>
#include <sys/stat.h>

#include <gtest/gtest.h>

#include "rig/gltf_skin.h"
#include "tests/rig/mesh_bytes.h"
#include "tests/support/test_data.h"

namespace volto::rig {
namespace {

using test::bytesOf;
using test::glb;

// Three vertices and one triangle (indices 2, 1, 0), with texture coordinates.
std::string triangleBytes() {
  std::string out;
  for (const float x : {0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F}) out += bytesOf(x);
  for (const int i : {2, 1, 0, 0}) out += bytesOf(static_cast<std::uint16_t>(i));
  for (const float x : {0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.75F}) out += bytesOf(x);
  return out;
}
constexpr const char* kViews =
    R"("bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6},{"buffer":0,"byteOffset":44,"byteLength":24}],
       "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"},
                    {"bufferView":2,"componentType":5126,"count":3,"type":"VEC2"}])";
std::string document(const std::string& nodes, const std::string& buffer = R"({"byteLength":68})",
                     const std::string& more = "") {
  return R"({"asset":{"version":"2.0"},"buffers":[)" + buffer + "]," + kViews +
         R"(,"meshes":[{"primitives":[{"attributes":{"POSITION":0,"TEXCOORD_0":2},"indices":1,"material":0}]}],)"
         R"("materials":[{"name":"skin","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.25,0.125,1]}}],)"
         R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" +
         nodes + "]" + more + "}";
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
std::string refused(const std::string& bytes, const std::filesystem::path& folder = {}) {
  const std::string said = test::complaintOf([&] { parseGltf(bytes, "head.glb", folder); });
  EXPECT_TRUE(said.starts_with("head.glb: ")) << "'" << said << "' for " << bytes.substr(0, 400);
  EXPECT_EQ(said.find('\n'), std::string::npos);
  EXPECT_LT(said.size(), 300U) << said;
  return said;
}

TEST(Gltf, TriangleWithMaterialAndTextureCoordinates) {
  const Mesh mesh = parseGltf(glb(document(R"({"mesh":0})"), triangleBytes()), "m");
  EXPECT_EQ(mesh.corner_vertices, (std::vector<std::uint32_t>{2, 1, 0}));
  EXPECT_EQ(mesh.positions.row(1), Eigen::RowVector3d(1, 0, 0));
  ASSERT_EQ(mesh.materials.size(), 1U);
  EXPECT_EQ(mesh.materials[0].name, "skin");
  EXPECT_EQ(mesh.materials[0].colour, (std::array<float, 3>{0.5F, 0.25F, 0.125F}));
  EXPECT_EQ(mesh.corner_texcoords[0], (std::array<float, 2>{0.0F, 0.25F})) << "glTF counts v from the top";
}

// The triangle on two bones: a hip at (1, 2, 3), a jaw that stands in the hip by `jaw_bind`, written before it.
std::string skinnedTriangle(const std::array<int, 4>& joints, const std::array<float, 4>& weights,
                            const std::string& skin = R"({"joints":[2,1],"inverseBindMatrices":5})",
                            float diagonal = 1.0F) {
  std::string bytes = triangleBytes();
  for (int v = 0; v < 3; ++v)
    for (const int joint : joints) bytes += static_cast<char>(joint);
  for (int v = 0; v < 3; ++v)
    for (const float weight : weights) bytes += bytesOf(weight);
  for (const std::array<float, 3> at : {std::array{5.0F, 2.0F, 3.0F}, std::array{1.0F, 2.0F, 3.0F}})
    for (int i = 0; i < 16; ++i)
      bytes += bytesOf(i == 15 ? 1.0F : i >= 12 ? -diagonal * at[static_cast<std::size_t>(i - 12)] : i % 5 == 0 ? diagonal : 0.0F);
  std::string text = document(R"({"mesh":0,"skin":0},{"name":"hip","children":[2],"translation":[1,2,3]},{"name":"jaw","translation":[4,0,0]})",
                              R"({"byteLength":256})", R"(,"skins":[)" + skin + "]");
  text = replaced(text, R"("scenes":[{"nodes":[0]}])", R"("scenes":[{"nodes":[0,1]}])");
  text = replaced(text, R"("TEXCOORD_0":2)", R"("TEXCOORD_0":2,"JOINTS_0":3,"WEIGHTS_0":4)");
  text = replaced(text, R"({"buffer":0,"byteOffset":44,"byteLength":24}])",
                  R"({"buffer":0,"byteOffset":44,"byteLength":24},{"buffer":0,"byteOffset":68,"byteLength":12},)"
                  R"({"buffer":0,"byteOffset":80,"byteLength":48},{"buffer":0,"byteOffset":128,"byteLength":128}])");
  text = replaced(text, R"({"bufferView":2,"componentType":5126,"count":3,"type":"VEC2"}])",
                  R"({"bufferView":2,"componentType":5126,"count":3,"type":"VEC2"},{"bufferView":3,"componentType":5121,"count":3,"type":"VEC4"},)"
                  R"({"bufferView":4,"componentType":5126,"count":3,"type":"VEC4"},{"bufferView":5,"componentType":5126,"count":2,"type":"MAT4"}])");
  return glb(text, bytes);
}

TEST(Gltf, ASkinIsItsBonesAndWhatHangsOnThem) {
  const GltfSkin skin = parseGltfSkin(skinnedTriangle({0, 1, 0, 0}, {0.5F, 1.5F, 0.0F, 0.0F}), "m");
  ASSERT_EQ(skin.joints.size(), 2U);
  EXPECT_EQ(skin.joints[0].name, "hip");
  EXPECT_EQ(skin.joints[0].parent, -1);
  EXPECT_EQ(skin.joints[0].mesh_from_joint.translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(skin.joints[1].name, "jaw");
  EXPECT_EQ(skin.joints[1].parent, 0);
  EXPECT_EQ(skin.joints[1].mesh_from_joint.translation(), Eigen::Vector3d(5, 2, 3));
  ASSERT_EQ(skin.joint.size(), 3U);
  for (std::size_t v = 0; v < 3; ++v) {
    EXPECT_EQ(skin.joint[v][0], 1) << "the file's first joint is the jaw, which comes after its parent here";
    EXPECT_EQ(skin.joint[v][1], 0);
    EXPECT_EQ(skin.weight[v], (std::array<float, 4>{0.25F, 0.75F, 0.0F, 0.0F})) << "they add up to 1";
  }
  EXPECT_TRUE(parseGltfSkin(glb(document(R"({"mesh":0})"), triangleBytes()), "m").joints.empty());
}

TEST(Gltf, DamagedSkinsAreRefused) {
  const auto refusedSkin = [](const std::string& bytes) {
    return test::complaintOf([&] { parseGltfSkin(bytes, "head.glb"); });
  };
  EXPECT_NE(refusedSkin(skinnedTriangle({7, 0, 0, 0}, {1, 0, 0, 0})).find("a joint that the skin has not"), std::string::npos);
  EXPECT_EQ(refusedSkin(skinnedTriangle({7, 0, 0, 0}, {0, 1, 0, 0})), "") << "it carries nothing";
  EXPECT_NE(refusedSkin(skinnedTriangle({0, 0, 0, 0}, {-1, 0, 0, 0})).find("weight below 0"), std::string::npos);
  EXPECT_NE(refusedSkin(skinnedTriangle({0, 0, 0, 0}, {1, 0, 0, 0}, R"({"joints":[2,1],"inverseBindMatrices":5})", 0.0F))
                .find("has no inverse"),
            std::string::npos);
  EXPECT_NE(refusedSkin(skinnedTriangle({0, 0, 0, 0}, {1, 0, 0, 0}, R"({"joints":[9,1]})")).find("node 9, which does not exist"),
            std::string::npos);
  EXPECT_NE(refusedSkin(skinnedTriangle({0, 0, 0, 0}, {1, 0, 0, 0}, R"({"joints":[0,1,2],"inverseBindMatrices":5})"))
                .find("fewer bind matrices than joints"),
            std::string::npos);
}

TEST(Gltf, TransformsOfNodesAreAppliedInOrder) {
  // Parent: moved by (10, 0, 0) and turned a quarter about z; child: twice as large. A second use of the mesh,
  // mirrored.
  const std::string nodes =
      R"({"children":[1,2],"translation":[10,0,0],"rotation":[0,0,0.70710678118654752,0.70710678118654752]},
         {"mesh":0,"scale":[2,2,2]},{"mesh":0,"matrix":[-1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,5,1]})";
  const Mesh mesh = parseGltf(glb(document(nodes), triangleBytes()), "m");
  ASSERT_EQ(mesh.vertexCount(), 6U);
  EXPECT_TRUE(mesh.positions.row(1).isApprox(Eigen::RowVector3d(10, 2, 0), 1e-9)) << mesh.positions.row(1);
  EXPECT_TRUE(mesh.positions.row(2).isApprox(Eigen::RowVector3d(8, 0, 0), 1e-9)) << mesh.positions.row(2);
  EXPECT_TRUE(mesh.positions.row(4).isApprox(Eigen::RowVector3d(10, -1, 5), 1e-9)) << mesh.positions.row(4);
  EXPECT_EQ(mesh.corner_vertices, (std::vector<std::uint32_t>{2, 1, 0, 5, 3, 4}))
      << "mirrored faces still look outwards";
}

TEST(Gltf, SparseAndQuantizedAccessorsAreRead) {
  // Positions: none stored, two changed; as unsigned bytes of 0..1.
  std::string bytes =
      bytesOf<std::uint16_t>(1) + bytesOf<std::uint16_t>(2) + std::string("\xFF\x00\x00\x00\x33\x00", 6);
  bytes += std::string("\x02\x01\x00", 3);
  const std::string json =
      R"({"asset":{"version":"2.0"},"extensionsRequired":["KHR_mesh_quantization"],"buffers":[{"byteLength":13}],
         "bufferViews":[{"buffer":0,"byteLength":4},{"buffer":0,"byteOffset":4,"byteLength":6},{"buffer":0,"byteOffset":10,"byteLength":3}],
         "accessors":[{"componentType":5121,"normalized":true,"count":3,"type":"VEC3","sparse":{"count":2,"indices":{"bufferView":0,"componentType":5123},"values":{"bufferView":1}}},
                      {"bufferView":2,"componentType":5121,"count":3,"type":"SCALAR"}],
         "meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}]})";
  const Mesh mesh = parseGltf(glb(json, bytes), "m");
  EXPECT_EQ(mesh.positions.row(0), Eigen::RowVector3d(0, 0, 0));
  EXPECT_EQ(mesh.positions.row(1), Eigen::RowVector3d(1, 0, 0));
  EXPECT_EQ(mesh.positions.row(2), Eigen::RowVector3d(0, 0.2, 0));
  EXPECT_NE(refused(glb(replaced(json, R"("sparse":{"count":2)", R"("sparse":{"count":9)"), bytes)), "");
  EXPECT_NE(refused(glb(json, std::string("\2\0\1\0", 4) + bytes.substr(4))).find("out of order"), std::string::npos);
}

TEST(Gltf, StripsAndFansAreCutAndLinesPassedOver) {
  const std::string json = document(R"({"mesh":0})");
  const auto withMode = [&](int mode) {
    return glb(replaced(json, R"("material":0)", R"("mode":)" + std::to_string(mode)), triangleBytes());
  };
  EXPECT_EQ(parseGltf(withMode(5), "m").polygonCount(), 1U);
  EXPECT_EQ(parseGltf(withMode(6), "m").polygonCount(), 1U);
  EXPECT_NE(refused(withMode(1)).find("points and lines"), std::string::npos);
}

TEST(Gltf, BuffersBesideTheFileAreReadAndNoOthers) {
  const test::TemporaryDir folder;
  std::filesystem::create_directories(folder / "model/parts");
  for (const char* name : {"outside.bin", "model/in side.bin", "model/parts/deep.bin"})
    std::ofstream(folder / name, std::ios::binary) << triangleBytes();
  std::filesystem::create_symlink(folder / "outside.bin", folder / "model/link.bin");
  std::filesystem::create_directory_symlink(folder.path(), folder / "model/up");
  ASSERT_EQ(mkfifo((folder / "model/pipe.bin").c_str(), 0600), 0);
  const auto open = [&](const std::string& uri) {
    std::ofstream(folder / "model/head.gltf") << document(R"({"mesh":0})", R"({"byteLength":68,"uri":")" + uri + "\"}");
    return test::complaintOf([&] { readMesh(folder / "model/head.gltf"); });
  };
  EXPECT_EQ(open("in%20side.bin"), "");
  EXPECT_EQ(open("parts/deep.bin"), "");
  const std::string absolute = (folder / "outside.bin").string();
  for (const char* uri : {"../outside.bin", "parts/../../outside.bin", absolute.c_str(), "file:///etc/passwd",
                          "%2e%2e/outside.bin", "link.bin", "up/outside.bin", "pipe.bin", "http://example.org/a.bin",
                          "", ".", "parts", "absent.bin", "a\\\\b.bin"})
    EXPECT_NE(open(uri), "") << uri;
  EXPECT_NE(refused(document(R"({"mesh":0})", R"({"byteLength":68,"uri":"a.bin"})")).find("not opened"),
            std::string::npos)
      << "bytes without a folder";
}

TEST(Gltf, DataUriIsDecoded) {
  // 68 bytes of zero but one number: enough to see that the decoder places them.
  std::string base64(92, 'A');
  base64.replace(16, 4, "AACA");  // bytes 12..14: 00 00 80
  base64.replace(20, 4, "PwAA");  // bytes 15..17: 3f 00 00
  base64[91] = '=';
  const std::string json =
      document(R"({"mesh":0})", R"({"byteLength":68,"uri":"data:application/octet-stream;base64,)" + base64 + "\"}");
  const Mesh mesh = parseGltf(replaced(json, R"("indices":1,)", ""), "m");
  EXPECT_EQ(mesh.positions(1, 0), 1.0);
  EXPECT_NE(refused(replaced(json, "AAAA", "A*AA")).find("base64"), std::string::npos);
}

TEST(Gltf, ImagesAreNeitherOpenedNorNeeded) {
  const std::string more =
      R"(,"images":[{"uri":"../../etc/passwd"},{"bufferView":99,"mimeType":"image/png"}],"textures":[{"source":0}])";
  const std::string json = replaced(document(R"({"mesh":0})", R"({"byteLength":68})", more),
                                    R"("baseColorFactor":[0.5,0.25,0.125,1])", R"("baseColorTexture":{"index":0})");
  const Mesh mesh = parseGltf(glb(json, triangleBytes()), "m");
  EXPECT_EQ(mesh.materials[0].colour, Mesh::Material{}.colour) << "its colour is in the image, so it has none";
}

TEST(Gltf, DamagedFilesAreRefused) {
  const std::string good = document(R"({"mesh":0})");
  const std::string bytes = triangleBytes();
  ASSERT_EQ(test::complaintOf([&] { parseGltf(glb(good, bytes), "m"); }), "");
  const std::pair<const char*, const char*> changes[] = {
      {R"("count":3,"type":"VEC3")", R"("count":4,"type":"VEC3")"},
      {R"("count":3,"type":"VEC3")", R"("count":4000000000,"type":"VEC3")"},
      {R"("count":3,"type":"VEC3")", R"("count":-3,"type":"VEC3")"},
      {R"("count":3,"type":"SCALAR")", R"("count":2,"type":"SCALAR")"},
      {R"("type":"VEC3")", R"("type":"VEC2")"},
      {R"("type":"VEC3")", R"("type":"CAR")"},
      {R"("componentType":5126)", R"("componentType":9)"},
      {R"("byteLength":36)", R"("byteLength":3600)"},
      {R"("byteLength":36)", R"("byteLength":36,"byteOffset":18446744073709551600)"},
      {R"("byteLength":36)", R"("byteLength":36,"byteStride":4)"},
      {R"("buffer":0)", R"("buffer":7)"},
      {R"("bufferView":0)", R"("bufferView":7)"},
      {R"("POSITION":0)", R"("POSITION":9)"},
      {R"("POSITION":0)", R"("POSITION":-1)"},
      {R"("POSITION":0,)", ""},
      {R"("indices":1)", R"("indices":0)"},
      {R"("indices":1)", R"("indices":77)"},
      {R"("mesh":0})", R"("mesh":8})"},
      {R"("mesh":0})", R"("children":[0]})"},
      {R"("mesh":0})", R"("mesh":0,"children":[5]})"},
      {R"("mesh":0})", R"("mesh":0,"matrix":[1,2]})"},
      {R"("mesh":0})", R"("mesh":0,"rotation":[0,0,0,0]})"},
      {R"("mesh":0})", R"("mesh":0,"scale":[1e400,1,1]})"},
      {R"("material":0)", R"("material":3)"},
      {R"("version":"2.0")", R"("version":"1.0")"},
      {R"("nodes":[0])", R"("nodes":[0,0])"},
      {R"("scene":0)", R"("scene":5)"},
      {R"({"byteLength":68})", R"({"byteLength":6800})"},
      {R"({"byteLength":68})", R"({"byteLength":68,"uri":"data:,x"})"},
      {R"({"byteLength":68})", R"(7)"},
      {R"("asset")", R"("extensionsRequired":["KHR_draco_mesh_compression"],"asset")"},
      {R"("asset")", R"("asset":)"},
  };
  for (const auto& [from, to] : changes)
    EXPECT_NE(refused(glb(replaced(good, from, to), bytes)), "") << from << " -> " << to;
  std::string nan = bytes;
  nan.replace(12, 4, bytesOf(0x7FC00000U));
  EXPECT_NE(refused(glb(good, nan)).find("not finite"), std::string::npos);
  std::string index = bytes;
  index.replace(36, 2, bytesOf<std::uint16_t>(3));
  EXPECT_NE(refused(glb(good, index)).find("names vertex 3"), std::string::npos);
}

TEST(Gltf, DamagedContainersAreRefused) {
  const std::string whole = glb(document(R"({"mesh":0})"), triangleBytes());
  for (std::size_t n = 0; n < whole.size(); n += 3) EXPECT_NE(refused(whole.substr(0, n)), "") << n;
  EXPECT_NE(refused(std::string(whole).replace(4, 4, bytesOf(1U))).find("GLB version 1"), std::string::npos);
  EXPECT_NE(refused(std::string(whole).replace(12, 4, bytesOf(0xFFFFFFF0U))).find("reaches beyond"), std::string::npos);
  EXPECT_NE(refused(std::string(whole).replace(16, 4, "NOSJ")), "");
  EXPECT_NE(refused("{\"a\":" + std::string(100'000, '[') + std::string(100'000, ']') + "}").find("deeper than 64"),
            std::string::npos);
  EXPECT_NE(refused("{}"), "");
  EXPECT_NE(refused("[1,2]"), "");
  EXPECT_NE(refused("{\"asset\":{\"version\":\"2.0\"}}").find("without faces"), std::string::npos);
  EXPECT_NE(refused(std::string("{\"asset\":{\"version\":\"2.0\"},\"x\":\"\xFF\xFE\"}")), "");
}

TEST(Gltf, VerticesThatSayWhichTheyWereArePutBackTogether) {
  // Four vertices in the file: 0 and 3 are the same one of the artist's, cut at a seam.
  std::string bytes;
  for (const float x : {0.0F, 0.0F, 5.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 5.0F}) bytes += bytesOf(x);
  for (const float x : {2.0F, 0.0F, 1.0F, 2.0F}) bytes += bytesOf(x);
  for (const int i : {0, 1, 2, 3, 2, 1}) bytes += bytesOf(static_cast<std::uint16_t>(i));
  const std::string json =
      R"({"asset":{"version":"2.0"},"buffers":[{"byteLength":76}],"bufferViews":[{"buffer":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":16},{"buffer":0,"byteOffset":64,"byteLength":12}],
         "accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},{"bufferView":1,"componentType":5126,"count":4,"type":"SCALAR"},{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}],
         "meshes":[{"primitives":[{"attributes":{"POSITION":0,"_VOLTO_VERTEX":1},"indices":2}]}]})";
  const Mesh mesh = parseGltf(glb(json, bytes), "m");
  ASSERT_EQ(mesh.vertexCount(), 3U);
  EXPECT_EQ(mesh.corner_vertices, (std::vector<std::uint32_t>{2, 0, 1, 2, 1, 0}));
  EXPECT_EQ(mesh.positions.row(2), Eigen::RowVector3d(0, 0, 5));
  // One that lies is taken as the file's own order.
  EXPECT_EQ(parseGltf(glb(json, bytes.replace(48, 4, bytesOf(0.0F))), "m").vertexCount(), 4U);
}

// Two triangles' worth of bytes: positions, indices, texture coordinates; the positions serve as a target's displacement too.
TEST(Gltf, MorphTargetsAreShapesByTheirNames) {
  std::string text = document(R"({"mesh":0,"scale":[2,2,2]})");
  text = replaced(text, R"("material":0}])", R"("material":0,"targets":[{"POSITION":0},{"POSITION":0,"NORMAL":0},{}]}],"extras":{"targetNames":["smile","open"]})");
  const ShapedMesh read = parseGltfShapes(glb(text, triangleBytes()), "m");
  EXPECT_EQ(read.names, (std::vector<std::string>{"smile", "open", "target 2"}));
  ASSERT_EQ(read.positions.size(), 3U);
  EXPECT_EQ(read.positions[0], VertexPositions(2 * read.mesh.positions)) << "the node's scale counts for displacements too";
  EXPECT_EQ(read.positions[1], read.positions[0]);
  EXPECT_EQ(read.positions[2], read.mesh.positions);
}

TEST(Gltf, MorphTargetsThatAreNoneAreRefused) {
  const auto shapes = [](const std::string& text) {
    return test::complaintOf([&] { parseGltfShapes(glb(text, triangleBytes()), "head.glb"); });
  };
  const std::string whole = document(R"({"mesh":0})");
  EXPECT_EQ(shapes(whole), "head.glb: has no morph targets; export it with its shape keys");
  const auto with = [&](const std::string& targets, const std::string& names) {
    return replaced(whole, R"("material":0}])", R"("material":0,"targets":)" + targets + R"(}],"extras":{"targetNames":)" + names + "}");
  };
  EXPECT_NE(shapes(with(R"([{"POSITION":0},{"POSITION":0}])", R"(["a","a"])")).find("are called 'a'"), std::string::npos);
  EXPECT_NE(shapes(with(R"([{"POSITION":2}])", R"(["a"])")).find("does not hold 3 numbers"), std::string::npos);
  EXPECT_NE(shapes(with(R"([{"POSITION":-1}])", R"(["a"])")).find("no accessor"), std::string::npos);
  EXPECT_NE(shapes(with(R"([7])", R"(["a"])")).find("no object"), std::string::npos);
}

}  // namespace
}  // namespace volto::rig
