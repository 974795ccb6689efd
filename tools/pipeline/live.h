// Live: pictures or landmarks in, avatar frames out, one thread per stage:
//
//   capture -> detection -> tracker + retarget + publish -> show
//
// joined by slots (slot.h); the last one reports how it goes and shows what was sent. Datagrams skip the detection.
// Stopping has two passes: all slots are closed, so that no stage waits for another, then the threads are joined and
// everything is destroyed.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/datagrams.h"
#include "capture/detection/face_finder.h"
#include "capture/image_source.h"
#include "protocol/publisher.h"
#include "protocol/take_writer.h"
#include "tools/pipeline/frame_path.h"
#include "tools/pipeline/latency_histogram.h"

namespace volto::pipeline {

// Either images and a finder, or datagrams.
struct LiveInput {
  std::string name;  // what is being captured, for status/
  std::unique_ptr<capture::ImageSource> images;
  std::optional<capture::FaceFinder> finder;
  std::unique_ptr<capture::LandmarkDatagrams> datagrams;
  // Its times are those of the monotonic clock (cameras, datagrams), not of a file.
  bool live = true;
};

// One frame on its way out, for those who look at it (preview, tests). Valid during the call.
struct LiveFrame {
  const capture::Image* image;  // null: datagrams
  const LandmarkFrame& landmarks;
  const MaskFrame& mask;
  const AvatarFrame& avatar;
  std::int64_t t_source_ns;  // in the source's own time: a file's, where the frames bear the time of their showing
};

struct LiveOptions {
  bool every_frame = false;  // stages wait for each other and nothing is dropped
  TrackingOptions tracking;
  std::optional<rig::ShapeTranslation> translation;  // weights in the words of another set; the character's names too
  bool mesh = true;
  // The mesh is deformed only while a subscriber has asked for it. False: always, for those who `look` at it.
  bool mesh_on_demand = false;
  double calibration_s = 1.0;  // how long a re-calibration looks at the face at rest
  // Called from a thread of its own after a frame has been sent. Live, one who looks slowly sees the newest frames
  // only.
  std::function<void(const LiveFrame&)> look;
  bool keep_images = false;  // `look` wants the image
};

struct StageReport {
  std::string name;
  std::uint64_t count = 0;
  double rate_hz = 0;         // since the start
  LatencyHistogram latency;   // time spent in the stage, per frame
  std::uint64_t dropped = 0;  // frames that waited for the stage and were replaced by newer ones
  unsigned waiting = 0;       // frames that wait for it now
};

struct LiveReport {
  // capture, detection, tracker, retarget, learning (the tracker's, when the frame has gone on already), publish; of
  // pictures all of these but capture, learning and the networks, frame by frame; and capture to sent as a whole
  std::vector<StageReport> stages;
  capture::SourceCounters source;
  capture::SourceState source_state = capture::SourceState::no_signal;
  capture::SourceInfo source_info;
  std::string notice;  // of the source: something to mend
  capture::FaceFinderCounters finder;
  capture::DatagramCounters datagrams;
  std::uint64_t frames_sent = 0, faces = 0;  // faces: frames in which one was tracked, not only found
  std::uint64_t calibrations = 0;
  double seconds = 0;
};

class Live {
 public:
  // Borrows `publisher`. `take`, if given, gets the landmarks of every frame; it must outlive this object.
  Live(const rig::Rig& rig, LiveInput input, protocol::Publisher& publisher, const LiveOptions& options,
       protocol::TakeWriter* take = nullptr);
  // As stop().
  ~Live();
  Live(const Live&) = delete;
  Live& operator=(const Live&) = delete;

  void start();
  // Waits at most so long; true when the input has ended and all of it has been sent, or a stage failed.
  bool waitForEnd(std::chrono::milliseconds timeout);
  // Ends at once: frames on their way are thrown away. Rethrows what made a stage fail.
  void stop();

  // The face as it is from now on is at rest: look at it for a moment and take it as neutral.
  void recalibrate();
  // The actor's neutral as known so far; nothing before a face has been seen.
  std::optional<tracker::NeutralFace> neutral() const;
  LiveReport report() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace volto::pipeline
