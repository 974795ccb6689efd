// What a message must be beyond well-formed bytes: the same rules for what we send and for what we accept.
#pragma once

#include <span>

#include "protocol/errors.h"
#include "protocol/messages.h"

namespace volto::protocol {

Result validate(const Stamp& stamp);
Result validate(const LandmarkFrame& frame);
Result validate(const MaskFrame& frame);
// All of an AvatarFrame but its vertices; weights may be of any number up to kMaxBlendshapes.
Result validateWeights(const AvatarFrame& frame);
// State, head, gaze and the number of vertices, not what they are: that costs a pass over the mesh, which only the
// receiver makes.
Result validateMesh(const AvatarFrame& frame, std::size_t vertex_count);
Result validate(const Character& character);
Result validate(const StatusReport& report);

bool allFinite(std::span<const float> values);
bool allFinite(std::span<const std::array<float, 2>> values);
bool allFinite(std::span<const std::array<float, 3>> values);

}  // namespace volto::protocol
