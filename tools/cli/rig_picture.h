// A rig's health as a picture: the mask on the mesh, the regions in colour, the expression that goes worst.
#pragma once

#include <filesystem>

#include "rig/rig.h"

namespace volto::cli {

// A PNG of six cells. Throws CommandError when it cannot be written.
void writeRigPicture(const std::filesystem::path& path, const rig::Rig& rig);

}  // namespace volto::cli
