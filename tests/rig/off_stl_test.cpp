// OFF and STL in.
#include <limits>

#include <gtest/gtest.h>

#include "tests/rig/mesh_bytes.h"

namespace volto::rig {
namespace {

using test::bytesOf;

std::string offRefused(const std::string& text) {
  const std::string said = test::complaintOf([&] { parseOff(text, "head.off"); });
  EXPECT_TRUE(said.starts_with("head.off:")) << "'" << said << "' for " << text.substr(0, 100);
  EXPECT_EQ(said.find('\n'), std::string::npos);
  EXPECT_LT(said.size(), 250U) << said;
  return said;
}

const std::string kOff = "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

TEST(Off, KeepsVertexAndPolygonOrder) {
  const Mesh mesh = parseOff("OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 -.5e1\n4 3 2 1 0\n3 0 1 2", "m");
  EXPECT_EQ(mesh.positions.row(3), Eigen::RowVector3d(0, 1, -5));
  EXPECT_EQ(mesh.corner_vertices, (std::vector<std::uint32_t>{3, 2, 1, 0, 0, 1, 2}));
}

// The cases of the reliability notes, in their order.
TEST(Off, ImpossibleCountsAreRefusedBeforeAllocating) {
  for (const char* counts :
       {"999999999 1 0", "3 999999999 0", "3 18446744073709551615 0", "1000000000000 1 0", "-3 1 0"})
    EXPECT_NE(offRefused(replaced(kOff, "3 1 0", counts)).find(":2: "), std::string::npos) << counts;
}

TEST(Off, OtherKindsAreNamedAsNotSupported) {
  for (const char* magic : {"COFF", "NOFF", "CNOFF", "STOFF", "4OFF", "nOFF", "4nOFF", "OFF BINARY"})
    EXPECT_NE(offRefused(replaced(kOff, "OFF", magic)).find("not supported"), std::string::npos) << magic;
  EXPECT_NE(offRefused("3 1 0\n").find("does not begin with OFF"), std::string::npos);
  EXPECT_NE(offRefused(""), "");
  EXPECT_NE(offRefused("OFF off\n"), "");
}

TEST(Off, CountsMayStandOnTheFirstLineOrAfterComments) {
  EXPECT_EQ(parseOff(replaced(kOff, "OFF\n", "OFF "), "m").vertexCount(), 3U);
  EXPECT_EQ(parseOff(replaced(kOff, "OFF\n", "# made by hand\nOFF # here\n\n# counts\n"), "m").vertexCount(), 3U);
  EXPECT_EQ(parseOff(replaced(kOff, "3 1 0", "3 1"), "m").vertexCount(), 3U) << "nobody needs the number of edges";
}

TEST(Off, LongCommentIsNoTrouble) {
  EXPECT_EQ(parseOff(replaced(kOff, "OFF\n", "OFF\n#" + std::string(200'000, 'x') + "\n"), "m").vertexCount(), 3U);
}

TEST(Off, DamagedFaceIsRefusedWithItsLine) {
  for (const char* face :
       {"-3 0 1 2", "3 0 1", "3 0 1 3", "3 0 1 -1", "2 0 1", "0 # no corner", "5000 0 1 2", "3 0 1 x", "3 0 1 1.5"})
    EXPECT_NE(offRefused(replaced(kOff, "3 0 1 2", face)).find(":6: "), std::string::npos) << face;
}

TEST(Off, ColoursOfFacesArePassedOver) {
  EXPECT_EQ(parseOff(replaced(kOff, "3 0 1 2", "3 0 1 2 255 0 0.5"), "m").corner_vertices.size(), 3U);
}

TEST(Off, EndInsideAListIsRefused) {
  for (std::size_t n = 0; n + 3 < kOff.size(); ++n) EXPECT_NE(offRefused(kOff.substr(0, n)), "") << n;
}

TEST(Off, NumbersThatAreNoneAreRefused) {
  for (const char* bad : {"0x10", "1,5", "nan", "inf", "1e999", "1.2.3", "-"})
    EXPECT_NE(offRefused(replaced(kOff, "1 0 0", std::string(bad) + " 0 0")).find(":4: "), std::string::npos) << bad;
  EXPECT_NE(offRefused(replaced(kOff, "1 0 0", "1 0")), "");
  EXPECT_NE(offRefused(replaced(kOff, "1 0 0", "1 0 0 255 0 0")), "") << "that would be COFF";
}

TEST(Off, NothingToRigIsRefused) {
  EXPECT_NE(offRefused("OFF\n0 0 0\n").find("no vertices"), std::string::npos);
  EXPECT_NE(offRefused(replaced(kOff, "3 1 0", "3 0 0")).find("without faces"), std::string::npos);
}

TEST(Off, TextAfterTheLastFaceIsNoted) {
  const Mesh mesh = parseOff(kOff + "3 2 1 0\n", "m.off");
  ASSERT_EQ(mesh.notes.size(), 1U);
  EXPECT_EQ(mesh.notes[0], "m.off:7: text after the last face; passed over");
}

TEST(Off, ControlCharactersAreRefused) {
  EXPECT_NE(offRefused(replaced(kOff, "1 0 0", std::string("1\0 0 0", 6))), "");
}

// --- STL ---

std::string stlRefused(const std::string& bytes) {
  const std::string said = test::complaintOf([&] { parseStl(bytes, "head.stl"); });
  EXPECT_TRUE(said.starts_with("head.stl:")) << "'" << said << "'";
  EXPECT_EQ(said.find('\n'), std::string::npos);
  return said;
}

std::string binaryStl(const Mesh& mesh, const std::string& title = "made by hand") {
  std::string out = title + std::string(80 - title.size(), ' ');
  out += bytesOf(static_cast<std::uint32_t>(mesh.polygonCount()));
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    for (int i = 0; i < 3; ++i) out += bytesOf(0.0F);
    for (int c = 0; c < 3; ++c)
      for (int axis = 0; axis < 3; ++axis)
        out += bytesOf(
            static_cast<float>(mesh.positions(mesh.corner_vertices[3 * p + static_cast<std::size_t>(c)], axis)));
    out += std::string(2, '\0');
  }
  return out;
}
std::string asciiStl(const Mesh& mesh) {
  std::string out = "solid by hand\n";
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    out += "  facet normal nan 0 0\n    outer loop\n";
    for (int c = 0; c < 3; ++c) {
      out += "      vertex";
      for (int axis = 0; axis < 3; ++axis)
        out += " " + std::to_string(mesh.positions(mesh.corner_vertices[3 * p + static_cast<std::size_t>(c)], axis));
      out += "\n";
    }
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid by hand\n";
}

TEST(Stl, EqualCornersBecomeOneVertexAndTrianglesKeepTheirOrder) {
  const Mesh wanted = test::tetrahedron();
  for (const std::string& bytes : {binaryStl(wanted), binaryStl(wanted, "solid but binary"), asciiStl(wanted)}) {
    const Mesh mesh = parseStl(bytes, "m");
    EXPECT_EQ(mesh.vertexCount(), 4U) << "the unused vertex is not in the file";
    ASSERT_EQ(mesh.polygonCount(), 4U);
    for (std::size_t c = 0; c < 12; ++c)
      EXPECT_EQ(mesh.positions.row(mesh.corner_vertices[c]), wanted.positions.row(wanted.corner_vertices[c])) << c;
  }
}

TEST(Stl, SizeThatDoesNotFitIsRefused) {
  const std::string whole = binaryStl(test::tetrahedron());
  for (std::size_t n = 0; n < whole.size(); ++n) EXPECT_NE(stlRefused(whole.substr(0, n)), "") << n;
  std::string lying = whole;
  lying.replace(80, 4, bytesOf(std::uint32_t{0xFFFFFFFF}));
  EXPECT_NE(stlRefused(lying).find("4294967295 triangles need"), std::string::npos);
  EXPECT_EQ(parseStl(whole + "!", "m").notes.size(), 1U);
  lying.replace(80, 4, bytesOf(std::uint32_t{0}));
  EXPECT_NE(stlRefused(lying), "");
}

TEST(Stl, CornerThatIsNotFiniteIsRefused) {
  std::string bytes = binaryStl(test::tetrahedron());
  bytes.replace(84 + 50 + 12, 4, bytesOf(std::numeric_limits<float>::infinity()));
  EXPECT_EQ(stlRefused(bytes), "head.stl: @146: triangle 1 has a corner that is not finite");
  const std::string text = asciiStl(test::tetrahedron());
  EXPECT_NE(stlRefused(replaced(text, "vertex 0.000000", "vertex nan")), "");
  EXPECT_NE(stlRefused(replaced(text, "endloop", "vertex 0 0 0")), "");
  EXPECT_NE(stlRefused(replaced(text, "outer loop", "outer hoop")), "");
  EXPECT_NE(stlRefused("solid nothing\nendsolid\n").find("without faces"), std::string::npos);
  for (std::size_t n = 0; n < text.size() - 22; n += 7) {
    // Cut between facets it is a smaller mesh; inside one it is refused.
    const std::string cut = text.substr(0, n);
    if (cut.find("facet") == std::string::npos) {
      EXPECT_NE(stlRefused(cut), "") << n;
    }
  }
}

}  // namespace
}  // namespace volto::rig
