// Videos, animated GIFs, photos and image sequences as an ImageSource: whatever FFmpeg's libraries open.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>

#include "capture/image_source.h"

namespace volto::capture {

struct VideoOptions {
  // false: every picture, as fast as it is asked for. true: each when it is due, and of several that are due the
  // newest.
  bool realtime = false;
  // In real time: a picture that is at most so late is given all the same, so that a short stall loses none.
  std::chrono::nanoseconds patience{0};
  bool loop = false;             // from the start again; times go on rising
  double sequence_rate_hz = 25;  // of an image sequence, which does not say
};

// `path`: a file; a pattern of an image sequence ("frames/%04d.png"); a folder of images of one kind, in the order of
// their names. Times are the file's own, from 0. Pictures are turned as the file says (telephones). No thread.
// A picture that cannot be decoded is passed over and counted; a file that ends too early says so in notice(). A
// picture may have another size than the one before.
// Throws InputError (no video, no picture in it), std::system_error when the file cannot be opened.
std::unique_ptr<ImageSource> openVideo(const std::filesystem::path& path, const VideoOptions& options = {});

}  // namespace volto::capture
