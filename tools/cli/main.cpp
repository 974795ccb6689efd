// `volto`: one command with verbs.
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>

#include "capture/errors.h"
#include "capture/image_source.h"
#include "protocol/errors.h"
#include "rig/errors.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/nearest_match.h"
#include "tools/cli/stop_signal.h"
#include "tools/cli/verb.h"

namespace volto::cli {

namespace {

constexpr Verb kVerbs[] = {
    {"rig", "rig a mesh: from an OBJ and its feature points to a character", defineRig},
    {"run", "put a live face on a character and publish it: a camera, a video, landmarks by UDP", defineRun},
    {"replay", "play a recorded performance on a character and publish it", defineReplay},
    {"record", "record what an endpoint publishes into a take", defineRecord},
    {"bake", "play a performance on a character into OBJ, GLB, CSV or PNG files", defineBake},
    {"animate", "play a written script on a character: to subscribers or into files", defineAnimate},
    {"export", "a character for other programs: GLB with morph targets, or OBJ files", defineExport},
    {"track", "turn a performance into blendshape weights, without a character", defineTrack},
    {"inspect", "say what a rig, take, mesh or CSV file holds and how healthy it is", defineInspect},
    {"cameras", "list the cameras and what they can do; try one", defineCameras},
    {"doctor", "say which models are there, which are missing and how to get them", defineDoctor},
    {"transfer", "one character's expressions on another's face", defineTransfer},
    {"import", "give a character blendshapes of its own: from meshes or morph targets", defineImport},
    {"evaluate", "compare a set of expression meshes with what it should be", defineEvaluate},
};

void printHelp() {
  std::puts("Volto: live facial performance capture. Landmarks in, blendshape weights and a deformed character out.\n");
  std::puts("Usage: volto VERB [OPTIONS]\n");
  for (const Verb& verb : verbs()) {
    std::printf("  %-9s %s\n", std::string(verb.name).c_str(), std::string(verb.summary).c_str());
  }
  std::puts("  help      this page, or `volto help VERB` for one verb\n");
  std::puts(
      "Exit status: 0 done, 1 it failed, 2 wrong usage, 65 bad input data, 66 no such input, 69 device or service "
      "unavailable,");
  std::puts("78 bad configuration. Version: volto --version.");
}

// One line whatever the message holds.
int printError(std::string_view who, std::string message, int status) {
  std::replace_if(
      message.begin(), message.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; }, ' ');
  while (message.ends_with(' ')) message.pop_back();
  std::fprintf(stderr, "%.*s: %s\n", static_cast<int>(who.size()), who.data(), message.c_str());
  return status;
}

const Verb* findVerb(std::string_view name) {
  const auto found = std::find_if(verbs().begin(), verbs().end(), [&](const Verb& verb) { return verb.name == name; });
  return found == verbs().end() ? nullptr : &*found;
}

int unknownVerb(const std::string& typed) {
  std::vector<std::string> names{"help"};
  for (const Verb& verb : verbs()) names.emplace_back(verb.name);
  const std::string nearest = nearestMatch(typed, names);
  const std::string hint = nearest.empty() ? "see volto help" : "did you mean " + nearest + "?";
  return printError("volto", "there is no verb '" + typed + "'; " + hint, kWrongUsage);
}

// The first argument that looks like a long option and is none of `app`'s; empty when there is none.
std::string unknownOption(const CLI::App& app, const std::vector<std::string>& arguments) {
  for (const std::string& argument : arguments) {
    if (argument == "--") break;
    const std::string name = argument.substr(0, argument.find('='));
    if (name.starts_with("--") && app.get_option_no_throw(name) == nullptr) return name;
  }
  return {};
}

int exitStatusOf(const std::system_error& error) {
  if (error.code().category() != std::generic_category() && error.code().category() != std::system_category())
    return kFailed;
  switch (error.code().value()) {
    case ENOENT:
    case ENOTDIR:
    case EACCES:
    case EISDIR:
    case ELOOP:
    case ENAMETOOLONG:
      return kNoInput;
    case EADDRINUSE:
    case EADDRNOTAVAIL:
    case ECONNREFUSED:
    case EBUSY:
      return kUnavailable;
    default:
      return kFailed;
  }
}

int runVerb(const Verb& verb, std::vector<std::string> arguments) {
  const std::string who = "volto " + std::string(verb.name);
  CLI::App app{std::string(verb.summary), who};
  const RunVerb run = verb.define(app);
  if (const std::string unknown = unknownOption(app, arguments); !unknown.empty()) {
    std::vector<std::string> known;
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    }
    const std::string nearest = nearestMatch(unknown, known);
    const std::string hint =
        nearest.empty() ? "see volto help " + std::string(verb.name) : "did you mean " + nearest + "?";
    return printError(who, "there is no option " + unknown + "; " + hint, kWrongUsage);
  }
  try {
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
    app.parse(std::move(arguments));
  } catch (const CLI::CallForHelp&) {
    std::fputs(app.help().c_str(), stdout);
    return kDone;
  } catch (const CLI::ParseError& error) {
    return printError(who, std::string(error.what()) + "; see volto help " + std::string(verb.name), kWrongUsage);
  }
  try {
    const int status = run();
    if (std::fflush(stdout) != 0)
      return printError(who, "standard output cannot be written; was its reader closed?", kFailed);
    return status;
  } catch (const CommandError& error) {
    return printError(who, error.what(), error.status());
  } catch (const rig::InputError& error) {
    return printError(who, error.what(), kBadData);
  } catch (const capture::InputError& error) {
    return printError(who, error.what(), kBadData);
  } catch (const capture::DeviceError& error) {
    return printError(who, error.what(), kUnavailable);
  } catch (const protocol::SetupError& error) {
    return printError(who, error.what(), error.exitStatus());
  } catch (const std::system_error& error) {
    return printError(who, error.what(), exitStatusOf(error));
  } catch (const std::bad_alloc&) {
    return printError(who, "out of memory; close other programs or give a smaller input", kFailed);
  } catch (const std::exception& error) {
    return printError(who, error.what(), kFailed);
  }
}

int runCommandLine(const std::vector<std::string>& arguments) {
  if (arguments.empty()) return printError("volto", "say what to do: volto VERB; see volto help", kWrongUsage);
  const std::string& first = arguments.front();
  if (first == "--version" || first == "version") {
    std::puts("volto " VOLTO_VERSION);
    return kDone;
  }
  if (first == "help" || first == "--help" || first == "-h") {
    if (arguments.size() == 1) {
      printHelp();
      return kDone;
    }
    const Verb* const verb = findVerb(arguments[1]);
    return verb == nullptr ? unknownVerb(arguments[1]) : runVerb(*verb, {"--help"});
  }
  const Verb* const verb = findVerb(first);
  if (verb == nullptr) return unknownVerb(first);
  return runVerb(*verb, {arguments.begin() + 1, arguments.end()});
}

}  // namespace

std::span<const Verb> verbs() { return kVerbs; }

}  // namespace volto::cli

int main(int argc, char** argv) {
  volto::cli::installStopSignals();
  return volto::cli::runCommandLine(std::vector<std::string>(argv + 1, argv + std::max(argc, 1)));
}
