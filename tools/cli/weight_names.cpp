#include "tools/cli/weight_names.h"

#include <CLI/CLI.hpp>

#include "tools/cli/exit_status.h"
#include "tools/cli/shape_set_flag.h"

namespace volto::cli {

void addWeightNameFlags(CLI::App& app, WeightNameFlags& flags) {
  app.add_option("--weights-as", flags.weights_as,
                 "send weights in the names of another set: arkit, facs, ict, vrm0, vrm1, or a CSV file of your own")
      ->type_name("SET");
  app.add_option("--shapes-mean", flags.shapes_mean,
                 "with --weights-as: what the character's own shapes are in ARKit's terms (default: told by their "
                 "names): the same sets, or a CSV file with shape,arkit,weight")
      ->type_name("SET");
}

std::optional<rig::ShapeTranslation> translationFor(const WeightNameFlags& flags, const rig::Rig& rig) {
  if (flags.weights_as.empty()) {
    if (!flags.shapes_mean.empty()) throw CommandError(kWrongUsage, "--shapes-mean is for --weights-as");
    return {};
  }
  std::optional<rig::ShapeSet> meaning;
  if (!flags.shapes_mean.empty()) meaning = readShapeSet(flags.shapes_mean);
  return rig::ShapeTranslation(rig::blendshapeNames(rig), meaning ? &*meaning : nullptr,
                               readShapeSet(flags.weights_as));
}

void rename(const rig::ShapeTranslation& translation, protocol::Character& character) {
  character.blendshape_names.clear();
  for (const rig::ShapeSet::Shape& shape : translation.to().shapes()) character.blendshape_names.push_back(shape.name);
}

}  // namespace volto::cli
