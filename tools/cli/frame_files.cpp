#include "tools/cli/frame_files.h"

#include <optional>

#include <CLI/CLI.hpp>

#include "rig/file_bytes.h"
#include "rig/mesh_io.h"
#include "rig/shape_translation.h"
#include "tools/cli/bake_picture.h"
#include "tools/cli/exit_status.h"
#include "tools/cli/output_file.h"
#include "tools/cli/shape_set_flag.h"
#include "tools/export/glb_file.h"
#include "tools/export/livelink_csv.h"
#include "tools/export/movement.h"
#include "tools/pipeline/weights_csv.h"

namespace volto::cli {
namespace {

class ObjFile : public FrameFile {
 public:
  ObjFile(std::filesystem::path folder, const rig::Mesh& mesh)
      : folder_(std::move(folder)), mesh_(mesh), positions_(mesh.positions) {
    makeOutputFolder(folder_);
    if (mesh_.materials.empty()) return;
    options_.material_library = "materials.mtl";
    rig::writeMtl(folder_ / options_.material_library, mesh_);
  }

  void frame(std::size_t number, const AvatarFrame& avatar, std::int64_t) override {
    for (std::size_t v = 0; v < avatar.vertices.size(); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        positions_(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) =
            static_cast<double>(avatar.vertices[v][axis]);
      }
    }
    rig::writeObj(folder_ / frameFileName(number, ".obj"), mesh_, positions_, options_);
  }

 private:
  std::filesystem::path folder_;
  const rig::Mesh& mesh_;
  rig::VertexPositions positions_;
  rig::ObjOptions options_;
};

// What the character's shapes mean, when the person says so.
std::optional<rig::ShapeSet> meaningOf(const FrameFileFlags& flags) {
  if (flags.shapes_mean.empty()) return {};
  return readShapeSet(flags.shapes_mean);
}

class CsvFile : public FrameFile {
 public:
  CsvFile(const FrameFileFlags& flags, const rig::Rig& rig) : file_(flags.csv) {
    std::vector<std::string> names = rig::blendshapeNames(rig);
    if (!flags.weights_as.empty()) {
      const std::optional<rig::ShapeSet> meaning = meaningOf(flags);
      translation_.emplace(names, meaning ? &*meaning : nullptr, readShapeSet(flags.weights_as));
      names.clear();
      for (const rig::ShapeSet::Shape& shape : translation_->to().shapes()) names.push_back(shape.name);
      weights_.resize(names.size());
      observed_.resize(names.size());
    }
    pipeline::appendWeightsHeader(text_, names);
    file_.write(text_);
  }

  void frame(std::size_t, const AvatarFrame& avatar, std::int64_t t_ns) override {
    text_.clear();
    if (translation_) {
      translation_->apply(avatar.weights, avatar.observed, weights_, observed_);
      pipeline::appendWeightsRow(text_, t_ns, weights_, observed_, avatar.head);
    } else {
      pipeline::appendWeightsRow(text_, t_ns, avatar.weights, avatar.observed, avatar.head);
    }
    file_.write(text_);
  }

  void finish() override { file_.commit(); }

 private:
  OutputFile file_;
  std::string text_;
  std::optional<rig::ShapeTranslation> translation_;
  std::vector<float> weights_;
  std::vector<std::uint8_t> observed_;
};

class LiveLinkFile : public FrameFile {
 public:
  LiveLinkFile(const std::string& path, const rig::Rig& rig, const rig::ShapeSet* meaning)
      : rows_(rig, meaning), file_(path) {
    file_.write(exporter::liveLinkHeader());
  }

  void frame(std::size_t, const AvatarFrame& avatar, std::int64_t t_ns) override {
    text_.clear();
    rows_.append(text_, t_ns, avatar);
    file_.write(text_);
  }

  void finish() override { file_.commit(); }

 private:
  exporter::LiveLinkRows rows_;
  OutputFile file_;
  std::string text_;
};

class GlbFile : public FrameFile {
 public:
  GlbFile(const std::string& path, const rig::Rig& rig) : path_(path), rig_(rig), recorder_(rig) {
    requireReplaceable(path);
  }
  void frame(std::size_t, const AvatarFrame& avatar, std::int64_t t_ns) override { recorder_.add(avatar, t_ns); }
  void finish() override { rig::writeFileAtomically(path_, exporter::formatGlb(rig_, &recorder_.movement())); }

 private:
  std::string path_;
  const rig::Rig& rig_;
  exporter::MovementRecorder recorder_;
};

class PngFile : public FrameFile {
 public:
  PngFile(const FrameFileFlags& options, const rig::Rig& rig, std::size_t frames)
      : baker_({options.png, options.view, options.sheet, options.animate, options.size_px}, rig, frames) {}
  void frame(std::size_t number, const AvatarFrame& avatar, std::int64_t t_ns) override {
    baker_.frame(number, t_ns, avatar);
  }
  void finish() override { baker_.finish(); }

 private:
  PictureBaker baker_;
};

}  // namespace

void FrameFileFlags::requireConsistent() const {
  if (animate && (png.empty() || sheet))
    throw CommandError(kWrongUsage, "--animate makes one moving picture of --png F; it needs --png and no --sheet");
  if (!weights_as.empty() && csv.empty())
    throw CommandError(kWrongUsage, "--weights-as says in which names --csv F is written; it needs --csv");
  if (!shapes_mean.empty() && weights_as.empty() && livelink.empty())
    throw CommandError(kWrongUsage, "--shapes-mean is for --livelink, and for --csv with --weights-as");
}

std::vector<std::string> FrameFileFlags::files() const {
  std::vector<std::string> out;
  for (const std::string& path : {csv, png, glb, livelink})
    if (!path.empty()) out.push_back(path);
  return out;
}

std::vector<std::unique_ptr<FrameFile>> openFrameFiles(const FrameFileFlags& flags, const rig::Rig& rig,
                                                       std::size_t frames) {
  std::vector<std::unique_ptr<FrameFile>> files;
  if (!flags.obj.empty()) files.push_back(std::make_unique<ObjFile>(flags.obj, rig.neutral));
  if (!flags.csv.empty()) files.push_back(std::make_unique<CsvFile>(flags, rig));
  if (!flags.livelink.empty()) {
    const std::optional<rig::ShapeSet> meaning = meaningOf(flags);
    files.push_back(std::make_unique<LiveLinkFile>(flags.livelink, rig, meaning ? &*meaning : nullptr));
  }
  if (!flags.glb.empty()) files.push_back(std::make_unique<GlbFile>(flags.glb, rig));
  if (!flags.png.empty()) files.push_back(std::make_unique<PngFile>(flags, rig, frames));
  return files;
}

void addFrameFileFlags(CLI::App& app, FrameFileFlags& flags) {
  app.add_option("--obj", flags.obj,
                 "a folder for one OBJ file per frame, frame_000000.obj and so on; head pose not applied")
      ->type_name("DIR");
  app.add_option(
         "--glb", flags.glb,
         "one GLB file: the character with its blendshapes as morph targets, and the performance as its animation")
      ->type_name("F.glb");
  app.add_option("--livelink", flags.livelink,
                 "weights in Live Link Face's CSV format, with the true times as timecode; - is standard output")
      ->type_name("F.csv");
  app.add_option("--csv", flags.csv,
                 "weights of the character's blendshapes and head angles, a row per frame; - is standard output")
      ->type_name("F");
  app.add_option("--weights-as", flags.weights_as,
                 "write --csv in the names of another set: arkit, facs, ict, vrm0, vrm1, or a CSV file of your own")
      ->type_name("SET");
  app.add_option("--shapes-mean", flags.shapes_mean,
                 "what the character's own shapes are in ARKit's terms (default: told by their names): the same sets, "
                 "or a CSV file with shape,arkit,weight")
      ->type_name("SET");
  app.add_option(
         "--png", flags.png,
         "pictures: a folder for one per frame, or with --sheet, or where the name ends in .png, one sheet of moments")
      ->type_name("F|DIR");
  app.add_option("--view", flags.view, "front, three-quarter or side (default front)")
      ->type_name("VIEW")
      ->check(CLI::IsMember({"front", "three-quarter", "side"}));
  app.add_flag("--sheet", flags.sheet, "--png makes one contact sheet of several moments, spread over the performance");
  app.add_flag("--animate", flags.animate, "--png makes one animated PNG (APNG) of all frames written");
  app.add_option("--size", flags.size_px,
                 "width and height of a picture (default 512; tile of a sheet 320, animation 288)")
      ->type_name("PX")
      ->check(CLI::Range(16, 4096));
}

}  // namespace volto::cli
