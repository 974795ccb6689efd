// The options that say in whose words weights are sent: the same in every verb that publishes.
#pragma once

#include <optional>
#include <string>

#include "protocol/messages.h"
#include "rig/rig.h"
#include "rig/shape_translation.h"

namespace CLI {
class App;
}

namespace volto::cli {

struct WeightNameFlags {
  std::string weights_as, shapes_mean;
};

void addWeightNameFlags(CLI::App& app, WeightNameFlags& flags);

// Nothing where the character's own names are wanted. Throws CommandError for a set that is none, or for --shapes-mean
// alone; rig::InputError for a bad file, or where none of the character's names means anything.
std::optional<rig::ShapeTranslation> translationFor(const WeightNameFlags& flags, const rig::Rig& rig);

// The names of what will be sent.
void rename(const rig::ShapeTranslation& translation, protocol::Character& character);

}  // namespace volto::cli
