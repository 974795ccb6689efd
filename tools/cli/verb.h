// A verb of `volto`: a name, a line of summary, its options and what it does. One file per verb.
#pragma once

#include <functional>
#include <span>
#include <string_view>

namespace CLI {
class App;
}

namespace volto::cli {

// Runs the verb with the options that were parsed; returns the exit status, or throws (exit_status.h).
using RunVerb = std::function<int()>;

struct Verb {
  std::string_view name;
  std::string_view summary;
  RunVerb (*define)(CLI::App& app);  // declares the options on `app`, which outlives what is returned
};

RunVerb defineRig(CLI::App& app);
RunVerb defineRun(CLI::App& app);
RunVerb defineReplay(CLI::App& app);
RunVerb defineRecord(CLI::App& app);
RunVerb defineBake(CLI::App& app);
RunVerb defineAnimate(CLI::App& app);
RunVerb defineExport(CLI::App& app);
RunVerb defineTrack(CLI::App& app);
RunVerb defineInspect(CLI::App& app);
RunVerb defineCameras(CLI::App& app);
RunVerb defineDoctor(CLI::App& app);
RunVerb defineTransfer(CLI::App& app);
RunVerb defineImport(CLI::App& app);
RunVerb defineEvaluate(CLI::App& app);

// In the order a person meets them.
std::span<const Verb> verbs();

}  // namespace volto::cli
