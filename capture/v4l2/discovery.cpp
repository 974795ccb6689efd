#include "capture/v4l2/discovery.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <linux/videodev2.h>

#include "capture/image_source.h"

namespace volto::capture::v4l2 {

namespace {

template <std::size_t N>
std::string textOf(const std::uint8_t (&bytes)[N]) {
  const auto* const begin = reinterpret_cast<const char*>(bytes);
  std::string text(begin, strnlen(begin, N));
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = '?';
  }
  return text;
}

std::string lower(std::string text) {
  for (char& c : text) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return text;
}

bool contains(const std::string& text, const std::string& part) {
  return !part.empty() && lower(text).find(lower(part)) != std::string::npos;
}

// "video0 (Integrated Camera), video2 (C920)".
std::string listNames(const std::vector<FoundCamera>& cameras) {
  std::string names;
  for (const FoundCamera& camera : cameras) {
    names += (names.empty() ? "" : ", ") + camera.node.path + " (" + camera.identity.card + ")";
  }
  return names;
}

// Opens a node and asks what it is. Nothing for a node that is no camera; a DeviceError becomes `problem`.
std::optional<FoundCamera> lookAt(System& system, const VideoNode& node, std::string& problem) {
  try {
    FoundCamera camera{node, {}, Handle(system, node.path)};
    const Capabilities capabilities = queryCapabilities(camera.handle, node.path);
    if (!capabilities.captures) return std::nullopt;
    camera.identity = capabilities.identity;
    camera.identity.by_id = node.by_id;
    return camera;
  } catch (const DeviceError& error) {
    problem = error.what();
    return std::nullopt;
  }
}

// Every camera that can be opened; `problem` is that of the last one that cannot.
std::vector<FoundCamera> openAll(System& system, std::string& problem) {
  std::vector<FoundCamera> cameras;
  for (const VideoNode& node : system.listNodes()) {
    if (std::optional<FoundCamera> camera = lookAt(system, node, problem)) cameras.push_back(std::move(*camera));
  }
  return cameras;
}

FoundCamera openPath(System& system, const std::string& path) {
  VideoNode node{path, {}, {}};
  for (const VideoNode& each : system.listNodes()) {
    if (path == each.path || (!each.by_id.empty() && path == "/dev/v4l/by-id/" + each.by_id) ||
        (!each.by_path.empty() && path == "/dev/v4l/by-path/" + each.by_path))
      node = each;
  }
  FoundCamera camera{node, {}, Handle(system, node.path)};
  const Capabilities capabilities = queryCapabilities(camera.handle, path);
  if (!capabilities.captures)
    throw DeviceError(path + " (" + capabilities.identity.card + ") is no camera: " + capabilities.why_not +
                      "; see volto cameras");
  camera.identity = capabilities.identity;
  camera.identity.by_id = node.by_id;
  return camera;
}

}  // namespace

std::string fourccName(std::uint32_t code) {
  std::string name;
  for (int i = 0; i < 4; ++i) {
    const char c = static_cast<char>((code >> (8 * i)) & 0x7F);
    name += c > 0x20 && c < 0x7F ? c : '.';
  }
  while (name.size() > 1 && name.back() == '.') name.pop_back();
  return name;
}

Capabilities queryCapabilities(const Handle& handle, const std::string& path) {
  v4l2_capability answer{};
  if (const int error = handle.ioctl(VIDIOC_QUERYCAP, &answer); error != 0) {
    if (error == -ENODEV) throw DeviceError(path + ": the device behind it is gone; plug it in again");
    throw DeviceError(path + " is not a Video4Linux device; see volto cameras");
  }
  Capabilities out;
  out.identity.card = textOf(answer.card);
  out.identity.driver = textOf(answer.driver);
  out.identity.bus = textOf(answer.bus_info);
  // device_caps is this node's own; capabilities is that of the whole device, with its metadata node.
  const std::uint32_t caps =
      (answer.capabilities & V4L2_CAP_DEVICE_CAPS) != 0 ? answer.device_caps : answer.capabilities;
  if ((caps & (V4L2_CAP_VIDEO_M2M | V4L2_CAP_VIDEO_M2M_MPLANE)) != 0)
    out.why_not = "it is a converter";
  else if ((caps & V4L2_CAP_VIDEO_CAPTURE) == 0)
    out.why_not = (caps & V4L2_CAP_VIDEO_CAPTURE_MPLANE) != 0
                      ? "it has only the multi-planar interface, which Volto does not speak"
                  : (caps & V4L2_CAP_META_CAPTURE) != 0 ? "it is a metadata node"
                                                        : "it does not capture video";
  else if ((caps & V4L2_CAP_STREAMING) == 0)
    out.why_not = "it cannot stream";
  out.captures = out.why_not.empty();
  return out;
}

std::vector<Camera> listCameras(System& system) {
  std::vector<Camera> cameras;
  for (const VideoNode& node : system.listNodes()) {
    Camera camera;
    camera.node = node;
    const std::optional<FoundCamera> found = lookAt(system, node, camera.problem);
    if (!found && camera.problem.empty()) continue;  // no camera at all
    if (found) {
      camera.identity = found->identity;
      camera.formats = enumerateFormats(found->handle);
      camera.controls = enumerateControls(found->handle);
      if (std::none_of(camera.formats.begin(), camera.formats.end(), [](const PixelFormat& f) { return f.readable; }))
        camera.problem = "it has no format that Volto reads (MJPG, YUYV, NV12, GREY)";
    }
    cameras.push_back(std::move(camera));
  }
  return cameras;
}

FoundCamera findCamera(System& system, const std::string& wanted) {
  if (wanted.starts_with('/')) return openPath(system, wanted);
  std::string problem;
  std::vector<FoundCamera> cameras = openAll(system, problem);
  if (cameras.empty()) {
    throw DeviceError(problem.empty() ? "there is no camera; plug one in, and see volto cameras" : problem);
  }
  if (wanted.empty()) return std::move(cameras.front());

  // A whole name before a part of one.
  std::vector<FoundCamera> fits;
  for (FoundCamera& camera : cameras) {
    if (wanted == camera.node.by_id || wanted == camera.node.by_path || "/dev/" + wanted == camera.node.path)
      return std::move(camera);
    if (contains(camera.identity.card, wanted) || contains(camera.node.by_id, wanted))
      fits.push_back(std::move(camera));
  }
  if (fits.size() == 1) return std::move(fits.front());
  if (fits.size() > 1)
    throw DeviceError("several cameras are called '" + wanted + "': " + listNames(fits) +
                      "; name one by its path or its by-id name, see volto cameras");
  throw DeviceError("no camera is called '" + wanted + "'; there is " + listNames(cameras) + "; see volto cameras" +
                    (problem.empty() ? "" : " (and " + problem + ")"));
}

std::optional<FoundCamera> findAgain(System& system, const Identity& identity) {
  std::string problem;
  std::vector<FoundCamera> same_card;
  const std::vector<VideoNode> nodes = system.listNodes();
  if (!identity.by_id.empty()) {
    for (const VideoNode& node : nodes) {
      if (node.by_id != identity.by_id) continue;
      std::optional<FoundCamera> camera = lookAt(system, node, problem);
      if (camera) return camera;
      if (!problem.empty()) throw DeviceError(problem);
    }
  }
  for (const VideoNode& node : nodes) {
    std::optional<FoundCamera> camera = lookAt(system, node, problem);
    if (!camera || camera->identity.card != identity.card || camera->identity.driver != identity.driver) continue;
    // Another serial number: another camera of the same make.
    if (!identity.by_id.empty() && !node.by_id.empty() && node.by_id != identity.by_id) continue;
    if (camera->identity.bus == identity.bus) return camera;
    same_card.push_back(std::move(*camera));
  }
  if (same_card.size() == 1) return std::move(same_card.front());
  if (!problem.empty()) throw DeviceError(problem);
  return std::nullopt;
}

}  // namespace volto::capture::v4l2
