#include "capture/detection/face_finder.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <vector>

#include "capture/detection/crop.h"
#include "capture/detection/pupils.h"

namespace volto::capture {
namespace {

constexpr double kSurroundings = 2.2;    // the square that a check looks at, in eye-to-mouth distances to each side
constexpr double kSearchNearby = 3.5;    // ... and that a doubtful face is searched in
constexpr double kAgreement = 0.45;      // detector and landmarks agree when their anchors lie this close, same unit
constexpr double kLargestJump = 0.8;     // a face that moved further than this from one frame to the next is doubtful
constexpr double kLargestGrowth = 1.35;  // ... or that grew or shrank by more
constexpr double kSameFace = 3.0;        // a face that comes back is the same one within this distance
constexpr float kLeastModelConfidence = 0.25F;
constexpr double kTired_s = 2.0;  // a search that finds nothing for so long is repeated less often
// The crop follows the landmarks: gently when they hardly move, so that their noise does not come back as another
// crop, at once when they move by this much.
constexpr double kCropStep = 0.06;  // of the crop's side; size and angle alike
constexpr double kCropGain = 0.15;

double distance(const std::array<float, 2>& a, const std::array<float, 2>& b) {
  return std::hypot(static_cast<double>(a[0] - b[0]), static_cast<double>(a[1] - b[1]));
}

struct Place {
  std::array<float, 2> middle{};
  double size = 0;  // about from eyes to mouth of a face that looks straight ahead, pixels
};

Place placeOf(const FaceAnchors& p) {
  Place place;
  for (const auto& anchor : p)
    for (std::size_t c = 0; c < 2; ++c) place.middle[c] += anchor[c] / static_cast<float>(kFaceAnchorCount);
  const double eyes = distance(p[0], p[1]), right = distance(p[0], p[3]), left = distance(p[1], p[4]);
  place.size = std::max({eyes, right, left, 1.0});
  return place;
}

double disagreement(const FaceAnchors& a, const FaceAnchors& b) {
  double sum = 0;
  for (std::size_t i = 0; i < kFaceAnchorCount; ++i) sum += distance(a[i], b[i]);
  return sum / static_cast<double>(kFaceAnchorCount);
}

class Stopwatch {
 public:
  explicit Stopwatch(std::int64_t& sum_ns) : sum_ns_(sum_ns), start_(std::chrono::steady_clock::now()) {}
  ~Stopwatch() {
    sum_ns_ += std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now() - start_).count();
  }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  std::int64_t& sum_ns_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace

struct FaceFinder::State {
  State(FaceDetector d, LandmarkModel m, const FaceFinderOptions& o)
      : detector(std::move(d)), model(std::move(m)), options(o) {}

  FaceDetector detector;
  LandmarkModel model;
  FaceFinderOptions options;
  PupilFinder pupils;
  FaceFinderCounters counters;
  std::vector<DetectedFace> faces;

  bool following = false;
  ImageFromCrop crop;
  FaceAnchors anchors{};  // of the frame before
  float score = 0;        // the detector's, when it last looked
  int since_check = 0;
  bool ever_found = false;
  std::int64_t last_seen_ns = 0, last_search_ns = 0;
  std::optional<std::int64_t> nothing_since_ns;  // since then there has been no face
  int width = 0, height = 0;

  const DetectedFace* choose(std::int64_t now_ns) {
    std::erase_if(faces, [&](const DetectedFace& face) { return face.score < options.found_score; });
    if (faces.empty()) return nullptr;
    const auto nearest = [&](float x, float y) {
      return &*std::min_element(faces.begin(), faces.end(), [&](const DetectedFace& a, const DetectedFace& b) {
        return distance(placeOf(a.anchors).middle, {x, y}) < distance(placeOf(b.anchors).middle, {x, y});
      });
    };
    if (ever_found && static_cast<double>(now_ns - last_seen_ns) * 1e-9 < options.remember_s) {
      const Place last = placeOf(anchors);
      const DetectedFace* const same = nearest(last.middle[0], last.middle[1]);
      if (distance(placeOf(same->anchors).middle, last.middle) < kSameFace * last.size) return same;
    }
    switch (options.choice.kind) {
      case FaceChoice::Kind::in_front:
        break;
      case FaceChoice::Kind::nearest_to:
        return nearest(options.choice.x * static_cast<float>(width), options.choice.y * static_cast<float>(height));
      case FaceChoice::Kind::number: {
        std::sort(faces.begin(), faces.end(), [](const DetectedFace& a, const DetectedFace& b) {
          return placeOf(a.anchors).middle[0] < placeOf(b.anchors).middle[0];
        });
        const auto index = static_cast<std::size_t>(options.choice.number - 1);
        return index < faces.size() ? &faces[index] : nullptr;
      }
    }
    return &*std::max_element(faces.begin(), faces.end(), [](const DetectedFace& a, const DetectedFace& b) {
      return a.width * a.height < b.width * b.height;
    });
  }

  // Landmarks from a crop; false when they are none.
  bool runModel(const Image& image, const ImageFromCrop& from, LandmarkFrame& out, FaceAnchors& found) {
    const Stopwatch watch(counters.landmarks_ns);
    ++counters.networks;
    const float confidence = model.run(image, from, out);
    if (confidence < kLeastModelConfidence) return false;
    found = anchorsOf(out.layout, out.points_px);
    return true;
  }

  // A detected face: its anchors give a crop, the landmarks in it a better one.
  bool begin(const Image& image, const DetectedFace& face, LandmarkFrame& out) {
    FaceAnchors found = face.anchors;
    for (int pass = 0; pass < 2; ++pass) {
      ImageFromCrop next;
      if (!model.crop(found, next) || !runModel(image, next, out, found)) return false;
      crop = next;
    }
    anchors = found;
    score = face.score;
    since_check = 0;
    return disagreement(face.anchors, found) < 2 * kAgreement * placeOf(face.anchors).size;
  }

  // The face near the followed place that the detector is surest of; null when there is none.
  const DetectedFace* lookNear(const Image& image, const FaceAnchors& where, double reach) {
    const Stopwatch watch(counters.detector_ns);
    ++counters.checks;
    const Place place = placeOf(where);
    const ImageSquare square{place.middle[0] - reach * place.size, place.middle[1] - reach * place.size,
                             2 * reach * place.size};
    detector.detectNear(image, square, options.kept_score, faces);
    const DetectedFace* best = nullptr;
    for (const DetectedFace& face : faces) {
      if (best == nullptr || disagreement(face.anchors, where) < disagreement(best->anchors, where)) best = &face;
    }
    return best;
  }

  bool follow(const Image& image, LandmarkFrame& out) {
    ImageFromCrop next;
    if (!model.crop(anchors, next)) return false;
    easeCrop(next);
    FaceAnchors found;
    const Place before = placeOf(anchors);
    bool doubtful = !runModel(image, crop, out, found);
    if (!doubtful) {
      const Place now = placeOf(found);
      doubtful = distance(before.middle, now.middle) > kLargestJump * before.size ||
                 now.size > kLargestGrowth * before.size || before.size > kLargestGrowth * now.size;
    }
    if (!doubtful && options.check_every > 0 && ++since_check >= options.check_every) {
      since_check = 0;
      const DetectedFace* const face = lookNear(image, found, kSurroundings);
      doubtful = face == nullptr || disagreement(face->anchors, found) > kAgreement * placeOf(found).size;
      if (!doubtful) score = face->score;
    }
    if (!doubtful) {
      anchors = found;
      return true;
    }
    ++counters.doubts;
    const DetectedFace* const face = lookNear(image, anchors, kSearchNearby);
    return face != nullptr && distance(placeOf(face->anchors).middle, before.middle) < kSameFace * before.size &&
           begin(image, *face, out);
  }

  void easeCrop(const ImageFromCrop& next) {
    const auto centre = [&](const ImageFromCrop& c) {
      return c(0.5 * model.manifest().width, 0.5 * model.manifest().height);
    };
    const double side = next.scale() * model.manifest().width;
    const auto gain = [](double change) { return std::clamp(kCropGain + change / kCropStep, 0.0, 1.0); };
    const double turn_gain = gain(std::hypot(next.a - crop.a, next.b - crop.b) / next.scale());
    const auto from = centre(crop), to = centre(next);
    const double move_gain = gain(distance(from, to) / side);
    crop.a += turn_gain * (next.a - crop.a);
    crop.b += turn_gain * (next.b - crop.b);
    const double x = from[0] + move_gain * (to[0] - from[0]), y = from[1] + move_gain * (to[1] - from[1]);
    crop.tx = crop.ty = 0;
    const auto origin = centre(crop);
    crop.tx = x - origin[0];
    crop.ty = y - origin[1];
  }

  bool search(const Image& image, LandmarkFrame& out) {
    const std::int64_t now = image.t_capture_ns;
    if (!nothing_since_ns) nothing_since_ns = now;
    const bool tired = static_cast<double>(now - *nothing_since_ns) * 1e-9 > kTired_s;
    if (tired && static_cast<double>(now - last_search_ns) * 1e-9 < options.search_interval_s) return false;
    last_search_ns = now;
    {
      const Stopwatch watch(counters.detector_ns);
      ++counters.searches;
      detector.detect(image, options.kept_score, faces);
    }
    const DetectedFace* const face = choose(now);
    return face != nullptr && begin(image, DetectedFace(*face), out);
  }
};

FaceFinder::FaceFinder(FaceDetector detector, LandmarkModel model, const FaceFinderOptions& options)
    : state_(std::make_unique<State>(std::move(detector), std::move(model), options)) {}
FaceFinder::~FaceFinder() = default;
FaceFinder::FaceFinder(FaceFinder&&) noexcept = default;

void FaceFinder::push(const Image& image, LandmarkFrame& out) {
  State& s = *state_;
  out.t_capture_ns = image.t_capture_ns;
  out.capture_seq = image.capture_seq;
  out.layout = s.model.manifest().layout;
  out.image_width_px = image.width;
  out.image_height_px = image.height;
  out.points_camera_mm.clear();
  out.pupils = {};
  if (image.width != s.width || image.height != s.height) {
    s.following = false;  // another picture altogether
    s.ever_found = false;
    s.width = image.width;
    s.height = image.height;
  }
  ++s.counters.frames;
  bool found = s.following && s.follow(image, out);
  if (s.following && !found) {
    ++s.counters.losses;
    s.following = false;
  }
  if (!found) found = s.search(image, out);
  s.counters.networks_ns = s.detector.network_ns() + s.model.network_ns();
  s.following = found;
  out.face_present = found;
  if (!found) {
    out.confidence = 0;
    out.points_px.clear();
    out.point_confidence.clear();
    return;
  }
  ++s.counters.faces;
  s.ever_found = true;
  s.nothing_since_ns.reset();
  s.last_seen_ns = image.t_capture_ns;
  out.confidence = std::clamp(s.score, 0.0F, 1.0F);
  if (s.options.pupils) {
    const Stopwatch watch(s.counters.pupils_ns);
    s.pupils.find(image, out);
  }
}

void FaceFinder::restart() {
  state_->following = false;
  state_->ever_found = false;
}

const FaceFinderCounters& FaceFinder::counters() const { return state_->counters; }
LandmarkLayout FaceFinder::layout() const { return state_->model.manifest().layout; }

}  // namespace volto::capture
