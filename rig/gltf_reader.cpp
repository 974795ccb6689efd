// glTF 2.0 (Khronos, 2021): all triangles of the scene as one mesh, in the order of its nodes.
//
// What Volto writes itself (tools/export) carries the vertex index of the artist's mesh as attribute _VOLTO_VERTEX;
// such a file is put together again as it was.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include <Eigen/Geometry>

#include "rig/gltf_document.h"
#include "rig/gltf_skin.h"
#include "rig/mesh_builder.h"
#include "rig/mesh_io.h"
#include "rig/mesh_limits.h"
#include "rig/text_scanner.h"

namespace volto::rig {
namespace {

constexpr std::size_t kMaxNodes = 100'000;
constexpr std::size_t kMaxNodeDepth = 512;
// A mesh of the largest size needs about a third of this; a file that has the same bytes read over and over ends here.
constexpr std::size_t kMaxValuesRead = 64'000'000;
constexpr std::size_t kMaxJoints = 65'535;
constexpr const char* kVertexAttribute = "_VOLTO_VERTEX";

class GltfMeshReader {
 public:
  GltfMeshReader(const GltfDocument& document, const std::string& name, bool with_shapes)
      : document_(document), model_(document.model), name_(name), with_shapes_(with_shapes) {}

  Mesh read() { return std::move(readShaped().mesh); }

  GltfSkin readSkin() {
    with_skin_ = true;
    readShaped();
    GltfSkin out;
    std::map<int, std::uint16_t> index;  // of a node: of its joint
    for (const int node : order_) {
      const auto bind = mesh_from_joint_.find(node);
      if (bind == mesh_from_joint_.end()) continue;
      index[node] = static_cast<std::uint16_t>(out.joints.size());
      GltfSkin::Joint joint;
      joint.name = tidyText(model_.nodes[static_cast<std::size_t>(node)].name);
      if (joint.name.empty()) joint.name = "joint " + std::to_string(out.joints.size());
      joint.mesh_from_joint = bind->second;
      for (int above = parent_[static_cast<std::size_t>(node)]; above >= 0 && joint.parent < 0;
           above = parent_[static_cast<std::size_t>(above)])
        if (const auto found = index.find(above); found != index.end()) joint.parent = found->second;
      out.joints.push_back(std::move(joint));
    }
    if (index.size() != mesh_from_joint_.size()) fail("a joint that is not part of the scene");
    for (const auto& of_vertex : carried_by_) {
      auto& joint = out.joint.emplace_back();
      auto& weight = out.weight.emplace_back();
      for (std::size_t i = 0; i < 4; ++i) {
        joint[i] = of_vertex.weight[i] > 0 ? index.at(of_vertex.node[i]) : std::uint16_t{0};
        weight[i] = static_cast<float>(of_vertex.weight[i]);
      }
    }
    return out;
  }

  ShapedMesh readShaped() {
    for (const Placed& placed : placedMeshes()) addMesh(placed);
    if (mesh_.corner_vertices.empty())
      fail(skipped_ > 0 ? "only points and lines, no faces; nothing can be rigged"
                        : "a mesh without faces; nothing can be rigged");
    if (skipped_ > 0) notes_.add(name_ + ": points or lines in " + std::to_string(skipped_) + " places; passed over");
    mesh_.polygon_start.push_back(static_cast<std::uint32_t>(mesh_.corner_vertices.size()));
    const std::size_t vertices = coordinates_.size() / 3;
    mesh_.positions = Eigen::Map<const VertexPositions>(coordinates_.data(), static_cast<Eigen::Index>(vertices), 3);
    if (has_colours_) mesh_.vertex_colours = std::move(colours_);
    if (has_texcoords_) {
      mesh_.corner_texcoords.reserve(mesh_.corner_vertices.size());
      for (const std::uint32_t v : mesh_.corner_vertices) mesh_.corner_texcoords.push_back(texcoords_[v]);
    }
    nameMaterials();
    ShapedMesh out;
    for (auto& [name, displacement] : shapes_) {
      displacement.resize(coordinates_.size(), 0.0);
      out.names.push_back(name);
      out.positions.push_back(mesh_.positions +
                              Eigen::Map<const VertexPositions>(displacement.data(), mesh_.positions.rows(), 3));
    }
    putBackTogether(out.positions);
    mesh_.notes = notes_.take();
    out.mesh = std::move(mesh_);
    return out;
  }

 private:
  struct Placed {
    int mesh;
    Eigen::Affine3d scene_from_mesh;
    int skin = -1;
  };
  struct Carried {
    std::array<int, 4> node{};
    std::array<double, 4> weight{};
  };

  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }

  // Every mesh that the scene shows, where it shows it.
  std::vector<Placed> placedMeshes() {
    std::vector<Placed> out;
    if (model_.nodes.empty()) {
      for (std::size_t m = 0; m < model_.meshes.size(); ++m)
        out.push_back({static_cast<int>(m), Eigen::Affine3d::Identity()});
      return out;
    }
    if (model_.nodes.size() > kMaxNodes) fail("more than 100000 nodes");
    std::vector<bool> seen(model_.nodes.size(), false);
    parent_.assign(model_.nodes.size(), -1);
    struct Visit {
      int node;
      std::size_t depth;
      Eigen::Affine3d parent;
    };
    std::vector<Visit> stack;
    const std::vector<int> roots = rootNodes();
    for (auto root = roots.rbegin(); root != roots.rend(); ++root)
      stack.push_back({*root, 0, Eigen::Affine3d::Identity()});
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      const std::string which = "node " + std::to_string(visit.node);
      if (visit.node < 0 || static_cast<std::size_t>(visit.node) >= model_.nodes.size())
        fail(which + " does not exist");
      if (seen[static_cast<std::size_t>(visit.node)]) fail(which + " stands in the scene twice; its nodes are no tree");
      if (visit.depth > kMaxNodeDepth) fail("nodes nested deeper than 512 levels");
      seen[static_cast<std::size_t>(visit.node)] = true;
      order_.push_back(visit.node);
      const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(visit.node)];
      const Eigen::Affine3d here = visit.parent * transformOf(node, which);
      // A skinned mesh stands where its bones put it; at rest that is where its vertices are.
      if (node.mesh >= 0) out.push_back({node.mesh, node.skin >= 0 ? Eigen::Affine3d::Identity() : here, node.skin});
      for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
        stack.push_back({*child, visit.depth + 1, here});
        if (*child >= 0 && static_cast<std::size_t>(*child) < parent_.size())
          parent_[static_cast<std::size_t>(*child)] = visit.node;
      }
    }
    return out;
  }

  std::vector<int> rootNodes() const {
    if (!model_.scenes.empty()) {
      const std::size_t scene = model_.defaultScene < 0 ? 0 : static_cast<std::size_t>(model_.defaultScene);
      if (scene >= model_.scenes.size()) fail("scene " + std::to_string(scene) + " does not exist");
      return model_.scenes[scene].nodes;
    }
    std::vector<bool> child(model_.nodes.size(), false);
    for (const tinygltf::Node& node : model_.nodes)
      for (const int c : node.children)
        if (c >= 0 && static_cast<std::size_t>(c) < child.size()) child[static_cast<std::size_t>(c)] = true;
    std::vector<int> roots;
    for (std::size_t n = 0; n < child.size(); ++n)
      if (!child[n]) roots.push_back(static_cast<int>(n));
    return roots;
  }

  Eigen::Affine3d transformOf(const tinygltf::Node& node, const std::string& which) const {
    const auto sizeIs = [&](const std::vector<double>& values, std::size_t size) {
      if (values.empty()) return false;
      if (values.size() != size) fail(which + " has a damaged transform");
      for (const double x : values)
        if (!std::isfinite(x)) fail(which + " has a transform that is not finite");
      return true;
    };
    Eigen::Affine3d out = Eigen::Affine3d::Identity();
    if (sizeIs(node.matrix, 16)) {
      out.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());  // column by column
      return out;
    }
    if (sizeIs(node.translation, 3)) out.translate(Eigen::Map<const Eigen::Vector3d>(node.translation.data()));
    if (sizeIs(node.rotation, 4)) {
      const Eigen::Quaterniond q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
      if (!(q.norm() > 1e-6)) fail(which + " has a rotation without length");
      out.rotate(q.normalized());
    }
    if (sizeIs(node.scale, 3)) out.scale(Eigen::Map<const Eigen::Vector3d>(node.scale.data()));
    return out;
  }

  void addMesh(const Placed& placed) {
    if (static_cast<std::size_t>(placed.mesh) >= model_.meshes.size())
      fail("mesh " + std::to_string(placed.mesh) + " does not exist");
    const bool mirrored = placed.scene_from_mesh.linear().determinant() < 0;
    std::map<int, std::uint32_t> first_vertex;  // of a position accessor: primitives often share one
    for (const tinygltf::Primitive& primitive : model_.meshes[static_cast<std::size_t>(placed.mesh)].primitives) {
      const int mode = primitive.mode < 0 ? TINYGLTF_MODE_TRIANGLES : primitive.mode;
      if (mode < TINYGLTF_MODE_TRIANGLES || mode > TINYGLTF_MODE_TRIANGLE_FAN) {
        ++skipped_;
        continue;
      }
      const auto position = primitive.attributes.find("POSITION");
      if (position == primitive.attributes.end()) fail("a primitive without positions");
      const auto [entry, fresh] =
          first_vertex.emplace(position->second, static_cast<std::uint32_t>(coordinates_.size() / 3));
      const std::size_t count = fresh ? addVertices(position->second, placed.scene_from_mesh)
                                      : model_.accessors[static_cast<std::size_t>(position->second)].count;
      addAttributes(primitive, entry->second, count);
      if (fresh && with_skin_ && placed.skin >= 0) addSkin(primitive, placed.skin, entry->second, count);
      if (fresh && with_shapes_) addTargets(primitive, placed, entry->second, count);
      addTriangles(primitive, mode, entry->second, count, mirrored);
    }
  }

  std::vector<double> values(int accessor, std::size_t components, std::size_t most) {
    std::vector<double> out = readAccessor(document_, accessor, components, most, name_);
    values_read_ += out.size();
    if (values_read_ > kMaxValuesRead) fail("its accessors hold more than a mesh of 1000000 vertices can need");
    return out;
  }
  std::size_t componentsOf(int accessor) const {
    if (accessor < 0 || static_cast<std::size_t>(accessor) >= model_.accessors.size()) return 0;
    return static_cast<std::size_t>(std::max(0, tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(
                                                    model_.accessors[static_cast<std::size_t>(accessor)].type))));
  }

  std::size_t addVertices(int accessor, const Eigen::Affine3d& scene_from_mesh) {
    const std::vector<double> positions = values(accessor, 3, kMaxVertices);
    if (coordinates_.size() / 3 + positions.size() / 3 > kMaxVertices) fail("more than 1000000 vertices");
    const bool moved = !scene_from_mesh.matrix().isIdentity(0.0);
    for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
      Eigen::Vector3d p(positions[i], positions[i + 1], positions[i + 2]);
      if (moved) p = scene_from_mesh * p;
      if (!p.allFinite())
        fail("vertex " + std::to_string(coordinates_.size() / 3) + " has a position that is not finite");
      coordinates_.insert(coordinates_.end(), {p.x(), p.y(), p.z()});
    }
    const std::size_t vertices = coordinates_.size() / 3;
    texcoords_.resize(vertices, {0.0F, 0.0F});
    colours_.resize(vertices, {1.0F, 1.0F, 1.0F});
    original_.resize(vertices, -1.0);
    carried_by_.resize(vertices);
    return positions.size() / 3;
  }

  void addAttributes(const tinygltf::Primitive& primitive, std::uint32_t first, std::size_t count) {
    // Nothing for what is not there, and for what another primitive of these vertices has brought already.
    const auto attribute = [&](const char* key) -> std::optional<int> {
      const auto found = primitive.attributes.find(key);
      if (found == primitive.attributes.end() || !applied_.emplace(first, found->second).second) return {};
      return found->second;
    };
    const auto sameCount = [&](const std::vector<double>& read, std::size_t components, const char* what) {
      if (read.size() != count * components)
        fail(std::string(what) + " for " + std::to_string(read.size() / components) + " vertices, the primitive has " +
             std::to_string(count));
    };
    const auto single = [](double x) { return std::isfinite(x) && std::abs(x) < 1e30 ? static_cast<float>(x) : 0.0F; };
    if (const auto accessor = attribute("TEXCOORD_0")) {
      const std::vector<double> uv = values(*accessor, 2, kMaxVertices);
      sameCount(uv, 2, "texture coordinates");
      for (std::size_t v = 0; v < count; ++v) texcoords_[first + v] = {single(uv[2 * v]), 1.0F - single(uv[2 * v + 1])};
      has_texcoords_ = true;
    }
    if (const auto accessor = attribute("COLOR_0")) {
      const std::size_t parts = componentsOf(*accessor) == 4 ? 4 : 3;
      const std::vector<double> rgb = values(*accessor, parts, kMaxVertices);
      sameCount(rgb, parts, "colours");
      for (std::size_t v = 0; v < count; ++v)
        for (std::size_t c = 0; c < 3; ++c) colours_[first + v][c] = std::clamp(single(rgb[parts * v + c]), 0.0F, 1.0F);
      has_colours_ = true;
    }
    const auto original = attribute(kVertexAttribute);
    if (original && componentsOf(*original) == 1) {
      const std::vector<double> number = values(*original, 1, kMaxVertices);
      sameCount(number, 1, "vertex numbers");
      for (std::size_t v = 0; v < count; ++v) original_[first + v] = number[v];
    }
  }

  void addSkin(const tinygltf::Primitive& primitive, int number, std::uint32_t first, std::size_t count) {
    if (static_cast<std::size_t>(number) >= model_.skins.size())
      fail("skin " + std::to_string(number) + " does not exist");
    const tinygltf::Skin& skin = model_.skins[static_cast<std::size_t>(number)];
    if (skin.joints.size() > kMaxJoints) fail("a skin of more than 65535 joints");
    std::vector<double> bind;
    if (skin.inverseBindMatrices >= 0) bind = values(skin.inverseBindMatrices, 16, kMaxJoints);
    if (!bind.empty() && bind.size() < 16 * skin.joints.size()) fail("a skin with fewer bind matrices than joints");
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      const int node = skin.joints[j];
      if (node < 0 || static_cast<std::size_t>(node) >= model_.nodes.size())
        fail("joint " + std::to_string(j) + " is node " + std::to_string(node) + ", which does not exist");
      Eigen::Affine3d joint_from_mesh = Eigen::Affine3d::Identity();
      if (!bind.empty()) joint_from_mesh.matrix() = Eigen::Map<const Eigen::Matrix4d>(bind.data() + 16 * j);
      const Eigen::Affine3d mesh_from_joint = joint_from_mesh.inverse(Eigen::Affine);
      if (!mesh_from_joint.matrix().allFinite())
        fail("the bind matrix of joint " + std::to_string(j) + " has no inverse");
      mesh_from_joint_.emplace(node, mesh_from_joint);
    }
    const auto joints = primitive.attributes.find("JOINTS_0"), weights = primitive.attributes.find("WEIGHTS_0");
    if (joints == primitive.attributes.end() || weights == primitive.attributes.end()) return;
    const std::vector<double> joint = values(joints->second, 4, kMaxVertices);
    const std::vector<double> weight = values(weights->second, 4, kMaxVertices);
    if (joint.size() != 4 * count || weight.size() != 4 * count)
      fail("joints or weights for another number of vertices than the primitive's " + std::to_string(count));
    for (std::size_t v = 0; v < count; ++v) {
      Carried& carried = carried_by_[first + v];
      double sum = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        const double w = weight[4 * v + i], j = joint[4 * v + i];
        if (!(w >= 0 && w < 1e6)) fail("vertex " + std::to_string(v) + " hangs on a joint by a weight below 0");
        if (w > 0 && !(j >= 0 && j < static_cast<double>(skin.joints.size())))
          fail("vertex " + std::to_string(v) + " hangs on a joint that the skin has not");
        carried.node[i] = w > 0 ? skin.joints[static_cast<std::size_t>(j)] : 0;
        carried.weight[i] = w;
        sum += w;
      }
      for (double& w : carried.weight) w = sum > 0 ? w / sum : 0.0;
    }
  }

  void addTargets(const tinygltf::Primitive& primitive, const Placed& placed, std::uint32_t first, std::size_t count) {
    const auto& names = document_.target_names[static_cast<std::size_t>(placed.mesh)];
    std::set<std::string> here;
    for (std::size_t k = 0; k < primitive.targets.size(); ++k) {
      const std::string given = k < names.size() ? tidyText(names[k]) : std::string();
      const std::string name = given.empty() ? "target " + std::to_string(k) : given;
      if (!here.insert(name).second) fail("two morph targets of one mesh are called '" + name + "'; rename one");
      auto shape = std::find_if(shapes_.begin(), shapes_.end(), [&](const auto& s) { return s.first == name; });
      if (shape == shapes_.end()) shape = shapes_.insert(shape, {name, {}});
      const auto position = primitive.targets[k].find("POSITION");
      if (position == primitive.targets[k].end()) continue;  // changes normals alone
      const std::vector<double> by = values(position->second, 3, kMaxVertices);
      if (by.size() != 3 * count)
        fail("morph target '" + name + "' for " + std::to_string(by.size() / 3) + " vertices, the primitive has " +
             std::to_string(count));
      shape->second.resize(coordinates_.size(), 0.0);
      for (std::size_t v = 0; v < count; ++v) {
        const Eigen::Vector3d moved =
            placed.scene_from_mesh.linear() * Eigen::Vector3d(by[3 * v], by[3 * v + 1], by[3 * v + 2]);
        if (!moved.allFinite()) fail("morph target '" + name + "' moves a vertex by what is not finite");
        for (int c = 0; c < 3; ++c) shape->second[3 * (first + v) + static_cast<std::size_t>(c)] = moved[c];
      }
    }
  }

  void addTriangles(const tinygltf::Primitive& primitive, int mode, std::uint32_t first, std::size_t count,
                    bool mirrored) {
    std::vector<std::uint32_t> corners;
    if (primitive.indices >= 0) {
      const std::vector<double> read = values(primitive.indices, 1, 3 * kMaxPolygons);
      corners.reserve(read.size());
      for (const double index : read) {
        if (!(index >= 0 && index < static_cast<double>(count)))
          fail("a face names vertex " + std::to_string(static_cast<std::int64_t>(std::clamp(index, -1e9, 1e10))) +
               ", its primitive has " + std::to_string(count));
        corners.push_back(first + static_cast<std::uint32_t>(index));
      }
    } else {
      corners.resize(count);
      for (std::size_t i = 0; i < count; ++i) corners[i] = first + static_cast<std::uint32_t>(i);
    }
    const bool list = mode == TINYGLTF_MODE_TRIANGLES;
    if (corners.size() < 3 || (list && corners.size() % 3 != 0))
      fail("a primitive of " + std::to_string(corners.size()) + " corners; triangles need three each");
    const std::size_t triangles = list ? corners.size() / 3 : corners.size() - 2;
    if (mesh_.polygon_start.size() + triangles > kMaxPolygons) fail("more than 2000000 triangles");
    for (std::size_t t = 0; t < triangles; ++t) {
      std::array<std::uint32_t, 3> corner{};
      if (list)
        corner = {corners[3 * t], corners[3 * t + 1], corners[3 * t + 2]};
      else if (mode == TINYGLTF_MODE_TRIANGLE_FAN)
        corner = {corners[t + 1], corners[t + 2], corners[0]};
      else
        corner = {corners[t], corners[t + 1 + t % 2], corners[t + 2 - t % 2]};
      if (mirrored) std::swap(corner[1], corner[2]);
      mesh_.polygon_start.push_back(static_cast<std::uint32_t>(mesh_.corner_vertices.size()));
      mesh_.corner_vertices.insert(mesh_.corner_vertices.end(), corner.begin(), corner.end());
      materials_.push_back(primitive.material);
    }
  }

  void nameMaterials() {
    bool any = false;
    for (const int material : materials_) any = any || material >= 0;
    if (!any) return;
    std::map<int, std::uint32_t> number;  // of the file -> of the mesh, in order of use
    for (const int material : materials_) {
      const auto [entry, fresh] = number.emplace(material, static_cast<std::uint32_t>(mesh_.materials.size()));
      mesh_.polygon_material.push_back(entry->second);
      if (!fresh) continue;
      Mesh::Material out{"none", {}};
      out.colour = Mesh::Material{}.colour;
      if (material >= 0 && static_cast<std::size_t>(material) < model_.materials.size()) {
        const tinygltf::Material& from = model_.materials[static_cast<std::size_t>(material)];
        out.name = tidyName(from.name, material);
        const auto& factor = from.pbrMetallicRoughness.baseColorFactor;
        const bool plain = !document_.textured[static_cast<std::size_t>(material)];
        if (plain && factor.size() >= 3)
          for (std::size_t c = 0; c < 3; ++c)
            out.colour[c] = std::isfinite(factor[c]) ? static_cast<float>(std::clamp(factor[c], 0.0, 1.0)) : 0.8F;
      } else if (material >= 0) {
        fail("material " + std::to_string(material) + " does not exist");
      }
      mesh_.materials.push_back(std::move(out));
    }
  }
  static std::string tidyText(const std::string& name) {
    std::string out = name.substr(0, 256);
    for (char& c : out)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
    const std::size_t first = out.find_first_not_of(' '), last = out.find_last_not_of(' ');
    return first == out.npos ? std::string() : out.substr(first, last - first + 1);
  }
  static std::string tidyName(const std::string& name, int number) {
    const std::string out = tidyText(name);
    return out.empty() ? "material " + std::to_string(number) : out;
  }

  // The artist's vertices again, where every vertex says which it was and all that say the same are at the same place.
  void putBackTogether(std::vector<VertexPositions>& shapes) {
    const std::size_t vertices = mesh_.vertexCount();
    std::size_t wanted = 0;
    for (const double number : original_) {
      if (!(number >= 0 && number < static_cast<double>(vertices)) || number != std::floor(number)) return;
      wanted = std::max(wanted, static_cast<std::size_t>(number) + 1);
    }
    std::vector<std::int64_t> from(wanted, -1);
    for (std::size_t v = 0; v < vertices; ++v) {
      std::int64_t& first = from[static_cast<std::size_t>(original_[v])];
      if (first < 0) first = static_cast<std::int64_t>(v);
      const auto a = static_cast<Eigen::Index>(first), b = static_cast<Eigen::Index>(v);
      if (mesh_.positions.row(a) != mesh_.positions.row(b)) return;
      for (const VertexPositions& shape : shapes)
        if (shape.row(a) != shape.row(b)) return;
    }
    for (const std::int64_t v : from)
      if (v < 0) return;
    VertexPositions positions(static_cast<Eigen::Index>(wanted), 3);
    std::vector<std::array<float, 3>> colours;
    for (std::size_t w = 0; w < wanted; ++w) {
      positions.row(static_cast<Eigen::Index>(w)) = mesh_.positions.row(from[w]);
      if (has_colours_) colours.push_back(mesh_.vertex_colours[static_cast<std::size_t>(from[w])]);
    }
    for (VertexPositions& shape : shapes) {
      VertexPositions whole(static_cast<Eigen::Index>(wanted), 3);
      for (std::size_t w = 0; w < wanted; ++w) whole.row(static_cast<Eigen::Index>(w)) = shape.row(from[w]);
      shape = std::move(whole);
    }
    std::vector<Carried> carried;
    for (const std::int64_t v : from) carried.push_back(carried_by_[static_cast<std::size_t>(v)]);
    carried_by_ = std::move(carried);
    mesh_.positions = std::move(positions);
    mesh_.vertex_colours = std::move(colours);
    for (std::uint32_t& v : mesh_.corner_vertices) v = static_cast<std::uint32_t>(original_[v]);
  }

  const GltfDocument& document_;
  const tinygltf::Model& model_;
  const std::string& name_;
  Mesh mesh_;
  Notes notes_;
  std::vector<double> coordinates_;
  std::vector<std::array<float, 2>> texcoords_;  // of vertices
  std::vector<std::array<float, 3>> colours_;    // of vertices
  std::vector<double> original_;                 // of vertices: _VOLTO_VERTEX, -1 without
  std::vector<int> materials_;                   // of triangles, the file's numbers
  bool has_texcoords_ = false, has_colours_ = false;
  std::size_t skipped_ = 0, values_read_ = 0;
  bool with_shapes_ = false, with_skin_ = false;
  std::vector<Carried> carried_by_;                                  // of vertices
  std::map<int, Eigen::Affine3d> mesh_from_joint_;                   // of nodes that are joints
  std::vector<int> order_, parent_;                                  // nodes of the scene, parents first; of each node
  std::vector<std::pair<std::string, std::vector<double>>> shapes_;  // name, displacement of the vertices so far
  std::set<std::pair<std::uint32_t, int>> applied_;  // first vertex and accessor of attributes that were read
};

}  // namespace

Mesh parseGltf(std::string_view bytes, const std::string& name_for_errors, const std::filesystem::path& folder) {
  const GltfDocument document = openGltf(bytes, name_for_errors, folder);
  return GltfMeshReader(document, name_for_errors, false).read();
}

ShapedMesh parseGltfShapes(std::string_view bytes, const std::string& name_for_errors,
                           const std::filesystem::path& folder) {
  const GltfDocument document = openGltf(bytes, name_for_errors, folder);
  ShapedMesh out = GltfMeshReader(document, name_for_errors, true).readShaped();
  if (out.names.empty()) throw InputError(name_for_errors + ": has no morph targets; export it with its shape keys");
  return out;
}

GltfSkin parseGltfSkin(std::string_view bytes, const std::string& name_for_errors, const std::filesystem::path& folder) {
  const GltfDocument document = openGltf(bytes, name_for_errors, folder);
  return GltfMeshReader(document, name_for_errors, false).readSkin();
}

}  // namespace volto::rig
