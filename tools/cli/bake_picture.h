// Pictures of a baked performance: one per frame, one sheet of several moments, or one that moves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "frames/avatar_frame.h"
#include "rig/rig.h"

namespace volto::cli {

// "frame_000012.obj"
std::string frameFileName(std::size_t number, const char* extension);

struct PictureOptions {
  std::filesystem::path path;  // a folder, or the sheet's file
  std::string view = "front";  // front, three-quarter, side
  bool sheet = false;          // also when the path ends in .png
  bool animate = false;        // one animated PNG of all frames
  int size_px = 0;             // width and height of a picture, or of a tile of the sheet; 0: what suits it
};

class PictureBaker {
 public:
  // `frames`: how many will come, so that the moments of a sheet are spread over them: the liveliest of each twelfth.
  // Borrows `rig`. Throws CommandError.
  PictureBaker(const PictureOptions& options, const rig::Rig& rig, std::size_t frames);
  ~PictureBaker();

  // `number` names the file; frames come in order.
  void frame(std::size_t number, std::int64_t t_ns, const AvatarFrame& avatar);
  // Writes the sheet or the animation.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::cli
