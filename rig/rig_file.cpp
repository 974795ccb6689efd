#include "rig/rig_file.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "rig/file_bytes.h"
#include "rig/motion_file.h"
#include "rig/rig_file_refined.h"
#include "rig_file_generated.h"

namespace volto::rig {
namespace {

static_assert(std::endian::native == std::endian::little, "rig files are little-endian and copied as they are");

// Header, 32 bytes, little-endian: magic; u32 version; u32 CRC-32C of header (this field as 0) and body; u64 body size;
// u64 zero. The first byte is no text, and the line ends show a file that went through a text conversion.
constexpr std::array<unsigned char, 8> kMagic = {0x89, 'V', 'R', 'I', 'G', '\r', '\n', 0x1A};
constexpr std::uint32_t kVersion = 1;
constexpr std::size_t kHeaderBytes = 32;
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;
constexpr std::size_t kMaxVertices = 1'000'000;
constexpr std::size_t kMaxNameBytes = 4'096;
constexpr std::size_t kMaxBlendshapes = 4'096;

std::uint32_t crc32c(std::uint32_t crc, const unsigned char* bytes, std::size_t size) {
  static const auto table = [] {
    std::array<std::array<std::uint32_t, 256>, 4> t{};
    for (std::uint32_t i = 0; i < 256; ++i) {
      std::uint32_t c = i;
      for (int k = 0; k < 8; ++k) c = (c & 1) != 0 ? 0x82F63B78U ^ (c >> 1) : c >> 1;
      t[0][i] = c;
    }
    for (std::size_t k = 1; k < 4; ++k)
      for (std::size_t i = 0; i < 256; ++i) t[k][i] = t[0][t[k - 1][i] & 0xFF] ^ (t[k - 1][i] >> 8);
    return t;
  }();
  crc = ~crc;
  for (; size >= 4; bytes += 4, size -= 4) {
    std::uint32_t word = 0;
    std::memcpy(&word, bytes, 4);
    crc ^= word;
    crc = table[3][crc & 0xFF] ^ table[2][crc >> 8 & 0xFF] ^ table[1][crc >> 16 & 0xFF] ^ table[0][crc >> 24];
  }
  for (; size > 0; ++bytes, --size) crc = table[0][(crc ^ *bytes) & 0xFF] ^ (crc >> 8);
  return ~crc;
}

template <class T>
T readLittle(const unsigned char* at) {
  T value{};
  std::memcpy(&value, at, sizeof value);
  return value;
}

std::uint32_t checksum(std::array<unsigned char, kHeaderBytes> header, const unsigned char* body, std::size_t size) {
  std::memset(header.data() + 12, 0, 4);
  return crc32c(crc32c(0, header.data(), header.size()), body, size);
}

// What the body says, checked against what a Rig must be.
class Decoder {
 public:
  Decoder(const file::Rig& in, const std::string& name) : in_(in), name_(name) {}

  Rig decode() {
    checkPointOrder();
    rig_.name = text(in_.name(), "name");
    rig_.mesh_file = text(in_.mesh_file(), "mesh file name");
    mesh();
    points();
    association();
    operatorRows();
    parts();
    blendshapes();
    try {
      decodeMotion(in_.motion(), rig_);
    } catch (const std::invalid_argument& e) {
      fail(e.what());
    }
    if (in_.refined() != nullptr)
      rig_.refined = decodeRefinedMask(*in_.refined(), rig_.neutral.vertexCount(), [this](const auto& what) { fail(what); });
    return std::move(rig_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": damaged rig file: " + what); }
  void require(bool good, const char* what) const {
    if (!good) fail(what);
  }

  std::string text(const flatbuffers::String* s, const char* what) const {
    if (s == nullptr) return {};
    if (s->size() > kMaxNameBytes) fail(std::string(what) + " is too long");
    return s->str();
  }
  template <class T>
  std::vector<T> numbers(const flatbuffers::Vector<T>* v) const {
    return v == nullptr ? std::vector<T>() : std::vector<T>(v->data(), v->data() + v->size());
  }
  template <class T>
  void requireFinite(const std::vector<T>& values, const char* what) const {
    for (const T x : values)
      if (!std::isfinite(x)) fail(std::string(what) + " is not finite");
  }

  void checkPointOrder() const {
    const auto* ids = in_.feature_ids();
    require(ids != nullptr && ids->size() == kFeaturePointCount, "it does not hold 84 feature points");
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      if (ids->Get(static_cast<flatbuffers::uoffset_t>(p))->string_view() != featurePoints()[p].id)
        fail("feature points are in another order");
  }

  void mesh() {
    const file::Mesh& m = *in_.mesh();
    const auto positions = numbers(m.positions());
    require(positions.size() % 3 == 0 && !positions.empty(), "vertex positions are not in threes");
    require(positions.size() / 3 <= kMaxVertices, "more than 1000000 vertices");
    requireFinite(positions, "a vertex position");
    Mesh& out = rig_.neutral;
    out.positions =
        Eigen::Map<const VertexPositions>(positions.data(), static_cast<Eigen::Index>(positions.size() / 3), 3);
    out.corner_vertices = numbers(m.corner_vertices());
    out.polygon_start = numbers(m.polygon_start());
    require(out.polygon_start.size() >= 2 && out.polygon_start.front() == 0 &&
                out.polygon_start.back() == out.corner_vertices.size(),
            "polygons do not cover the corners");
    for (std::size_t p = 1; p < out.polygon_start.size(); ++p)
      require(out.polygon_start[p] >= out.polygon_start[p - 1] && out.polygon_start[p] - out.polygon_start[p - 1] >= 3,
              "a polygon has fewer than 3 corners");
    for (const std::uint32_t v : out.corner_vertices)
      require(v < out.vertexCount(), "a polygon names a vertex that is not there");
    const auto uv = numbers(m.corner_texcoords());
    require(uv.empty() || uv.size() == 2 * out.corner_vertices.size(), "texture coordinates do not fit the corners");
    requireFinite(uv, "a texture coordinate");
    out.corner_texcoords.resize(uv.size() / 2);
    for (std::size_t i = 0; i < out.corner_texcoords.size(); ++i) out.corner_texcoords[i] = {uv[2 * i], uv[2 * i + 1]};
    if (m.materials() != nullptr)
      for (const file::Material* material : *m.materials()) {
        const auto colour = numbers(material->colour());
        require(colour.size() == 3, "a colour without three parts");
        requireFinite(colour, "a colour");
        out.materials.push_back({text(material->name(), "material name"), {colour[0], colour[1], colour[2]}});
      }
    out.polygon_material = numbers(m.polygon_material());
    require(out.polygon_material.empty() || out.polygon_material.size() == out.polygonCount(),
            "materials do not fit the polygons");
    for (const std::uint32_t material : out.polygon_material)
      require(material < out.materials.size(), "a material that is not there");
    const auto colours = numbers(m.vertex_colours());
    requireFinite(colours, "a vertex colour");
    require(colours.empty() || colours.size() == 3 * out.vertexCount(), "vertex colours do not fit the vertices");
    for (std::size_t i = 0; i < colours.size(); i += 3)
      out.vertex_colours.push_back({colours[i], colours[i + 1], colours[i + 2]});
  }

  void points() {
    const auto vertex = numbers(in_.feature_vertex());
    require(vertex.size() == kFeaturePointCount, "it does not hold 84 feature points");
    for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
      require(vertex[p] >= -1 && vertex[p] < static_cast<std::int64_t>(rig_.neutral.vertexCount()),
              "a feature point is out of range");
      rig_.feature_vertex[p] = vertex[p];
    }
    const auto positions = numbers(in_.feature_positions());
    require(positions.size() == 3 * kFeaturePointCount, "it does not hold 84 feature points");
    requireFinite(positions, "a feature point");
    rig_.feature_positions = Eigen::Map<const FeaturePointPositions>(positions.data());
    const auto rotation = numbers(in_.mesh_from_head());
    require(rotation.size() == 9, "the head's rotation is missing");
    requireFinite(rotation, "the head's rotation");
    rig_.mesh_from_head = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rotation.data());
    require((rig_.mesh_from_head * rig_.mesh_from_head.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6,
            "the head's rotation is not a rotation");
    const file::Fapu& fapu = *in_.fapu();
    rig_.fapu.fapu = {fapu.iris_diameter(), fapu.eye_separation(), fapu.eye_nose(), fapu.mouth_nose(),
                      fapu.mouth_width()};
    for (const double unit :
         {fapu.iris_diameter(), fapu.eye_separation(), fapu.eye_nose(), fapu.mouth_nose(), fapu.mouth_width()})
      require(std::isfinite(unit) && unit > 0, "a facial animation parameter unit is not positive");
    if (fapu.substitutions() != nullptr)
      for (const auto* line : *fapu.substitutions()) rig_.fapu.substitutions.push_back(text(line, "a remark"));
  }

  void association() {
    const auto kind = numbers(in_.association_kind());
    rig_.association.triangle = numbers(in_.association_triangle());
    require(kind.size() == rig_.neutral.vertexCount() && rig_.association.triangle.size() == kind.size(),
            "the association does not fit the mesh");
    for (const std::uint8_t k : kind) {
      require(k <= 3, "an unknown kind of association");
      rig_.association.kind.push_back(static_cast<AssociationKind>(k));
    }
    for (const std::int16_t t : rig_.association.triangle)
      require(t >= -1 && t < static_cast<int>(kMaskTriangleCount),
              "a vertex is associated with a triangle that is not there");
    require(in_.regions() != nullptr && in_.regions()->size() == kMaskTriangleCount,
            "it does not hold 136 regions of influence");
    for (std::size_t t = 0; t < kMaskTriangleCount; ++t) {
      rig_.region_of_influence[t] = numbers(in_.regions()->Get(static_cast<flatbuffers::uoffset_t>(t))->points());
      requireAscendingPoints(rig_.region_of_influence[t], 0, rig_.region_of_influence[t].size());
    }
  }

  void requireAscendingPoints(const std::vector<std::uint8_t>& points, std::size_t first, std::size_t last) const {
    for (std::size_t i = first; i < last; ++i)
      require(points[i] < kFeaturePointCount && (i == first || points[i - 1] < points[i]),
              "feature points out of order or range");
  }

  void operatorRows() {
    DeformationOperator& op = rig_.deformation;
    op.row_start = numbers(in_.row_start());
    op.point = numbers(in_.point());
    op.weight = numbers(in_.weight());
    require(op.row_start.size() == rig_.neutral.vertexCount() + 1 && op.row_start.front() == 0,
            "the operator does not fit the mesh");
    require(op.point.size() == op.weight.size() && op.row_start.back() == op.weight.size(),
            "the operator's rows do not add up");
    requireFinite(op.weight, "an operator weight");
    for (std::size_t v = 0; v + 1 < op.row_start.size(); ++v) {
      require(op.row_start[v] <= op.row_start[v + 1] && op.row_start[v + 1] <= op.point.size(),
              "the operator's rows do not add up");
      requireAscendingPoints(op.point, op.row_start[v], op.row_start[v + 1]);
    }
  }

  void parts() {
    if (in_.rigid_parts() == nullptr) return;
    for (const file::RigidPart* part : *in_.rigid_parts()) {
      RigidPart out;
      out.name = text(part->name(), "part name");
      require(part->follows() <= 4, "a part follows something unknown");
      out.follows = static_cast<RigidPart::Follows>(part->follows());
      out.vertices = numbers(part->vertices());
      for (std::size_t i = 0; i < out.vertices.size(); ++i)
        require(out.vertices[i] < rig_.neutral.vertexCount() && (i == 0 || out.vertices[i - 1] < out.vertices[i]),
                "a part's vertices are out of order or range");
      const auto centre = numbers(part->centre());
      require(centre.size() == 3, "a part without a centre");
      requireFinite(centre, "a part's centre");
      out.centre = {centre[0], centre[1], centre[2]};
      rig_.rigid_parts.push_back(std::move(out));
    }
  }

  void blendshapes() {
    if (in_.blendshapes() == nullptr) return;
    require(in_.blendshapes()->size() <= kMaxBlendshapes, "more than 4096 blendshapes");
    for (const file::Blendshape* shape : *in_.blendshapes()) {
      Blendshape out;
      out.name = text(shape->name(), "blendshape name");
      require(!out.name.empty(), "a blendshape without a name");
      for (const Blendshape& other : rig_.blendshapes) require(other.name != out.name, "two blendshapes of one name");
      const auto displacement = numbers(shape->mask_displacement());
      require(displacement.size() == 3 * kFeaturePointCount, "a blendshape without 84 displacements");
      requireFinite(displacement, "a blendshape");
      for (std::size_t p = 0; p < kFeaturePointCount; ++p)
        out.mask_displacement[p] = {displacement[3 * p], displacement[3 * p + 1], displacement[3 * p + 2]};
      out.moves_mask = shape->moves_mask();
      rig_.blendshapes.push_back(std::move(out));
    }
  }

  const file::Rig& in_;
  const std::string& name_;
  Rig rig_;
};

flatbuffers::Offset<file::Mesh> encodeMesh(flatbuffers::FlatBufferBuilder& builder, const Mesh& mesh) {
  const auto positions = builder.CreateVector(mesh.positions.data(), static_cast<std::size_t>(mesh.positions.size()));
  const auto corners = builder.CreateVector(mesh.corner_vertices);
  const auto start = builder.CreateVector(mesh.polygon_start);
  std::vector<float> uv;
  for (const auto& t : mesh.corner_texcoords) uv.insert(uv.end(), t.begin(), t.end());
  const auto texcoords = builder.CreateVector(uv);
  const auto polygon_material = builder.CreateVector(mesh.polygon_material);
  std::vector<flatbuffers::Offset<file::Material>> materials;
  for (const Mesh::Material& m : mesh.materials) {
    const auto name = builder.CreateString(m.name);
    const auto colour = builder.CreateVector(m.colour.data(), m.colour.size());
    materials.push_back(file::CreateMaterial(builder, name, colour));
  }
  const auto material_list = builder.CreateVector(materials);
  std::vector<float> colours;
  for (const auto& colour : mesh.vertex_colours) colours.insert(colours.end(), colour.begin(), colour.end());
  const auto vertex_colours = colours.empty() ? 0 : builder.CreateVector(colours);
  return file::CreateMesh(builder, positions, corners, start, texcoords, polygon_material, material_list,
                          vertex_colours);
}

}  // namespace

std::vector<std::byte> encodeRig(const Rig& rig) {
  flatbuffers::FlatBufferBuilder builder(1 << 20);
  const auto name = builder.CreateString(rig.name);
  const auto mesh_file = builder.CreateString(rig.mesh_file);
  const auto mesh = encodeMesh(builder, rig.neutral);
  std::vector<flatbuffers::Offset<flatbuffers::String>> ids;
  for (const FeaturePoint& p : featurePoints()) ids.push_back(builder.CreateString(p.id.data(), p.id.size()));
  const auto feature_ids = builder.CreateVector(ids);
  const auto feature_vertex = builder.CreateVector(rig.feature_vertex.data(), rig.feature_vertex.size());
  const auto feature_positions =
      builder.CreateVector(rig.feature_positions.data(), static_cast<std::size_t>(rig.feature_positions.size()));
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rotation = rig.mesh_from_head;
  const auto mesh_from_head = builder.CreateVector(rotation.data(), 9);
  const auto substitutions = builder.CreateVectorOfStrings(rig.fapu.substitutions);
  const Fapu& f = rig.fapu.fapu;
  const auto fapu = file::CreateFapu(builder, f.iris_diameter, f.eye_separation, f.eye_nose, f.mouth_nose,
                                     f.mouth_width, substitutions);
  const auto triangle = builder.CreateVector(rig.association.triangle);
  std::vector<std::uint8_t> kinds;
  kinds.reserve(rig.association.kind.size());
  for (const AssociationKind k : rig.association.kind) kinds.push_back(static_cast<std::uint8_t>(k));
  const auto kind = builder.CreateVector(kinds);
  std::vector<flatbuffers::Offset<file::Region>> regions;
  for (const auto& points : rig.region_of_influence)
    regions.push_back(file::CreateRegion(builder, builder.CreateVector(points)));
  const auto region_vector = builder.CreateVector(regions);
  const auto row_start = builder.CreateVector(rig.deformation.row_start);
  const auto point = builder.CreateVector(rig.deformation.point);
  const auto weight = builder.CreateVector(rig.deformation.weight);
  std::vector<flatbuffers::Offset<file::RigidPart>> parts;
  for (const RigidPart& p : rig.rigid_parts) {
    const auto part_name = builder.CreateString(p.name);
    const auto vertices = builder.CreateVector(p.vertices);
    const auto centre = builder.CreateVector(p.centre.data(), p.centre.size());
    parts.push_back(file::CreateRigidPart(builder, part_name, static_cast<std::uint8_t>(p.follows), vertices, centre));
  }
  const auto part_vector = builder.CreateVector(parts);
  std::vector<flatbuffers::Offset<file::Blendshape>> shapes;
  for (const Blendshape& b : rig.blendshapes) {
    const auto shape_name = builder.CreateString(b.name);
    const auto displacement = builder.CreateVector(b.mask_displacement.front().data(), 3 * kFeaturePointCount);
    shapes.push_back(file::CreateBlendshape(builder, shape_name, displacement, b.moves_mask));
  }
  const auto shape_vector = builder.CreateVector(shapes);
  const auto motion = encodeMotion(builder, rig);
  flatbuffers::Offset<file::RefinedMask> refined;
  if (!rig.refined.empty()) refined = encodeRefinedMask(builder, rig.refined);
  file::FinishRigBuffer(builder, file::CreateRig(builder, name, mesh_file, mesh, feature_ids, feature_vertex,
                                                 feature_positions, mesh_from_head, fapu, triangle, kind, region_vector,
                                                 row_start, point, weight, part_vector, shape_vector, motion, refined));

  std::array<unsigned char, kHeaderBytes> header{};
  std::memcpy(header.data(), kMagic.data(), kMagic.size());
  std::memcpy(header.data() + 8, &kVersion, 4);
  const std::uint64_t size = builder.GetSize();
  std::memcpy(header.data() + 16, &size, 8);
  const std::uint32_t crc = checksum(header, builder.GetBufferPointer(), builder.GetSize());
  std::memcpy(header.data() + 12, &crc, 4);
  std::vector<std::byte> out(kHeaderBytes + builder.GetSize());
  std::memcpy(out.data(), header.data(), kHeaderBytes);
  std::memcpy(out.data() + kHeaderBytes, builder.GetBufferPointer(), builder.GetSize());
  return out;
}

Rig decodeRig(std::span<const std::byte> bytes, const std::string& name_for_errors) {
  const auto fail = [&](const std::string& what) { throw InputError(name_for_errors + ": " + what); };
  const auto* raw = reinterpret_cast<const unsigned char*>(bytes.data());
  const std::size_t magic = std::min(bytes.size(), kMagic.size());
  if (magic == 0 || std::memcmp(raw, kMagic.data(), magic) != 0) fail("not a rig file; make one with volto rig");
  if (bytes.size() < kHeaderBytes)
    fail("the rig file is cut off at byte " + std::to_string(bytes.size()) + "; make it again with volto rig");
  std::array<unsigned char, kHeaderBytes> header{};
  std::memcpy(header.data(), raw, kHeaderBytes);
  const auto size = readLittle<std::uint64_t>(raw + 16);
  const std::size_t body_size = bytes.size() - kHeaderBytes;
  if (size > body_size)
    fail("the rig file is cut off at byte " + std::to_string(bytes.size()) + ", it should have " +
         std::to_string(size) + " after its header; make it again with volto rig");
  if (size < body_size)
    fail("the rig file has " + std::to_string(body_size - size) + " bytes too many; make it again with volto rig");
  if (checksum(header, raw + kHeaderBytes, body_size) != readLittle<std::uint32_t>(raw + 12))
    fail("the rig file is damaged (its checksum does not fit); make it again with volto rig");
  const auto version = readLittle<std::uint32_t>(raw + 8);
  if (version != kVersion)
    fail("the rig file has version " + std::to_string(version) + ", this Volto reads version " +
         std::to_string(kVersion) + "; use a newer Volto or make the rig again");
  // FlatBuffers wants its numbers aligned; the caller's bytes may lie anywhere.
  std::unique_ptr<std::max_align_t[]> aligned;
  const unsigned char* body = raw + kHeaderBytes;
  if (reinterpret_cast<std::uintptr_t>(body) % alignof(std::max_align_t) != 0) {
    aligned = std::make_unique<std::max_align_t[]>(body_size / sizeof(std::max_align_t) + 1);
    std::memcpy(aligned.get(), body, body_size);
    body = reinterpret_cast<const unsigned char*>(aligned.get());
  }
  flatbuffers::Verifier verifier(body, body_size, 16, 2'000'000);
  if (!file::VerifyRigBuffer(verifier))
    fail("the rig file is damaged (its tables do not fit together); make it again with volto rig");
  return Decoder(*file::GetRig(body), name_for_errors).decode();
}

void writeRig(const std::filesystem::path& path, const Rig& rig) {
  const std::vector<std::byte> bytes = encodeRig(rig);
  writeFileAtomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

Rig readRig(const std::filesystem::path& path) {
  const std::string bytes = readFileBytes(path, kMaxFileBytes);
  return decodeRig(std::as_bytes(std::span(bytes.data(), bytes.size())), path.string());
}

}  // namespace volto::rig
