// PLY in: every encoding, and every way a file can be wrong gives one line that says where.
#include <limits>

#include <gtest/gtest.h>

#include "tests/rig/mesh_bytes.h"

namespace volto::rig {
namespace {

using test::bytesOf;

const std::string kHeader =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
const std::string kBody = "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

std::string complaint(const std::string& bytes) {
  const std::string said = test::complaintOf([&] { parsePly(bytes, "head.ply"); });
  EXPECT_EQ(said.find('\n'), std::string::npos) << "one line";
  EXPECT_LT(said.size(), 250U) << said;
  return said;
}
std::string refused(const std::string& bytes) {
  const std::string said = complaint(bytes);
  EXPECT_TRUE(said.starts_with("head.ply:")) << "'" << said << "' for " << bytes.substr(0, 300);
  return said;
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

// A triangle and a quad in binary: double positions, colours, list counts and indices of any type.
template <typename Count, typename Index>
std::string binary(bool big, const char* count_name, const char* index_name) {
  std::string out = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                    "_endian 1.0\ncomment made by hand\n" +
                    "element vertex 4\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\n"
                    "property uchar green\nproperty uchar blue\nelement face 2\nproperty list " +
                    count_name + " " + index_name + " vertex_index\nend_header\n";
  for (int v = 0; v < 4; ++v) {
    for (const double x : {0.1 * v, -1.0 * v, 1e-3}) out += bytesOf(x, big);
    out += std::string("\xFF\x00\x80", 3);
  }
  out += bytesOf(Count{3}, big) + bytesOf(Index{2}, big) + bytesOf(Index{1}, big) + bytesOf(Index{0}, big);
  out += bytesOf(Count{4}, big);
  for (const int i : {0, 1, 2, 3}) out += bytesOf(static_cast<Index>(i), big);
  return out;
}

void expectHandMade(const Mesh& mesh) {
  ASSERT_EQ(mesh.vertexCount(), 4U);
  EXPECT_EQ(mesh.positions.row(3), Eigen::RowVector3d(0.1 * 3, -3, 1e-3));
  EXPECT_EQ(mesh.corner_vertices, (std::vector<std::uint32_t>{2, 1, 0, 0, 1, 2, 3}));
  EXPECT_EQ(mesh.polygon_start, (std::vector<std::uint32_t>{0, 3, 7}));
  ASSERT_EQ(mesh.vertex_colours.size(), 4U);
  EXPECT_EQ(mesh.vertex_colours[1][0], 1.0F);
  EXPECT_EQ(mesh.vertex_colours[1][1], 0.0F);
  EXPECT_NEAR(mesh.vertex_colours[1][2], 0.2158F, 1e-3) << "128 on a screen is a fifth of the light";
}

TEST(Ply, AsciiKeepsVertexAndPolygonOrder) {
  const Mesh mesh = parsePly(replaced(kHeader, "face 1", "face 2") + kBody + "3 2 1 0\n", "m");
  EXPECT_EQ(mesh.positions.row(1), Eigen::RowVector3d(1, 0, 0));
  EXPECT_EQ(mesh.corner_vertices, (std::vector<std::uint32_t>{0, 1, 2, 2, 1, 0}));
  EXPECT_TRUE(mesh.notes.empty());
}

TEST(Ply, BinaryOfEitherByteOrderAndAnyIntegerTypeIsRead) {
  for (const bool big : {false, true}) {
    expectHandMade(parsePly(binary<std::uint8_t, std::int32_t>(big, "uchar", "int"), "m"));
    expectHandMade(parsePly(binary<std::int32_t, std::uint16_t>(big, "int", "ushort"), "m"));
    expectHandMade(parsePly(binary<std::uint16_t, std::uint32_t>(big, "uint16", "uint32"), "m"));
    expectHandMade(parsePly(binary<std::int8_t, std::int8_t>(big, "int8", "char"), "m"));
  }
}

// The cases of the reliability notes, in their order.
TEST(Ply, CountsThatTheFileIsTooShortForAreRefusedBeforeAllocating) {
  EXPECT_EQ(
      refused(replaced(kHeader, "vertex 3", "vertex 4000000000") + kBody),
      "head.ply: element vertex needs at least 24000000000 bytes, the file has 26 left; the header is wrong or the "
      "file is cut");
  EXPECT_NE(refused(replaced(kHeader, "face 1", "face 2000000000") + kBody).find("element face needs"),
            std::string::npos);
  EXPECT_NE(refused(replaced(kHeader, "vertex 3", "vertex 18446744073709551615") + kBody).find("2^64"),
            std::string::npos);
}

TEST(Ply, CountsThatAreNoneAreRefused) {
  for (const char* count : {"-1", "9223372036854775808000", "3.0", "three", "0x3", ""})
    EXPECT_NE(refused(replaced(kHeader, "vertex 3", std::string("vertex ") + count) + kBody).find(":3: "),
              std::string::npos)
        << count;
  EXPECT_NE(refused(replaced(kHeader, "vertex 3", "vertex 0") + kBody).find("no vertices"), std::string::npos);
  EXPECT_NE(refused(replaced(kHeader, "face 1", "face 0") + kBody).find("without faces"), std::string::npos);
}

TEST(Ply, ListsOfZeroOneAndTwoCornersAreRefusedAndLongOnesRead) {
  for (const char* face : {"0\n", "1 0\n", "2 0 1\n", "-3 0 1 2\n", "5000 0 1 2\n"})
    EXPECT_NE(refused(replaced(kHeader + kBody, "3 0 1 2\n", face)), "") << face;
  std::string many = "255";
  for (int i = 0; i < 255; ++i) many += " " + std::to_string(i % 3);
  EXPECT_EQ(parsePly(replaced(kHeader + kBody, "3 0 1 2", many), "m").corner_vertices.size(), 255U);
  EXPECT_NE(refused(replaced(kHeader, "list uchar int", "list float int") + kBody).find("count of a list"),
            std::string::npos);
  EXPECT_NE(refused(replaced(kHeader, "list uchar int", "list uchar float") + kBody), "");
}

TEST(Ply, HeaderWithoutEndOrWithoutMeasureIsRefused) {
  EXPECT_NE(refused(replaced(kHeader, "end_header\n", "")).find("end_header"), std::string::npos);
  EXPECT_NE(refused("ply\nformat ascii 1.0\n" + std::string(3'000'000, '\n')), "");
  std::string long_header = "ply\nformat ascii 1.0\n";
  for (int i = 0; i < 1'000'000; ++i) long_header += "comment\n";
  EXPECT_NE(refused(long_header), "");
  EXPECT_NE(refused(""), "");
  EXPECT_NE(refused("solid\n"), "");
  EXPECT_NE(refused(replaced(kHeader, "end_header\n", "end_header")), "");
}

TEST(Ply, BinaryCutAnywhereIsRefusedWithItsByte) {
  const std::string whole = binary<std::uint8_t, std::int32_t>(false, "uchar", "int");
  const std::size_t header = whole.find("end_header\n") + 11;
  for (std::size_t n = 0; n < whole.size(); ++n) EXPECT_NE(refused(whole.substr(0, n)), "") << n;
  EXPECT_NE(refused(whole.substr(0, whole.size() - 1)).find("@" + std::to_string(whole.size() - 16)), std::string::npos)
      << "after the last count";
  EXPECT_LT(header, whole.size());
}

TEST(Ply, OtherVersionsAndFormatsAreRefused) {
  EXPECT_NE(refused(replaced(kHeader, "ascii 1.0", "ascii 2.0") + kBody).find(":2: "), std::string::npos);
  EXPECT_NE(refused(replaced(kHeader, "format ascii 1.0", "format binary 1.0") + kBody), "");
  EXPECT_NE(refused(replaced(kHeader, "format ascii 1.0\n", "") + kBody).find("format"), std::string::npos);
  EXPECT_NE(refused(replaced(kHeader, "format ascii 1.0\n", "format ascii 1.0\nformat ascii 1.0\n") + kBody), "");
}

TEST(Ply, PropertiesThatCannotBeAreRefused) {
  EXPECT_NE(refused(replaced(kHeader, "float x", "quad x") + kBody).find("'quad'"), std::string::npos);
  EXPECT_NE(refused(replaced(kHeader, "float y", "float x") + kBody).find("second time"), std::string::npos);
  EXPECT_NE(refused(replaced(kHeader, "float x", "float w") + kBody).find("no property x"), std::string::npos);
  EXPECT_NE(refused(replaced(kHeader, "property list uchar int vertex_indices\n", "property int a\n") + kBody), "");
  EXPECT_NE(refused("ply\nformat ascii 1.0\nproperty float x\n"), "");
  EXPECT_NE(refused(replaced(kHeader, "element face", "element vertex") + kBody), "");
  EXPECT_NE(refused(replaced(kHeader, "element face", "elephant face") + kBody), "");
}

TEST(Ply, AsciiRowWithTooFewValuesIsRefusedAndWithTooManyNoted) {
  EXPECT_EQ(refused(replaced(kHeader + kBody, "1 0 0", "1 0")), "head.ply:11: vertex 1 has too few values");
  EXPECT_NE(refused(replaced(kHeader + kBody, "3 0 1 2", "3 0 1")), "");
  EXPECT_NE(refused(replaced(kHeader + kBody, "3 0 1 2\n", "")), "");
  const Mesh mesh = parsePly(replaced(kHeader + kBody, "1 0 0", "1 0 0 7"), "m.ply");
  ASSERT_EQ(mesh.notes.size(), 1U);
  EXPECT_EQ(mesh.notes[0], "m.ply:11: more values than the header says; passed over");
  EXPECT_EQ(parsePly(kHeader + kBody + "and more\n", "m").notes.size(), 1U);
}

TEST(Ply, FacesMayStandBeforeTheirVertices) {
  const Mesh mesh = parsePly(
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_indices\nproperty float quality\nelement "
      "edge 1\nproperty int a\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
      "3 2 1 0 0.5\n9\n0 0 0\n1 0 0\n0 1 0\n",
      "m");
  EXPECT_EQ(mesh.corner_vertices, (std::vector<std::uint32_t>{2, 1, 0}));
  EXPECT_EQ(mesh.positions.row(2), Eigen::RowVector3d(0, 1, 0));
}

TEST(Ply, IndexOutOfRangeIsRefused) {
  EXPECT_EQ(refused(replaced(kHeader + kBody, "3 0 1 2", "3 0 1 3")),
            "head.ply:13: face 0 names vertex 3, the file has 3, counted from 0");
  EXPECT_NE(refused(replaced(kHeader + kBody, "3 0 1 2", "3 0 1 -1")), "");
  EXPECT_NE(refused(replaced(kHeader + kBody, "3 0 1 2", "3 0 1 4294967296")), "");
  EXPECT_NE(refused(replaced(kHeader + kBody, "3 0 1 2", "3 0 1 1.5")), "");
}

TEST(Ply, PositionThatIsNotFiniteIsRefused) {
  for (const char* bad : {"nan", "inf", "-inf", "1e999", "0x1", "1,5", "--1"})
    EXPECT_NE(refused(replaced(kHeader + kBody, "1 0 0", std::string("1 ") + bad + " 0")), "") << bad;
  std::string bytes = binary<std::uint8_t, std::int32_t>(false, "uchar", "int");
  const std::size_t header = bytes.find("end_header\n") + 11;
  bytes.replace(header + 8, 8, bytesOf(std::numeric_limits<double>::quiet_NaN()));
  EXPECT_NE(refused(bytes).find("vertex 0 has a position that is not finite"), std::string::npos);
}

TEST(Ply, LineEndsOfOtherSystemsAndSurplusBytesAreToldApart) {
  std::string crlf = kHeader + kBody;
  for (std::size_t at = 0; (at = crlf.find('\n', at)) != std::string::npos; at += 2) crlf.replace(at, 1, "\r\n");
  EXPECT_EQ(parsePly(crlf, "m").vertexCount(), 3U);
  const std::string whole = binary<std::uint8_t, std::int32_t>(false, "uchar", "int");
  const Mesh more = parsePly(whole + "\r\n", "m.ply");
  ASSERT_EQ(more.notes.size(), 1U);
  EXPECT_NE(more.notes[0].find("2 bytes after the last element"), std::string::npos);
  // A line end before the data that the header's author did not mean shifts everything: what comes out is refused.
  EXPECT_NE(refused(replaced(whole, "end_header\n", "end_header\n\r\n")), "");
}

TEST(Ply, TextureCoordinatesOfVerticesGoToTheirCorners) {
  const Mesh mesh =
      parsePly(replaced(kHeader, "property float z\n", "property float z\nproperty float s\nproperty float t\n") +
                   "0 0 0 0.5 0.25\n1 0 0 1 0\n0 1 0 0 1\n3 2 1 0\n",
               "m");
  ASSERT_EQ(mesh.corner_texcoords.size(), 3U);
  EXPECT_EQ(mesh.corner_texcoords[2], (std::array<float, 2>{0.5F, 0.25F}));
}

}  // namespace
}  // namespace volto::rig
