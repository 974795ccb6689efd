// A set of blendshapes that the command line names: one of Volto's, or a file.
#pragma once

#include <string>

#include "rig/shape_set.h"

namespace volto::cli {

// arkit, facs, ict, vrm0, vrm1, or the path of a CSV file. Throws CommandError (kWrongUsage) for a name that is
// neither, with the nearest known one; rig::InputError for a bad file.
rig::ShapeSet readShapeSet(const std::string& name_or_file);

// True for what readShapeSet() would take without looking at files: a known set's name, or something.csv.
bool isShapeSetName(const std::string& text);

}  // namespace volto::cli
