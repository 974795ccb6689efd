// OFF (Geomview's object file format), the ASCII kind: OFF, counts, vertices, faces, each with an optional colour.
#include "rig/mesh_builder.h"
#include "rig/mesh_io.h"
#include "rig/mesh_limits.h"
#include "rig/text_scanner.h"

namespace volto::rig {
namespace {

class OffParser {
 public:
  OffParser(std::string_view text, const std::string& name) : text_(text, name, '#'), name_(name) {}

  Mesh parse() {
    magic();
    counts();
    for (std::size_t v = 0; v < vertices_; ++v) vertex(v);
    mesh_.polygon_start.push_back(0);
    for (std::size_t f = 0; f < faces_; ++f) face(f);
    if (text_.nextWord())
      notes_.add(name_ + ":" + std::to_string(text_.line()) + ": text after the last face; passed over");
    mesh_.notes = notes_.take();
    return std::move(mesh_);
  }

 private:
  void magic() {
    if (!text_.nextWord()) text_.fail("an empty file; is this an OFF mesh?");
    const std::string_view word = text_.word();
    if (word == "OFF") {
      if (text_.wordOnLine() && !startsNumber()) {
        const std::string_view next = text_.word();
        text_.fail(next == "BINARY" ? std::string("binary OFF is not supported; write the mesh as ASCII OFF or PLY")
                                    : inQuotes(next) + " after OFF; counts were expected");
      }
      return;
    }
    if (word.ends_with("OFF") && word.size() <= 9)
      text_.fail(inQuotes(word) + " is not supported, only plain OFF; write the mesh as OFF or PLY");
    text_.fail("the file does not begin with OFF; is it an OFF mesh?");
  }
  // A peek at the word that follows: a digit or a sign begins it.
  bool startsNumber() const {
    TextScanner ahead = text_;
    const std::string_view next = ahead.word();
    return !next.empty() && (next[0] == '-' || next[0] == '+' || (next[0] >= '0' && next[0] <= '9'));
  }

  void counts() {
    const auto count = [&](const char* what) {
      if (!text_.nextWord()) text_.fail(std::string("the file ends before the ") + what);
      const std::int64_t value = text_.integer(what);
      if (value < 0) text_.fail(std::string(what) + " cannot be " + std::to_string(value));
      return static_cast<std::uint64_t>(value);
    };
    const std::uint64_t vertices = count("number of vertices"), faces = count("number of faces");
    if (text_.wordOnLine()) count("number of edges");  // nobody reads it
    if (vertices == 0) text_.fail("no vertices; is this an OFF mesh?");
    if (faces == 0) text_.fail("a mesh without faces; nothing can be rigged");
    // The shortest vertex is "0 0 0\n", the shortest face "3 0 1 2\n"; the last line end may be missing.
    const std::uint64_t left = text_.bytesLeft() + 1;
    if (vertices > left / 6 || faces > left / 8 || vertices * 6 + faces * 8 > left)
      text_.fail(std::to_string(vertices) + " vertices and " + std::to_string(faces) + " faces do not fit into the " +
                 std::to_string(left - 1) + " bytes that follow; the counts are wrong or the file is cut");
    if (vertices > kMaxVertices) text_.fail(std::to_string(vertices) + " vertices, more than the limit of 1000000");
    if (faces > kMaxPolygons) text_.fail(std::to_string(faces) + " polygons, more than the limit of 2000000");
    endOfLine("counts");
    vertices_ = static_cast<std::size_t>(vertices);
    faces_ = static_cast<std::size_t>(faces);
    mesh_.positions.resize(static_cast<Eigen::Index>(vertices_), 3);
    mesh_.polygon_start.reserve(faces_ + 1);
    mesh_.corner_vertices.reserve(3 * faces_);
  }

  void vertex(std::size_t v) {
    if (!text_.nextWord())
      text_.fail("the file ends before vertex " + std::to_string(v) + " of " + std::to_string(vertices_));
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (!text_.wordOnLine()) text_.fail("vertex " + std::to_string(v) + " has too few numbers");
      mesh_.positions(static_cast<Eigen::Index>(v), axis) = text_.number("vertex");
    }
    endOfLine("vertex");
  }

  void face(std::size_t f) {
    const auto which = [&] { return "face " + std::to_string(f); };
    if (!text_.nextWord()) text_.fail("the file ends before " + which() + " of " + std::to_string(faces_));
    const std::int64_t corners = text_.integer("number of corners");
    if (corners < 3 || corners > static_cast<std::int64_t>(kMaxPolygonCorners))
      text_.fail(which() + " has " + std::to_string(corners) + " corners; 3 to 4096 are read");
    for (std::int64_t c = 0; c < corners; ++c) {
      if (!text_.wordOnLine())
        text_.fail(which() + " has " + std::to_string(corners) + " corners but names " + std::to_string(c));
      const std::int64_t index = text_.integer("vertex index");
      if (index < 0 || index >= static_cast<std::int64_t>(vertices_))
        text_.fail(which() + " names vertex " + std::to_string(index) + ", the file has " + std::to_string(vertices_) +
                   ", counted from 0");
      mesh_.corner_vertices.push_back(static_cast<std::uint32_t>(index));
    }
    if (mesh_.corner_vertices.size() > kMaxCorners) text_.fail("more than 16000000 polygon corners");
    mesh_.polygon_start.push_back(static_cast<std::uint32_t>(mesh_.corner_vertices.size()));
    text_.endLine();  // what follows is the face's colour
  }

  void endOfLine(const char* what) {
    if (text_.wordOnLine()) text_.fail(std::string(what) + ": unexpected '" + printable(text_.word()) + "'");
    text_.endLine();
  }

  TextScanner text_;
  const std::string& name_;
  std::size_t vertices_ = 0, faces_ = 0;
  Notes notes_;
  Mesh mesh_;
};

}  // namespace

Mesh parseOff(std::string_view text, const std::string& name_for_errors) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  return OffParser(text, name_for_errors).parse();
}

}  // namespace volto::rig
