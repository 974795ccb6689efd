// The files that frames of a character may go to: what `volto bake` and `volto animate` write. Each appears whole or
// not at all, but for a folder, which fills as frames come.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "frames/avatar_frame.h"
#include "rig/rig.h"

namespace CLI {
class App;
}

namespace volto::cli {

// One file format being written; frames arrive in order, finish() puts in place what must be whole.
class FrameFile {
 public:
  virtual ~FrameFile() = default;
  virtual void frame(std::size_t number, const AvatarFrame& avatar, std::int64_t t_ns) = 0;
  virtual void finish() {}
};

struct FrameFileFlags {
  std::string obj, csv, glb, livelink, png;
  std::string view = "front";
  bool sheet = false;
  bool animate = false;
  int size_px = 0;
  std::string weights_as, shapes_mean;  // sets of blendshapes (tools/cli/shape_set_flag.h)

  bool any() const { return !(obj.empty() && csv.empty() && glb.empty() && livelink.empty() && png.empty()); }
  bool wantMesh() const { return !obj.empty() || !png.empty() || !glb.empty(); }
  // Throws CommandError (kWrongUsage): flags that do not go together.
  void requireConsistent() const;
  // Paths of single files, those that were given.
  std::vector<std::string> files() const;
};

void addFrameFileFlags(CLI::App& app, FrameFileFlags& flags);

// `frames`: how many will come. Borrows `rig`. Throws CommandError.
std::vector<std::unique_ptr<FrameFile>> openFrameFiles(const FrameFileFlags& flags, const rig::Rig& rig,
                                                       std::size_t frames);

}  // namespace volto::cli
