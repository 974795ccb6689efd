// OBJ in a single pass over the bytes: 53 expressions of a head are read at every transfer, so speed matters here.
#include "rig/obj_reader.h"

#include <charconv>
#include <cmath>
#include <cstring>
#include <string>
#include <unordered_map>

#include "rig/mesh_builder.h"
#include "rig/mesh_io.h"
#include "rig/mesh_limits.h"

namespace volto::rig {
namespace {

constexpr std::size_t kMaxMaterialLibraries = 16;

constexpr std::array<double, 23> kPowersOfTen = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                                 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

bool isDigit(char c) { return c >= '0' && c <= '9'; }

class ObjParser {
 public:
  ObjParser(std::string_view text, const std::string& name)
      : at_(text.data()), end_(text.data() + text.size()), name_(name) {
    if (text.starts_with("\xEF\xBB\xBF")) at_ += 3;
    // A head has about 55 bytes a vertex; a wrong guess costs only a reallocation.
    coordinates_.reserve(std::min(text.size() / 18, 3 * kMaxVertices));
    mesh_.corner_vertices.reserve(std::min(text.size() / 16, kMaxCorners));
    mesh_.polygon_start.reserve(std::min(text.size() / 64, kMaxPolygons) + 1);
    mesh_.polygon_start.push_back(0);
  }

  Mesh parse() {
    while (at_ < end_) {
      ++line_;
      const char* line_start = at_;
      statement();
      if (at_ - line_start > static_cast<std::ptrdiff_t>(kMaxLineBytes)) fail("line longer than 65536 bytes");
    }
    finish();
    return std::move(mesh_);
  }

  std::vector<std::string>& materialLibraries() { return material_libraries_; }

 private:
  [[noreturn]] void fail(const std::string& what) const { failAt(line_, what); }
  [[noreturn]] void failAt(std::size_t line, const std::string& what) const {
    throw InputError(name_ + ":" + std::to_string(line) + ": " + what);
  }

  // Blanks, and a backslash that joins the next line to this one.
  void skipBlanks() {
    while (at_ < end_) {
      if (*at_ == ' ' || *at_ == '\t' || *at_ == '\r') {
        ++at_;
      } else if (*at_ == '\\' && at_ + 1 < end_ &&
                 (at_[1] == '\n' || (at_[1] == '\r' && at_ + 2 < end_ && at_[2] == '\n'))) {
        at_ += at_[1] == '\n' ? 2 : 3;
        ++line_;
      } else {
        return;
      }
    }
  }
  bool atLineEnd() const { return at_ == end_ || *at_ == '\n' || *at_ == '#'; }

  // The rest of the line, which must be text.
  std::string_view restOfLine() {
    const char* start = at_;
    while (at_ < end_ && *at_ != '\n') {
      const auto c = static_cast<unsigned char>(*at_);
      if (c < 0x20 && c != '\t' && c != '\r' && c != '\f' && c != '\v')
        fail("a control character (byte " + std::to_string(c) + "); this is not a text OBJ file");
      if (++at_ - start > static_cast<std::ptrdiff_t>(kMaxLineBytes)) fail("line longer than 65536 bytes");
    }
    std::string_view rest(start, static_cast<std::size_t>(at_ - start));
    if (at_ < end_) ++at_;
    while (!rest.empty() && (rest.back() == ' ' || rest.back() == '\t' || rest.back() == '\r')) rest.remove_suffix(1);
    return rest;
  }

  std::string wordAt(const char* start) const {
    const char* stop = start;
    while (stop < end_ && stop - start < 32 && static_cast<unsigned char>(*stop) > ' ') ++stop;
    std::string word;
    for (const char* c = start; c < stop; ++c) word += static_cast<unsigned char>(*c) < 0x7F ? *c : '?';
    return word;
  }

  // Correctly rounded, like std::from_chars; the short way is exact because mantissa and power are.
  double number(const char* what) {
    skipBlanks();
    const char* start = at_;
    if (atLineEnd()) fail(std::string(what) + " has too few numbers");
    const char* p = at_;
    const bool negative = p < end_ && *p == '-';
    if (p < end_ && (*p == '-' || *p == '+')) ++p;
    std::uint64_t mantissa = 0;
    int digits = 0;
    int exponent = 0;
    const char* digits_start = p;
    for (; p < end_ && isDigit(*p); ++p, ++digits) mantissa = mantissa * 10 + static_cast<std::uint64_t>(*p - '0');
    if (p < end_ && *p == '.')
      for (++p; p < end_ && isDigit(*p); ++p, ++digits, --exponent)
        mantissa = mantissa * 10 + static_cast<std::uint64_t>(*p - '0');
    double value = 0;
    const bool plain = digits > 0 && digits <= 18 && mantissa < (1ULL << 53) && exponent >= -22 &&
                       (p == end_ || static_cast<unsigned char>(*p) <= ' ');
    if (plain) {
      value = static_cast<double>(mantissa) / kPowersOfTen[static_cast<std::size_t>(-exponent)];
      if (negative) value = -value;
    } else {
      const auto [stop, error] = std::from_chars(digits_start, end_, value);
      const bool ended = stop == end_ || static_cast<unsigned char>(*stop) <= ' ' || *stop == '#' || *stop == '\\';
      if (error == std::errc::invalid_argument || !ended || digits == 0)
        fail(std::string(what) + ": '" + wordAt(start) + "' is not a finite number");
      // from_chars leaves the value alone when it is out of range: too small is zero, too large is not finite.
      if (error == std::errc::result_out_of_range) {
        const std::string_view tail(digits_start, static_cast<std::size_t>(stop - digits_start));
        if (tail.find("e-") == tail.npos && tail.find("E-") == tail.npos)
          fail(std::string(what) + ": '" + wordAt(start) + "' is not a finite number");
        value = 0;
      }
      if (negative) value = -value;
      p = stop;
    }
    if (!std::isfinite(value)) fail(std::string(what) + ": '" + wordAt(start) + "' is not a finite number");
    at_ = p;
    return value;
  }

  void endOfStatement(const char* what) {
    skipBlanks();
    if (!atLineEnd()) fail(std::string(what) + ": unexpected '" + wordAt(at_) + "'");
    restOfLine();
  }

  void statement() {
    skipBlanks();
    if (atLineEnd()) {
      restOfLine();
      return;
    }
    const char* word = at_;
    while (at_<end_&& static_cast<unsigned char>(*at_)> ' ' && at_ - word < 64) ++at_;
    const std::string_view keyword(word, static_cast<std::size_t>(at_ - word));
    if (keyword == "v") return vertex();
    if (keyword == "f") return face();
    if (keyword == "vt") return texcoord();
    if (keyword == "vn") {
      for (int i = 0; i < 3; ++i) number("vn");
      ++normals_;
      return endOfStatement("vn");
    }
    if (keyword == "usemtl") return material();
    if (keyword == "mtllib") {
      skipBlanks();
      std::string name(restOfLine().substr(0, 1024));
      if (material_libraries_.size() < kMaxMaterialLibraries) material_libraries_.push_back(std::move(name));
      return;
    }
    // Everything else (groups, smoothing, curves) does not change the mesh.
    for (const char c : keyword)
      if (!((c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || isDigit(c)))
        fail(std::string("'") + wordAt(word) + "' is not an OBJ statement");
    restOfLine();
  }

  void vertex() {
    if (coordinates_.size() / 3 >= kMaxVertices) fail("more than 1000000 vertices; reduce the mesh");
    for (int i = 0; i < 3; ++i) coordinates_.push_back(number("vertex"));
    // Some programs add a weight, or a colour, or both.
    std::array<float, 4> extra{};
    std::size_t extras = 0;
    for (; extras < extra.size(); ++extras) {
      skipBlanks();
      if (atLineEnd()) break;
      extra[extras] = static_cast<float>(number("vertex"));
    }
    endOfStatement("vertex");
    const std::size_t vertices = coordinates_.size() / 3;
    if (extras < 3 && colours_.empty()) return;
    if (colours_.empty()) colours_.resize(vertices - 1, {1.0F, 1.0F, 1.0F});
    const std::size_t first = extras - 3;
    colours_.push_back(extras < 3 ? std::array<float, 3>{1.0F, 1.0F, 1.0F}
                                  : std::array<float, 3>{extra[first], extra[first + 1], extra[first + 2]});
    for (const float part : colours_.back()) brightest_ = std::max(brightest_, part);
  }

  void texcoord() {
    if (texcoords_.size() >= kMaxCorners) fail("too many texture coordinates");
    std::array<float, 2> uv{static_cast<float>(number("vt")), 0.0F};
    skipBlanks();
    if (!atLineEnd()) uv[1] = static_cast<float>(number("vt"));
    skipBlanks();
    if (!atLineEnd()) number("vt");
    for (const float x : uv)
      if (!std::isfinite(x)) fail("vt: a number is too large");
    texcoords_.push_back(uv);
    endOfStatement("vt");
  }

  // One index of a corner, made 0-based. Positive ones may name what comes later in the file and are checked again at
  // the end.
  std::int64_t index(std::size_t count, const char* what) {
    std::int64_t value = 0;
    const auto [stop, error] = std::from_chars(at_, end_, value);
    if (error != std::errc()) fail("face: '" + wordAt(at_) + "' is not a " + what + " index");
    at_ = stop;
    if (value == 0) fail(std::string("face: ") + what + " index 0; OBJ counts from 1");
    if (value < 0) {
      if (static_cast<std::uint64_t>(-(value + 1)) >= count)
        fail(std::string("face: ") + what + " index " + std::to_string(value) + " is before the first " + what);
      return static_cast<std::int64_t>(count) + value;
    }
    if (value > static_cast<std::int64_t>(kMaxCorners)) tooLarge(line_, value, what, count);
    return value - 1;
  }
  [[noreturn]] void tooLarge(std::size_t line, std::int64_t index_from_1, const char* what, std::size_t count) const {
    failAt(line, std::string("face names ") + what + " " + std::to_string(index_from_1) + ", the file has " +
                     std::to_string(count));
  }

  void face() {
    if (mesh_.polygon_start.size() > kMaxPolygons) fail("more than 2000000 polygons");
    const std::size_t vertices = coordinates_.size() / 3;
    std::size_t corners = 0;
    for (skipBlanks(); !atLineEnd(); skipBlanks(), ++corners) {
      if (corners == kMaxPolygonCorners) fail("face with more than 4096 corners");
      const std::int64_t v = index(vertices, "vertex");
      if (v >= static_cast<std::int64_t>(vertices)) later_.push_back({line_, v, Later::vertex});
      std::int64_t vt = -1;
      if (at_ < end_ && *at_ == '/') {
        ++at_;
        if (at_ < end_ && *at_ != '/') {
          vt = index(texcoords_.size(), "texture coordinate");
          if (vt >= static_cast<std::int64_t>(texcoords_.size())) later_.push_back({line_, vt, Later::texcoord});
        }
        if (at_ < end_ && *at_ == '/') {
          ++at_;
          const std::int64_t vn = index(normals_, "normal");
          if (vn >= static_cast<std::int64_t>(normals_)) later_.push_back({line_, vn, Later::normal});
        }
      }
      if (at_<end_&& static_cast<unsigned char>(*at_)> ' ' && *at_ != '#' && *at_ != '\\')
        fail("face: unexpected '" + wordAt(at_) + "' after a corner");
      mesh_.corner_vertices.push_back(static_cast<std::uint32_t>(v));
      if (vt >= 0 && corner_texcoord_.empty()) corner_texcoord_.resize(mesh_.corner_vertices.size() - 1, -1);
      if (vt >= 0 || !corner_texcoord_.empty()) corner_texcoord_.push_back(static_cast<std::int32_t>(vt));
    }
    if (corners < 3) fail("face with " + std::to_string(corners) + " corners; it needs at least 3");
    if (mesh_.corner_vertices.size() > kMaxCorners) fail("more than 16000000 polygon corners");
    mesh_.polygon_start.push_back(static_cast<std::uint32_t>(mesh_.corner_vertices.size()));
    if (material_ >= 0 && mesh_.polygon_material.empty() && mesh_.polygonCount() > 1)
      mesh_.polygon_material.resize(mesh_.polygonCount() - 1, materialIndex(""));
    if (material_ >= 0) mesh_.polygon_material.push_back(static_cast<std::uint32_t>(material_));
    restOfLine();
  }

  std::uint32_t materialIndex(const std::string& name) {
    const auto [entry, fresh] = material_of_name_.emplace(name, static_cast<std::uint32_t>(mesh_.materials.size()));
    if (fresh) {
      if (mesh_.materials.size() >= kMaxMaterials) fail("more than 65536 materials");
      mesh_.materials.push_back({name.empty() ? "none" : name, {0.8F, 0.8F, 0.8F}});
    }
    return entry->second;
  }
  void material() {
    skipBlanks();
    const std::string name(restOfLine());
    material_ = materialIndex(name.substr(0, 256));
  }

  void finish() {
    const std::size_t vertices = coordinates_.size() / 3;
    if (vertices == 0) throw InputError(name_ + ": no vertices; is this an OBJ mesh?");
    if (mesh_.polygonCount() == 0) throw InputError(name_ + ": a mesh without faces; nothing can be rigged");
    for (const Later& l : later_) {
      const std::size_t count = l.kind == Later::vertex     ? vertices
                                : l.kind == Later::texcoord ? texcoords_.size()
                                                            : normals_;
      const char* what = l.kind == Later::vertex     ? "vertex"
                         : l.kind == Later::texcoord ? "texture coordinate"
                                                     : "normal";
      if (l.index >= static_cast<std::int64_t>(count)) tooLarge(l.line, l.index + 1, what, count);
    }
    mesh_.positions = Eigen::Map<const VertexPositions>(coordinates_.data(), static_cast<Eigen::Index>(vertices), 3);
    // 0..1 by most programs, 0..255 by some.
    const float unit = brightest_ > 1.0F ? 255.0F : 1.0F;
    for (auto& colour : colours_)
      for (float& part : colour) part = linearFromDisplay(part / unit);
    mesh_.vertex_colours = std::move(colours_);
    if (!corner_texcoord_.empty()) {
      mesh_.corner_texcoords.reserve(corner_texcoord_.size());
      for (const std::int32_t t : corner_texcoord_)
        mesh_.corner_texcoords.push_back(t < 0 ? std::array<float, 2>{0.0F, 0.0F}
                                               : texcoords_[static_cast<std::size_t>(t)]);
    }
  }

  struct Later {
    std::size_t line;
    std::int64_t index;
    enum Kind { vertex, texcoord, normal } kind;
  };

  const char* at_;
  const char* end_;
  const std::string& name_;
  std::size_t line_ = 0;
  Mesh mesh_;
  std::vector<double> coordinates_;
  float brightest_ = 0.0F;
  std::vector<std::array<float, 3>>
      colours_;  // as a screen shows them; empty, or one per vertex; white where a vertex has none
  std::vector<std::array<float, 2>> texcoords_;
  std::vector<std::string> material_libraries_;
  std::size_t normals_ = 0;
  std::vector<std::int32_t> corner_texcoord_;  // -1: none; empty until a face names one
  std::vector<Later> later_;                   // indices that were beyond the end when they were read
  std::int64_t material_ = -1;
  std::unordered_map<std::string, std::uint32_t> material_of_name_;
};

}  // namespace

Mesh parseObj(std::string_view text, const std::string& name_for_errors) {
  return ObjParser(text, name_for_errors).parse();
}

Mesh parseObj(std::string_view text, const std::string& name_for_errors, std::vector<std::string>& material_libraries) {
  ObjParser parser(text, name_for_errors);
  Mesh mesh = parser.parse();
  material_libraries = std::move(parser.materialLibraries());
  return mesh;
}

}  // namespace volto::rig
