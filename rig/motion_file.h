// The part of the rig file that says how a character moves beyond its operator: corrections, combinations, turning
// parts, contacts. Used by rig_file.cpp alone.
#pragma once

#include "rig/rig.h"
#include "rig_file_generated.h"

namespace volto::rig {

flatbuffers::Offset<file::Motion> encodeMotion(flatbuffers::FlatBufferBuilder& builder, const Rig& rig);

// Into a rig whose mesh and blendshapes are there already. Throws std::invalid_argument that says what does not fit.
void decodeMotion(const file::Motion* motion, Rig& rig);

}  // namespace volto::rig
