// CHARACTER.rig: a Rig as one FlatBuffers file, with a checksum so that a cut or a flipped bit is noticed.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "rig/errors.h"
#include "rig/rig.h"

namespace volto::rig {

std::vector<std::byte> encodeRig(const Rig& rig);                                                // the same rig gives the same bytes
Rig decodeRig(std::span<const std::byte> bytes, const std::string& name_for_errors);             // throws InputError
void writeRig(const std::filesystem::path& path, const Rig& rig);                                // whole or not at all
Rig readRig(const std::filesystem::path& path);                                                  // InputError, std::system_error

}  // namespace volto::rig
