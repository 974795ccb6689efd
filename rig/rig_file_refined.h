// The refined mask's part of a rig file (rig/rig_file.h).
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "rig/refined_mask.h"
#include "rig_file_generated.h"

namespace volto::rig {

flatbuffers::Offset<file::RefinedMask> encodeRefinedMask(flatbuffers::FlatBufferBuilder& builder,
                                                         const RefinedMask& mask);

// Checks everything against a mesh of `vertices`; `fail` throws with what is wrong.
RefinedMask decodeRefinedMask(const file::RefinedMask& in, std::size_t vertices,
                              const std::function<void(const std::string&)>& fail);

}  // namespace volto::rig
