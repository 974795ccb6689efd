// volto import: a character gets a set of blendshapes of its own, from meshes or from a glTF file's morph targets.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "retarget/blendshape_set.h"
#include "retarget/face_deformer.h"
#include "rig/mesh_io.h"
#include "rig/rig_file.h"
#include "rig/shape_translation.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/cli/read_input.h"
#include "tools/cli/shape_set_flag.h"
#include "tools/cli/verb.h"
#include "transfer/matched_shapes.h"
#include "transfer/mesh_set.h"

namespace volto::cli {
namespace {

struct Options {
  std::string shapes, rig, output;
  bool quiet = false;
};

bool isGltf(const std::filesystem::path& path) { return hasExtension(path, ".glb") || hasExtension(path, ".gltf"); }

struct Shapes {
  std::vector<std::string> names;
  std::vector<rig::VertexPositions> positions;
};

Shapes fromFolder(const Options& options, const rig::Mesh& neutral) {
  transfer::MeshSet set = transfer::readMeshSet(options.shapes, neutral);
  Shapes out{std::move(set.names), std::move(set.positions)};
  // The face at rest lies beside its expressions in many folders (volto export writes it there): it is no shape.
  const auto rest = std::find(out.names.begin(), out.names.end(), "neutral");
  if (rest != out.names.end()) {
    out.positions.erase(out.positions.begin() + (rest - out.names.begin()));
    out.names.erase(rest);
  }
  return out;
}

Shapes fromGltf(const Options& options, const rig::Mesh& neutral) {
  requireReadable(options.shapes);
  rig::ShapedMesh read = rig::readGltfShapes(options.shapes);
  std::vector<rig::VertexPositions> positions = transfer::matchedShapes(neutral, read, options.shapes);
  return {std::move(read.names), std::move(positions)};
}

// The shapes of a known set, made of the character's own: what each means in ARKit's terms, said in its shapes, and
// deformed as it deforms.
Shapes fromShapeSet(const Options& options, const rig::Rig& rig) {
  const rig::ShapeSet wanted = readShapeSet(options.shapes);
  const std::vector<std::string> own = rig::blendshapeNames(rig);
  const rig::ShapeSet* known = rig::shapeSetOf(own);
  if (known == nullptr)
    throw CommandError(kBadData, options.rig +
                                     ": its blendshapes belong to no set that Volto knows (arkit, facs, ict, "
                                     "vrm0, vrm1), so nothing can be made of them");
  const rig::ShapeSet meaning = rig::ShapeSet::ofNames(own, *known);
  retarget::FaceDeformer deformer(rig);
  Shapes out;
  std::vector<float> weights(own.size());
  std::vector<std::uint8_t> observed(own.size());
  std::vector<std::array<float, 3>> vertices(rig.neutral.vertexCount());
  for (const rig::ShapeSet::Shape& shape : wanted.shapes()) {
    ArkitWeights arkit{};
    for (const rig::ShapeSet::Part& part : shape.parts) arkit[part.arkit] = static_cast<float>(part.weight);
    meaning.fromArkit(arkit, ArkitObserved().set(), weights, observed);
    deformer.deformAtWeights(weights, vertices);
    out.names.push_back(shape.name);
    rig::VertexPositions& positions = out.positions.emplace_back(rig.neutral.positions);
    for (std::size_t v = 0; v < vertices.size(); ++v)
      for (std::size_t axis = 0; axis < 3; ++axis)
        positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) =
            static_cast<double>(vertices[v][axis]);
  }
  return out;
}

int run(const Options& options) {
  requireReadable(options.rig);
  requireReplaceable(options.output);
  const bool folder = std::filesystem::is_directory(options.shapes);
  const bool set = !folder && isShapeSetName(options.shapes);
  if (std::filesystem::path(options.shapes).extension().empty() && !std::filesystem::exists(options.shapes))
    (void)readShapeSet(options.shapes);  // a known set, or an error that names the nearest
  if (!folder && !set && !isGltf(options.shapes)) {
    requireReadable(options.shapes);
    throw CommandError(kBadData,
                       options.shapes + ": give a folder of meshes, or a .glb or .gltf file with morph targets");
  }
  rig::Rig rig = rig::readRig(options.rig);
  const Shapes shapes = folder ? fromFolder(options, rig.neutral)
                        : set  ? fromShapeSet(options, rig)
                               : fromGltf(options, rig.neutral);
  std::vector<std::string> still;
  try {
    still = retarget::replaceBlendshapes(rig, shapes.names, shapes.positions);
  } catch (const rig::InputError& error) {
    throw rig::InputError(options.shapes + ": " + error.what());
  }
  rig::writeRig(options.output, rig);
  if (options.quiet) return kDone;
  std::printf("%zu blendshapes: %s\n", rig.blendshapes.size(), options.output.c_str());
  for (const std::string& name : still) std::printf("note: %s moves nothing; kept as an empty shape\n", name.c_str());
  for (const rig::Blendshape& shape : rig.blendshapes)
    if (!shape.moves_mask && std::find(still.begin(), still.end(), shape.name) == still.end())
      std::printf("note: %s moves none of the 84 points; a live face cannot drive it\n", shape.name.c_str());
  return kDone;
}

}  // namespace

RunVerb defineImport(CLI::App& app) {
  auto options = std::make_shared<Options>();
  app.add_option(
         "shapes", options->shapes,
         "folder of meshes, one per shape, with the character's vertices in its order (what volto transfer and "
         "volto export "
         "write); or a GLB or glTF file with named morph targets of the same mesh; or a set of names (arkit, facs, "
         "ict, vrm0, vrm1, or a CSV file of your own), whose shapes are made of those that the character has")
      ->required()
      ->type_name("DIR|F.glb|SET");
  app.add_option("--rig", options->rig, "the character that gets them")->required()->type_name("C.rig");
  app.add_option("-o,--output", options->output, "the character with its new set; may be C.rig itself")
      ->required()
      ->type_name("D.rig");
  app.add_flag("--quiet", options->quiet, "print nothing");
  return [options] { return run(*options); };
}

}  // namespace volto::cli
