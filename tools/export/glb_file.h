// A character as GLB (glTF 2.0, Khronos 2021), which Blender, Unity, Unreal, Godot and browsers open.
//
// Nodes: NAME (turned so that +Y is up and the face looks along +Z, as glTF wants it) > head (turns about the middle
// between the ears) > face, leftEye, rightEye (turn about their centres). The face has one morph target per blendshape,
// by its name, with positions and normals; the eyes have none, they turn. Vertices are the artist's, single precision,
// with their number as attribute _VOLTO_VERTEX, so that Volto reads the mesh back as it was.
#pragma once

#include <string>

#include "rig/gltf_skin.h"
#include "rig/rig.h"
#include "tools/export/movement.h"

namespace volto::exporter {

// The bytes of the file; the same input gives the same bytes. `movement`: an animation "take" of weights and rotations,
// or null. What a morph target is, is deformAtWeights() with that shape's weight 1 (retarget/face_deformer.h). Throws
// `skin`: bones that carry the face besides, or null; one entry per vertex of the rig's mesh (std::invalid_argument
// otherwise). Its joints stand below `head` and turn with it; the eyes hang on `head` alone. Throws std::length_error
// above 2 GB.
std::string formatGlb(const rig::Rig& rig, const Movement* movement = nullptr, const rig::GltfSkin* skin = nullptr);

}  // namespace volto::exporter
