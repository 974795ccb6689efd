// PLY 1.0 (G. Turk, "The PLY Polygon File Format", 1994): a header that names elements and their properties, then the
// elements, as text or as bytes of either order. Sizes are compared with the file before anything is allocated.
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include "rig/mesh_builder.h"
#include "rig/mesh_io.h"
#include "rig/mesh_limits.h"
#include "rig/text_scanner.h"

namespace volto::rig {
namespace {

constexpr std::size_t kMaxHeaderBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxHeaderLines = 4096;
constexpr std::size_t kMaxElements = 64, kMaxProperties = 256;

enum class Type { i8, u8, i16, u16, i32, u32, f32, f64 };

std::optional<Type> typeNamed(std::string_view name) {
  constexpr std::pair<std::string_view, Type> known[] = {
      {"char", Type::i8},   {"int8", Type::i8},     {"uchar", Type::u8},   {"uint8", Type::u8},
      {"short", Type::i16}, {"int16", Type::i16},   {"ushort", Type::u16}, {"uint16", Type::u16},
      {"int", Type::i32},   {"int32", Type::i32},   {"uint", Type::u32},   {"uint32", Type::u32},
      {"float", Type::f32}, {"float32", Type::f32}, {"double", Type::f64}, {"float64", Type::f64}};
  for (const auto& [word, type] : known)
    if (word == name) return type;
  return {};
}

std::size_t sizeOf(Type type) {
  switch (type) {
    case Type::i8:
    case Type::u8:
      return 1;
    case Type::i16:
    case Type::u16:
      return 2;
    case Type::i32:
    case Type::u32:
    case Type::f32:
      return 4;
    case Type::f64:
      return 8;
  }
  return 1;
}
bool isFloat(Type type) { return type == Type::f32 || type == Type::f64; }

struct Property {
  std::string name;
  Type type = Type::f32;
  std::optional<Type> count;  // of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

enum class Encoding { ascii, little, big };

struct Header {
  Encoding encoding = Encoding::ascii;
  std::vector<Element> elements;
  std::size_t bytes = 0, lines = 0;
};

// Where in a vertex the known values stand; -1: nowhere.
struct VertexColumns {
  std::array<int, 3> position{-1, -1, -1}, colour{-1, -1, -1};
  std::array<int, 2> texcoord{-1, -1};
};

class PlyParser {
 public:
  PlyParser(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

  Mesh parse() {
    readHeader();
    checkSizes();
    if (header_.encoding == Encoding::ascii)
      readAscii();
    else
      readBinary();
    finish();
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }
  [[noreturn]] void failAtLine(const std::string& what) const {
    throw InputError(name_ + ":" + std::to_string(header_.lines) + ": " + what);
  }
  [[noreturn]] void failAtByte(const std::string& what) const {
    throw InputError(name_ + ": @" + std::to_string(at_) + ": " + what);
  }

  // --- header ---

  void readHeader() {
    bool format_seen = false, ended = false;
    while (!ended) {
      if (at_ >= bytes_.size()) fail("the header has no end_header line; is this a whole PLY file?");
      const std::size_t end = bytes_.find('\n', at_);
      const std::size_t length = (end == bytes_.npos ? bytes_.size() : end) - at_;
      if (++header_.lines > kMaxHeaderLines || at_ + length > kMaxHeaderBytes)
        fail("a header of more than " + std::to_string(kMaxHeaderLines) + " lines or 1 MiB; no end_header was found");
      std::vector<std::string_view> words = split(bytes_.substr(at_, length));
      at_ += length + (end == bytes_.npos ? 0 : 1);
      if (header_.lines == 1) {
        if (words.size() != 1 || words[0] != "ply")
          failAtLine("the file does not begin with a line 'ply'; is it a PLY file?");
        continue;
      }
      if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
      if (words[0] == "format") {
        if (format_seen) failAtLine("a second format line");
        format_seen = true;
        readFormat(words);
      } else if (words[0] == "element") {
        readElement(words);
      } else if (words[0] == "property") {
        readProperty(words);
      } else if (words[0] == "end_header" && words.size() == 1) {
        if (end == bytes_.npos) failAtLine("the file ends with its header");
        ended = true;
      } else {
        failAtLine(inQuotes(words[0]) + " is no header line of PLY 1.0");
      }
    }
    if (!format_seen) fail("the header has no format line");
    header_.bytes = at_;
  }

  static std::vector<std::string_view> split(std::string_view line) {
    std::vector<std::string_view> words;
    std::size_t at = 0;
    while (words.size() < 8) {
      at = line.find_first_not_of(" \t\r", at);
      if (at == line.npos) break;
      const std::size_t end = std::min(line.find_first_of(" \t\r", at), line.size());
      words.push_back(line.substr(at, end - at));
      at = end;
    }
    return words;
  }

  void readFormat(const std::vector<std::string_view>& words) {
    if (words.size() != 3) failAtLine("a format line reads 'format ascii|binary_little_endian|binary_big_endian 1.0'");
    if (words[1] == "ascii")
      header_.encoding = Encoding::ascii;
    else if (words[1] == "binary_little_endian")
      header_.encoding = Encoding::little;
    else if (words[1] == "binary_big_endian")
      header_.encoding = Encoding::big;
    else
      failAtLine("format '" + printable(words[1]) +
                 "' is unknown; it is ascii, binary_little_endian or binary_big_endian");
    if (words[2] != "1.0") failAtLine("version '" + printable(words[2]) + "' of PLY is unknown; 1.0 is read");
  }

  void readElement(const std::vector<std::string_view>& words) {
    if (words.size() != 3) failAtLine("an element line reads 'element NAME COUNT'");
    if (header_.elements.size() == kMaxElements) failAtLine("more than 64 elements");
    std::uint64_t count = 0;
    const auto [stop, error] = std::from_chars(words[2].data(), words[2].data() + words[2].size(), count);
    if (error != std::errc() || stop != words[2].data() + words[2].size())
      failAtLine(inQuotes(words[2]) + " is no count of elements");
    for (const Element& element : header_.elements)
      if (element.name == words[1]) failAtLine("element '" + printable(words[1]) + "' a second time");
    header_.elements.push_back({std::string(words[1].substr(0, 64)), count, {}});
  }

  void readProperty(const std::vector<std::string_view>& words) {
    if (header_.elements.empty()) failAtLine("a property before the first element");
    Element& element = header_.elements.back();
    if (element.properties.size() == kMaxProperties) failAtLine("more than 256 properties");
    const bool list = words.size() > 1 && words[1] == "list";
    if (words.size() != (list ? 5U : 3U))
      failAtLine("a property line reads 'property TYPE NAME' or 'property list TYPE TYPE NAME'");
    const auto type = [&](std::string_view word) {
      const auto found = typeNamed(word);
      if (!found) failAtLine("property type '" + printable(word) + "' is unknown");
      return *found;
    };
    Property property;
    if (list) {
      property.count = type(words[2]);
      if (isFloat(*property.count)) failAtLine("the count of a list cannot be a " + printable(words[2]));
    }
    property.type = type(words[list ? 3 : 1]);
    property.name = std::string(words[list ? 4 : 2].substr(0, 64));
    for (const Property& other : element.properties)
      if (other.name == property.name)
        failAtLine("property '" + printable(property.name) + "' of " + printable(element.name) + " a second time");
    element.properties.push_back(std::move(property));
  }

  // What the header promises must fit into what is there.
  void checkSizes() {
    const Element* vertices = nullptr;
    const Element* faces = nullptr;
    std::uint64_t left = bytes_.size() - at_;
    for (const Element& element : header_.elements) {
      std::uint64_t least = 0;
      for (const Property& property : element.properties)
        least += header_.encoding == Encoding::ascii ? 2 : sizeOf(property.count ? *property.count : property.type);
      // The last value of an ascii file may lack its line end.
      const std::uint64_t slack = header_.encoding == Encoding::ascii ? 1 : 0;
      if (least > 0 && element.count > (left + slack) / least)
        fail("element " + printable(element.name) + " needs at least " +
             (element.count > std::numeric_limits<std::uint64_t>::max() / least
                  ? "2^64"
                  : std::to_string(element.count * least)) +
             " bytes, the file has " + std::to_string(left) + " left; the header is wrong or the file is cut");
      left -= std::min(left, element.count * least);
      if (element.name == "vertex") vertices = &element;
      if (element.name == "face") faces = &element;
    }
    if (vertices == nullptr || vertices->count == 0) fail("no vertices; is this a PLY mesh?");
    if (vertices->count > kMaxVertices)
      fail(std::to_string(vertices->count) + " vertices, more than the limit of 1000000");
    if (faces == nullptr || faces->count == 0) fail("a mesh without faces; nothing can be rigged");
    if (faces->count > kMaxPolygons) fail(std::to_string(faces->count) + " polygons, more than the limit of 2000000");
    findColumns(*vertices);
    findIndices(*faces);
    mesh_.positions.resize(static_cast<Eigen::Index>(vertices->count), 3);
    if (columns_.colour[0] >= 0) mesh_.vertex_colours.resize(vertices->count);
    if (columns_.texcoord[0] >= 0) texcoords_.resize(vertices->count);
    mesh_.polygon_start.reserve(faces->count + 1);
    mesh_.polygon_start.push_back(0);
    mesh_.corner_vertices.reserve(std::min<std::uint64_t>(4 * faces->count, kMaxCorners));
  }

  void findColumns(const Element& vertices) {
    const auto column = [&](std::initializer_list<std::string_view> names) {
      for (std::size_t i = 0; i < vertices.properties.size(); ++i)
        for (const std::string_view name : names)
          if (vertices.properties[i].name == name && !vertices.properties[i].count) return static_cast<int>(i);
      return -1;
    };
    columns_.position = {column({"x"}), column({"y"}), column({"z"})};
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (columns_.position[axis] < 0) fail(std::string("the vertices have no property ") + "xyz"[axis]);
    columns_.colour = {column({"red", "r", "diffuse_red"}), column({"green", "g", "diffuse_green"}),
                       column({"blue", "b", "diffuse_blue"})};
    if (columns_.colour[1] < 0 || columns_.colour[2] < 0) columns_.colour[0] = -1;
    for (std::size_t c = 0; c < 3 && columns_.colour[0] >= 0; ++c) {
      const Type type = vertices.properties[static_cast<std::size_t>(columns_.colour[c])].type;
      colour_scale_[c] = type == Type::u8 || type == Type::i8 ? 1.0 / 255 : isFloat(type) ? 1.0 : 1.0 / 65535;
    }
    columns_.texcoord = {column({"s", "u", "texture_u", "texture_s"}), column({"t", "v", "texture_v", "texture_t"})};
    if (columns_.texcoord[1] < 0) columns_.texcoord[0] = -1;
  }

  void findIndices(const Element& faces) {
    for (std::size_t i = 0; i < faces.properties.size(); ++i) {
      const Property& property = faces.properties[i];
      if ((property.name != "vertex_indices" && property.name != "vertex_index") || !property.count) continue;
      if (isFloat(property.type)) fail("the vertex indices of the faces are no whole numbers");
      index_column_ = i;
      return;
    }
    fail("the faces have no list vertex_indices");
  }

  // --- elements; both encodings end here ---

  void takeVertex(std::size_t vertex, const std::vector<double>& values) {
    const auto value = [&](int column) { return values[static_cast<std::size_t>(column)]; };
    for (std::size_t axis = 0; axis < 3; ++axis)
      mesh_.positions(static_cast<Eigen::Index>(vertex), static_cast<Eigen::Index>(axis)) =
          value(columns_.position[axis]);
    if (!mesh_.vertex_colours.empty())
      for (std::size_t c = 0; c < 3; ++c)
        mesh_.vertex_colours[vertex][c] =
            linearFromDisplay(static_cast<float>(value(columns_.colour[c]) * colour_scale_[c]));
    if (!texcoords_.empty())
      texcoords_[vertex] = {static_cast<float>(value(columns_.texcoord[0])),
                            static_cast<float>(value(columns_.texcoord[1]))};
  }

  // What is wrong with a face's list; nothing when it was taken.
  std::string takeFace(const std::vector<std::int64_t>& corners) {
    const auto face = [&] { return "face " + std::to_string(mesh_.polygonCount()); };
    if (corners.size() < 3) return face() + " has " + std::to_string(corners.size()) + " corners; it needs at least 3";
    const auto vertices = static_cast<std::int64_t>(mesh_.vertexCount());
    for (const std::int64_t index : corners) {
      if (index < 0 || index >= vertices)
        return face() + " names vertex " + std::to_string(index) + ", the file has " + std::to_string(vertices) +
               ", counted from 0";
      mesh_.corner_vertices.push_back(static_cast<std::uint32_t>(index));
    }
    if (mesh_.corner_vertices.size() > kMaxCorners) return "more than 16000000 polygon corners";
    mesh_.polygon_start.push_back(static_cast<std::uint32_t>(mesh_.corner_vertices.size()));
    return {};
  }

  static std::string listLimit(std::int64_t count) {
    return "a list of " + std::to_string(count) + " values; 0 to 4096 are read";
  }

  void readAscii() {
    TextScanner text(bytes_.substr(at_), name_, '\0', header_.lines + 1);
    std::vector<double> values;
    std::vector<std::int64_t> corners;
    Notes notes;
    for (const Element& element : header_.elements) {
      const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
      if (element.properties.empty()) continue;
      for (std::uint64_t row = 0; row < element.count; ++row) {
        const auto which = [&] { return element.name + " " + std::to_string(row); };
        if (!text.nextWord())
          text.fail("the file ends before " + printable(which()) + " of " + std::to_string(element.count));
        values.clear();
        for (std::size_t i = 0; i < element.properties.size(); ++i) {
          const Property& property = element.properties[i];
          const auto next = [&] {
            if (!text.wordOnLine())
              text.fail(printable(element.name) + " " + std::to_string(row) + " has too few values");
          };
          next();
          if (!property.count) {
            values.push_back(text.number(property.name.c_str()));
            continue;
          }
          const std::int64_t count = text.integer("count of a list");
          if (count < 0 || count > static_cast<std::int64_t>(kMaxPolygonCorners)) text.fail(listLimit(count));
          values.push_back(0);
          corners.clear();
          const bool indices = is_face && i == index_column_;
          for (std::int64_t n = 0; n < count; ++n) {
            next();
            if (indices)
              corners.push_back(text.integer("vertex index"));
            else
              text.word();
          }
          if (indices) takeFaceOrFail(corners, [&](const std::string& what) { text.fail(what); });
        }
        if (is_vertex) takeVertex(static_cast<std::size_t>(row), values);
        if (text.wordOnLine())
          notes.add(name_ + ":" + std::to_string(text.line()) + ": more values than the header says; passed over");
        text.endLine();
      }
    }
    if (text.nextWord())
      notes.add(name_ + ":" + std::to_string(text.line()) + ": text after the last element; passed over");
    mesh_.notes = notes.take();
  }

  // Faces may stand before the vertices; the number of those is known from the header, so that nothing has to wait.
  template <typename Fail>
  void takeFaceOrFail(const std::vector<std::int64_t>& corners, const Fail& fail_here) {
    const std::string wrong = takeFace(corners);
    if (!wrong.empty()) fail_here(wrong);
  }

  template <typename T>
  T raw() {
    T value;
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  template <typename T>
  T ordered(T value) const {
    static_assert(std::endian::native == std::endian::little);
    if (header_.encoding == Encoding::little) return value;
    T out;
    std::array<char, sizeof(T)> in_bytes, out_bytes;
    std::memcpy(in_bytes.data(), &value, sizeof value);
    for (std::size_t i = 0; i < sizeof(T); ++i) out_bytes[i] = in_bytes[sizeof(T) - 1 - i];
    std::memcpy(&out, out_bytes.data(), sizeof out);
    return out;
  }
  void requireBytes(std::uint64_t count, const Element& element) const {
    if (count > bytes_.size() - at_)
      failAtByte("the file ends inside element " + printable(element.name) + ": " + std::to_string(count) +
                 " bytes are needed, " + std::to_string(bytes_.size() - at_) + " are left");
  }
  double scalar(Type type) {
    switch (type) {
      case Type::i8:
        return raw<std::int8_t>();
      case Type::u8:
        return raw<std::uint8_t>();
      case Type::i16:
        return ordered(raw<std::int16_t>());
      case Type::u16:
        return ordered(raw<std::uint16_t>());
      case Type::i32:
        return ordered(raw<std::int32_t>());
      case Type::u32:
        return ordered(raw<std::uint32_t>());
      case Type::f32:
        return static_cast<double>(ordered(raw<float>()));
      case Type::f64:
        return ordered(raw<double>());
    }
    return 0;
  }

  void readBinary() {
    std::vector<double> values;
    std::vector<std::int64_t> corners;
    for (const Element& element : header_.elements) {
      const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
      if (element.properties.empty()) continue;
      for (std::uint64_t row = 0; row < element.count; ++row) {
        values.clear();
        for (std::size_t i = 0; i < element.properties.size(); ++i) {
          const Property& property = element.properties[i];
          if (!property.count) {
            requireBytes(sizeOf(property.type), element);
            values.push_back(scalar(property.type));
            continue;
          }
          requireBytes(sizeOf(*property.count), element);
          const auto count = static_cast<std::int64_t>(scalar(*property.count));
          if (count < 0 || count > static_cast<std::int64_t>(kMaxPolygonCorners)) failAtByte(listLimit(count));
          requireBytes(static_cast<std::uint64_t>(count) * sizeOf(property.type), element);
          values.push_back(0);
          if (!is_face || i != index_column_) {
            at_ += static_cast<std::size_t>(count) * sizeOf(property.type);
            continue;
          }
          corners.clear();
          for (std::int64_t n = 0; n < count; ++n) corners.push_back(static_cast<std::int64_t>(scalar(property.type)));
          takeFaceOrFail(corners, [&](const std::string& what) { failAtByte(what); });
        }
        if (is_vertex) {
          for (const int column : columns_.position)
            if (!std::isfinite(values[static_cast<std::size_t>(column)]))
              failAtByte("vertex " + std::to_string(row) + " has a position that is not finite");
          takeVertex(static_cast<std::size_t>(row), values);
        }
      }
    }
    if (at_ < bytes_.size())
      mesh_.notes.push_back(name_ + ": @" + std::to_string(at_) + ": " + std::to_string(bytes_.size() - at_) +
                            " bytes after the last element; passed over");
  }

  void finish() {
    for (auto& uv : texcoords_)
      for (float& x : uv)
        if (!std::isfinite(x)) x = 0.0F;
    if (texcoords_.empty()) return;
    mesh_.corner_texcoords.reserve(mesh_.corner_vertices.size());
    for (const std::uint32_t vertex : mesh_.corner_vertices) mesh_.corner_texcoords.push_back(texcoords_[vertex]);
  }

  std::string_view bytes_;
  const std::string& name_;
  std::size_t at_ = 0;
  Header header_;
  VertexColumns columns_;
  std::array<double, 3> colour_scale_{1, 1, 1};
  std::size_t index_column_ = 0;
  std::vector<std::array<float, 2>> texcoords_;  // of vertices
  Mesh mesh_;
};

}  // namespace

Mesh parsePly(std::string_view bytes, const std::string& name_for_errors) {
  return PlyParser(bytes, name_for_errors).parse();
}

}  // namespace volto::rig
