#include "tools/export/shape_folder.h"

#include <vector>

#include "retarget/face_deformer.h"
#include "rig/errors.h"
#include "rig/mesh_io.h"

namespace volto::exporter {
namespace {

constexpr const char* kMaterialFile = "materials.mtl";

std::string fileName(const std::string& shape) {
  bool good = !shape.empty() && shape.size() <= 200 && shape[0] != '.' && shape != "neutral";
  for (const char c : shape) good = good && static_cast<unsigned char>(c) > 0x1F && c != '/' && c != '\\' && c != 0x7F;
  if (!good) throw rig::InputError("a blendshape's name cannot be a file name; rename it, or export to GLB");
  return shape + ".obj";
}

}  // namespace

void writeShapeFolder(const std::filesystem::path& folder, const rig::Rig& rig,
                      const std::function<bool(std::size_t)>& progress) {
  for (const rig::Blendshape& shape : rig.blendshapes) fileName(shape.name);
  rig::ObjOptions options;
  options.normals = true;
  if (!rig.neutral.materials.empty()) {
    options.material_library = kMaterialFile;
    rig::writeMtl(folder / kMaterialFile, rig.neutral);
  }
  rig::writeObj(folder / "neutral.obj", rig.neutral, rig.neutral.positions, options);
  const retarget::FaceDeformer deformer(rig);
  std::vector<float> weights(rig.blendshapes.size(), 0.0F);
  std::vector<retarget::Vertex> shaped(rig.neutral.vertexCount());
  rig::VertexPositions positions = rig.neutral.positions;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    if (!progress(k + 1)) return;
    weights[k] = 1.0F;
    deformer.deformAtWeights(weights, shaped);
    weights[k] = 0.0F;
    for (std::size_t v = 0; v < shaped.size(); ++v)
      for (std::size_t axis = 0; axis < 3; ++axis)
        positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) = static_cast<double>(shaped[v][axis]);
    rig::writeObj(folder / fileName(rig.blendshapes[k].name), rig.neutral, positions, options);
  }
}

}  // namespace volto::exporter
