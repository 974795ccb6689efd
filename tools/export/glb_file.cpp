#include "tools/export/glb_file.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include <Eigen/Geometry>

#include "retarget/face_deformer.h"
#include "tools/export/character_parts.h"
#include "tools/export/glb_buffer.h"

namespace volto::exporter {
namespace {

// Displacements below this part of the eye separation are nothing: half a micrometre on a person.
constexpr double kLeastDisplacement = 1e-5;
constexpr float kLeastNormalChange = 2e-3F;

class GlbMaker {
 public:
  GlbMaker(const rig::Rig& rig, const Movement* movement, const rig::GltfSkin* skin)
      : rig_(rig), movement_(movement), skin_(skin), parts_(takeApart(rig)), buffer_(model_) {}

  std::string make() {
    model_.asset.version = "2.0";
    model_.asset.generator = "Volto";
    materials();
    nodes();
    if (movement_ != nullptr && movement_->frameCount() > 0) animation();
    std::ostringstream out(std::ios::binary);
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&model_, out, false, true))
      throw std::runtime_error("the GLB file could not be put together");
    return std::move(out).str();
  }

 private:
  static Float3 single(const Eigen::Vector3d& v) {
    return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
  }

  void materials() {
    for (const ExportMaterial& from : parts_.materials) {
      tinygltf::Material out;
      out.name = from.name;
      auto& pbr = out.pbrMetallicRoughness;
      pbr.baseColorFactor = {rounded(from.colour[0]), rounded(from.colour[1]), rounded(from.colour[2]),
                             rounded(from.opacity)};
      pbr.metallicFactor = 0.0;
      pbr.roughnessFactor = rounded(from.roughness);
      if (from.opacity < 1.0F) out.alphaMode = "BLEND";
      out.doubleSided = from.double_sided;
      model_.materials.push_back(std::move(out));
    }
  }
  // As a person would write it; the JSON stays short.
  static double rounded(float x) { return std::round(static_cast<double>(x) * 1e4) / 1e4; }

  void nodes() {
    const Eigen::Vector3d pivot = headPivot();
    tinygltf::Node root, head;
    root.name = rig_.name.empty() ? "character" : rig_.name;
    root.children = {1};
    const Eigen::Quaterniond upright = uprightRotation();
    if (std::abs(upright.w()) < 1.0 - 1e-9) root.rotation = {upright.x(), upright.y(), upright.z(), upright.w()};
    head.name = "head";
    head.translation = {pivot.x(), pivot.y(), pivot.z()};
    for (std::size_t p = 0; p < parts_.parts.size(); ++p)
      if (!skinned(parts_.parts[p])) head.children.push_back(static_cast<int>(2 + p));
    model_.nodes.push_back(std::move(root));
    model_.nodes.push_back(std::move(head));
    for (const ExportPart& part : parts_.parts) {
      tinygltf::Node node;
      node.name = part.name;
      node.mesh = static_cast<int>(model_.meshes.size());
      const Eigen::Vector3d move = Eigen::Vector3d(part.origin[0], part.origin[1], part.origin[2]) - pivot;
      if (!skinned(part)) node.translation = {move.x(), move.y(), move.z()};
      model_.nodes.push_back(std::move(node));
      mesh(part);
    }
    tinygltf::Scene scene;
    scene.nodes = {0};
    if (skin_ != nullptr) joints(pivot, scene);
    model_.scenes.push_back(std::move(scene));
    model_.defaultScene = 0;
  }

  // A skinned mesh is where its joints put it, wherever its node is: it stands at the top, its vertices in the artist's
  // frame.
  bool skinned(const ExportPart& part) const { return skin_ != nullptr && !part.eye; }

  void joints(const Eigen::Vector3d& pivot, tinygltf::Scene& scene) {
    const auto first = static_cast<int>(model_.nodes.size());
    tinygltf::Skin out;
    std::vector<std::array<float, 16>> bind;
    for (std::size_t j = 0; j < skin_->joints.size(); ++j) {
      const rig::GltfSkin::Joint& joint = skin_->joints[j];
      Eigen::Affine3d above(Eigen::Translation3d{pivot});
      if (joint.parent >= 0) above = skin_->joints[static_cast<std::size_t>(joint.parent)].mesh_from_joint;
      tinygltf::Node node;
      node.name = joint.name;
      place(above.inverse(Eigen::Affine) * joint.mesh_from_joint, node);
      model_.nodes.push_back(std::move(node));
      const int parent = joint.parent >= 0 ? first + joint.parent : 1;
      model_.nodes[static_cast<std::size_t>(parent)].children.push_back(first + static_cast<int>(j));
      out.joints.push_back(first + static_cast<int>(j));
      Eigen::Map<Eigen::Matrix4f>(bind.emplace_back().data()) =
          joint.mesh_from_joint.inverse(Eigen::Affine).matrix().cast<float>();
      bind.back()[3] = bind.back()[7] = bind.back()[11] = 0.0F;
      bind.back()[15] = 1.0F;
    }
    out.inverseBindMatrices = buffer_.matrices4(bind);
    model_.skins.push_back(std::move(out));
    for (std::size_t p = 0; p < parts_.parts.size(); ++p) {
      if (!skinned(parts_.parts[p])) continue;
      model_.nodes[2 + p].skin = 0;
      scene.nodes.push_back(static_cast<int>(2 + p));
    }
  }

  // Turn, stretch and shift where the transform is no more than that, which programs can animate; else the matrix.
  static void place(const Eigen::Affine3d& transform, tinygltf::Node& node) {
    Eigen::Matrix3d rotation, stretch;
    transform.computeRotationScaling(&rotation, &stretch);
    const Eigen::Vector3d scale = stretch.diagonal();
    if ((stretch - Eigen::Matrix3d(scale.asDiagonal())).norm() > 1e-6 * stretch.norm()) {
      const Eigen::Matrix4d m = transform.matrix();
      node.matrix.assign(m.data(), m.data() + 16);
      return;
    }
    const Eigen::Quaterniond q(rotation);
    const Eigen::Vector3d shift = transform.translation();
    node.rotation = {q.x(), q.y(), q.z(), q.w()};
    node.translation = {shift.x(), shift.y(), shift.z()};
    if ((scale - Eigen::Vector3d::Ones()).norm() > 1e-6) node.scale = {scale.x(), scale.y(), scale.z()};
  }

  // Where a head turns: between the ears. On a grid of the head's size / 1024, so that moving there and back again
  // changes no bit of a vertex.
  Eigen::Vector3d headPivot() const {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const char* id : {"10.7", "10.8"})
      middle += 0.5 * rig_.feature_positions.row(static_cast<Eigen::Index>(*rig::featurePointIndex(id))).transpose();
    const double size =
        (rig_.neutral.positions.colwise().maxCoeff() - rig_.neutral.positions.colwise().minCoeff()).norm();
    const double step = std::exp2(std::floor(std::log2(std::max(size, 1e-30))) - 10.0);
    return (middle / step).array().round() * step;
  }

  // Meshes stand in their artist's frame, glTF's up is +Y and its front +Z: the right angles that are nearest to that.
  // None for most heads.
  Eigen::Quaterniond uprightRotation() const {
    const Eigen::Matrix3d head_from_mesh = rig_.mesh_from_head.transpose();
    Eigen::Matrix3d best = Eigen::Matrix3d::Identity();
    double best_trace = -4.0;
    const Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b)
        for (int signs = 0; a != b && signs < 4; ++signs) {
          Eigen::Matrix3d turn;
          turn.row(0) = ((signs & 1) != 0 ? -1.0 : 1.0) * unit.row(a);
          turn.row(1) = ((signs & 2) != 0 ? -1.0 : 1.0) * unit.row(b);
          turn.row(2) = turn.row(0).cross(turn.row(1));
          const double trace = (head_from_mesh * turn.transpose()).trace();
          if (trace > best_trace + 1e-9) best_trace = trace, best = turn;
        }
    return Eigen::Quaterniond(best);
  }

  void mesh(const ExportPart& part) {
    Eigen::RowVector3d origin(part.origin[0], part.origin[1], part.origin[2]);
    if (skinned(part)) origin.setZero();
    std::vector<Float3> positions, normals;
    std::vector<float> numbers;
    if (base_normals_.rows() == 0) base_normals_ = rig::smoothNormals(rig_.neutral, rig_.neutral.positions);
    for (const std::uint32_t v : part.vertex) {
      positions.push_back(single((rig_.neutral.positions.row(v) - origin).transpose()));
      normals.push_back(single(base_normals_.row(v).transpose()));
      numbers.push_back(static_cast<float>(v));
    }
    tinygltf::Primitive common;
    common.mode = TINYGLTF_MODE_TRIANGLES;
    common.attributes["POSITION"] = buffer_.vectors3(positions, true);
    common.attributes["NORMAL"] = buffer_.vectors3(normals, false);
    if (!part.texcoords.empty()) {
      std::vector<std::array<float, 2>> uv = part.texcoords;
      for (auto& c : uv) c[1] = 1.0F - c[1];
      common.attributes["TEXCOORD_0"] = buffer_.vectors2(uv);
    }
    if (!part.colours.empty()) common.attributes["COLOR_0"] = buffer_.colours(part.colours);
    common.attributes["_VOLTO_VERTEX"] = buffer_.floats(numbers, false);
    model_.bufferViews.back().target = TINYGLTF_TARGET_ARRAY_BUFFER;
    if (skinned(part)) {
      std::vector<std::array<std::uint16_t, 4>> joint;
      std::vector<std::array<float, 4>> weight;
      for (const std::uint32_t v : part.vertex) {
        joint.push_back(skin_->joint[v]);
        weight.push_back(skin_->weight[v]);
        // What no bone carries stays with the first.
        if (weight.back() == std::array<float, 4>{}) weight.back()[0] = 1.0F;
      }
      common.attributes["JOINTS_0"] = buffer_.joints(joint);
      common.attributes["WEIGHTS_0"] = buffer_.vectors4(weight);
      model_.bufferViews.back().target = TINYGLTF_TARGET_ARRAY_BUFFER;
    }
    tinygltf::Mesh out;
    out.name = part.name;
    if (!part.eye) morphTargets(part, common, out);
    for (const ExportPart::Group& group : part.groups) {
      tinygltf::Primitive primitive = common;
      primitive.indices = buffer_.indices(group.corners, part.vertex.size());
      primitive.material = static_cast<int>(group.material);
      out.primitives.push_back(std::move(primitive));
    }
    model_.meshes.push_back(std::move(out));
  }

  void morphTargets(const ExportPart& part, tinygltf::Primitive& primitive, tinygltf::Mesh& mesh) {
    const retarget::FaceDeformer deformer(rig_);
    const std::size_t vertices = rig_.neutral.vertexCount();
    std::vector<retarget::Vertex> neutral(vertices), shaped(vertices);
    std::vector<float> weights(rig_.blendshapes.size(), 0.0F);
    deformer.deformAtWeights(weights, neutral);
    rig::VertexPositions positions(static_cast<Eigen::Index>(vertices), 3);
    const auto least = static_cast<float>(kLeastDisplacement * rig_.fapu.fapu.eye_separation);
    tinygltf::Value::Array names;
    for (std::size_t k = 0; k < weights.size(); ++k) {
      weights[k] = 1.0F;
      deformer.deformAtWeights(weights, shaped);
      weights[k] = 0.0F;
      for (std::size_t v = 0; v < vertices; ++v)
        for (std::size_t axis = 0; axis < 3; ++axis)
          positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) =
              static_cast<double>(shaped[v][axis]);
      const rig::VertexPositions turned = rig::smoothNormals(rig_.neutral, positions);
      std::vector<Float3> move, turn;
      for (const std::uint32_t v : part.vertex) {
        Float3 d;
        for (std::size_t axis = 0; axis < 3; ++axis) d[axis] = shaped[v][axis] - neutral[v][axis];
        move.push_back(d);
        turn.push_back(single((turned.row(v) - base_normals_.row(v)).transpose()));
      }
      primitive.targets.push_back({{"POSITION", buffer_.sparseVectors3(move, least, true)},
                                   {"NORMAL", buffer_.sparseVectors3(turn, kLeastNormalChange, false)}});
      names.emplace_back(rig_.blendshapes[k].name);
    }
    mesh.weights.assign(weights.size(), 0.0);
    mesh.extras = tinygltf::Value(tinygltf::Value::Object{{"targetNames", tinygltf::Value(names)}});
  }

  void animation() {
    tinygltf::Animation out;
    out.name = "take";
    const Movement& m = *movement_;
    std::vector<float> times(m.time_s.begin(), m.time_s.end());
    // Single precision counts microseconds up to a quarter of a minute and tenths of a millisecond for half an hour:
    // still rising.
    for (std::size_t t = 1; t < times.size(); ++t)
      if (times[t] <= times[t - 1]) times[t] = std::nextafter(times[t - 1], 1e30F);
    const int input = buffer_.floats(times, true);
    const auto channel = [&](int node, const char* path, int output) {
      tinygltf::AnimationSampler sampler;
      sampler.input = input;
      sampler.output = output;
      sampler.interpolation = "LINEAR";
      tinygltf::AnimationChannel to;
      to.sampler = static_cast<int>(out.samplers.size());
      to.target_node = node;
      to.target_path = path;
      out.samplers.push_back(std::move(sampler));
      out.channels.push_back(std::move(to));
    };
    for (std::size_t p = 0; p < parts_.parts.size(); ++p) {
      const int node = static_cast<int>(2 + p);
      const std::string& name = parts_.parts[p].name;
      if (name == "face" && !rig_.blendshapes.empty()) channel(node, "weights", buffer_.floats(m.weights, false));
      if (name == "leftEye" && m.left_eye_moves) channel(node, "rotation", buffer_.vectors4(m.left_eye));
      if (name == "rightEye" && m.right_eye_moves) channel(node, "rotation", buffer_.vectors4(m.right_eye));
    }
    if (m.head_moves) channel(1, "rotation", buffer_.vectors4(m.head));
    if (!out.channels.empty()) model_.animations.push_back(std::move(out));
  }

  const rig::Rig& rig_;
  const Movement* movement_;
  const rig::GltfSkin* skin_;
  CharacterParts parts_;
  tinygltf::Model model_;
  GlbBuffer buffer_;
  rig::VertexPositions base_normals_;
};

}  // namespace

std::string formatGlb(const rig::Rig& rig, const Movement* movement, const rig::GltfSkin* skin) {
  if (skin != nullptr && (skin->joints.empty() || skin->joint.size() != rig.neutral.vertexCount()))
    throw std::invalid_argument("a skin of " + std::to_string(skin->joint.size()) + " vertices for a mesh of " +
                                std::to_string(rig.neutral.vertexCount()));
  return GlbMaker(rig, movement, skin).make();
}

}  // namespace volto::exporter
