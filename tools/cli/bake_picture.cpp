#include "tools/cli/bake_picture.h"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/picture/contact_sheet.h"
#include "tools/picture/head_renderer.h"
#include "tools/picture/png.h"
#include "tools/picture/rig_look.h"

namespace volto::cli {

namespace {

constexpr std::size_t kSheetColumns = 4, kSheetRows = 3;
constexpr int kTile_px = 320, kFrame_px = 512, kAnimation_px = 288;
constexpr std::size_t kMostAnimationFrames = 1500;  // they are held in memory, and nobody loads more

picture::ViewOptions viewNamed(const std::string& name, int size_px, const rig::Rig& rig) {
  picture::ViewOptions view = name == "side"            ? picture::sideView(size_px)
                              : name == "three-quarter" ? picture::threeQuarterView(size_px)
                                                        : picture::frontView(size_px);
  const auto row = [&](Eigen::Index i) {
    const Eigen::Vector3f r = rig.mesh_from_head.col(i).cast<float>();  // a row of the transpose
    return picture::Vec3{r.x(), r.y(), r.z()};
  };
  view.head_from_mesh = {row(0), row(1), row(2)};
  return view;
}

}  // namespace

std::string frameFileName(std::size_t number, const char* extension) {
  char name[64];
  std::snprintf(name, sizeof name, "frame_%06zu%s", number, extension);
  return name;
}

struct PictureBaker::State {
  struct Moment {
    std::int64_t t_ns = 0;
    float liveliness = std::numeric_limits<float>::lowest();
    HeadPose head;
    std::vector<std::array<float, 3>> vertices;
  };

  State(PictureOptions o, const rig::Rig& rig, std::size_t frames)
      : options(std::move(o)),
        renderer(rig.neutral, picture::lookOfRig(rig)),
        expected(std::max<std::size_t>(frames, 1)),
        moments(std::min(expected, kSheetColumns * kSheetRows)) {
    options.sheet = !options.animate && (options.sheet || options.path.extension() == ".png");
    const int usual_px = options.sheet ? kTile_px : options.animate ? kAnimation_px : kFrame_px;
    view = viewNamed(options.view, options.size_px > 0 ? options.size_px : usual_px, rig);
    for (const rig::Blendshape& shape : rig.blendshapes) {
      const auto index = arkitBlendshapeIndex(shape.name);
      const std::string_view name = index ? kArkitBlendshapeNames[*index] : std::string_view(shape.name);
      value.push_back(name.starts_with("eyeBlink") ? -4.0F : name.starts_with("eye") ? 0.0F : 1.0F);
    }
  }

  // What makes one moment worth showing rather than another: much going on in the face, and open eyes.
  float liveliness(const AvatarFrame& avatar) const {
    float sum = 0;
    for (std::size_t i = 0; i < value.size(); ++i) sum += value[i] * avatar.weights[i] * avatar.weights[i];
    return sum;
  }

  picture::Picture render(const HeadPose& head, std::span<const std::array<float, 3>> vertices) {
    view.head_rotation = head.observed ? head.rotation : HeadPose{}.rotation;
    return renderer.render(vertices, view).picture;
  }

  PictureOptions options;
  picture::HeadRenderer renderer;
  picture::ViewOptions view;
  std::vector<float> value;  // of each blendshape, for liveliness
  std::size_t expected;
  std::size_t seen = 0;
  std::vector<Moment> moments;  // of a sheet: the liveliest frame of each stretch of the performance
  std::vector<picture::Picture> animation;
  std::int64_t animation_start_ns = 0, animation_end_ns = 0;
};

PictureBaker::PictureBaker(const PictureOptions& options, const rig::Rig& rig, std::size_t frames)
    : state_(std::make_unique<State>(options, rig, frames)) {
  if (options.animate && frames > kMostAnimationFrames) {
    throw CommandError(kWrongUsage, "an animation of " + std::to_string(frames) + " frames is too long, " +
                                        std::to_string(kMostAnimationFrames) +
                                        " is the most; use --every, --from and --to");
  }
  if (state_->options.sheet || options.animate) {
    requireReplaceable(options.path);
  } else {
    makeOutputFolder(options.path);
  }
}

PictureBaker::~PictureBaker() = default;

void PictureBaker::frame(std::size_t number, std::int64_t t_ns, const AvatarFrame& avatar) {
  State& s = *state_;
  if (s.options.animate) {
    if (s.animation.empty()) s.animation_start_ns = t_ns;
    s.animation_end_ns = t_ns;
    s.animation.push_back(s.render(avatar.head, avatar.vertices));
    return;
  }
  if (!s.options.sheet) {
    picture::writePng(s.options.path / frameFileName(number, ".png"), s.render(avatar.head, avatar.vertices));
    return;
  }
  State::Moment& moment = s.moments[std::min(s.moments.size() - 1, s.seen * s.moments.size() / s.expected)];
  ++s.seen;
  const float lively = s.liveliness(avatar);
  if (lively <= moment.liveliness) return;
  moment = {t_ns, lively, avatar.head, avatar.vertices};
}

void PictureBaker::finish() {
  State& s = *state_;
  if (s.options.animate) {
    const double seconds = static_cast<double>(s.animation_end_ns - s.animation_start_ns) * 1e-9;
    const double fps = seconds > 0 ? static_cast<double>(s.animation.size() - 1) / seconds : 1.0;
    picture::writeApng(s.options.path, s.animation, std::clamp(fps, 0.1, 1000.0));
    return;
  }
  if (!s.options.sheet) return;
  std::vector<picture::Cell> cells;
  for (const State::Moment& moment : s.moments) {
    if (moment.vertices.empty()) continue;
    char caption[32];
    std::snprintf(caption, sizeof caption, "%.2f s", static_cast<double>(moment.t_ns) * 1e-9);
    cells.push_back({s.render(moment.head, moment.vertices), caption});
  }
  const picture::Picture sheet = picture::contactSheet(cells, std::min(kSheetColumns, cells.size()));
  picture::writePng(s.options.path, sheet);
}

}  // namespace volto::cli
