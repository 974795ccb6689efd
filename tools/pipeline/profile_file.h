// An actor's profile: the face at rest and its habits, so that the next session begins where the last one ended. A
// small JSON file.
#pragma once

#include <filesystem>
#include <string>

#include "tracker/tracker.h"

namespace volto::pipeline {

std::string profileText(const tracker::NeutralFace& face);
// Throws capture::InputError ("file: what; what to do"), std::system_error when it cannot be opened.
tracker::NeutralFace readProfile(const std::filesystem::path& path);

}  // namespace volto::pipeline
