#include "tools/cli/describe_cameras.h"

#include <cstdio>

#include <nlohmann/json.hpp>

namespace volto::cli {

namespace {

using Json = nlohmann::ordered_json;
using capture::v4l2::Camera;
using capture::v4l2::Control;
using capture::v4l2::FrameSize;
using capture::v4l2::PixelFormat;

Json describeFormat(const PixelFormat& format) {
  Json out{{"format", format.fourcc}, {"description", format.description}, {"readable", format.readable}};
  out["sizes"] = Json::array();
  for (const FrameSize& size : format.sizes)
    out["sizes"].push_back({{"width", size.width}, {"height", size.height}, {"fps", size.rates_hz}});
  return out;
}

Json describeControl(const Control& control) {
  Json out{{"name", control.name},   {"kind", control.kind},        {"min", control.minimum},
           {"max", control.maximum}, {"step", control.step},        {"default", control.default_value},
           {"value", control.value}, {"writable", control.writable}};
  if (!control.menu.empty()) {
    out["menu"] = Json::object();
    for (const auto& [index, name] : control.menu) out["menu"][std::to_string(index)] = name;
  }
  return out;
}

// 29.97 and 30, not 30.000000.
std::string rateText(double hz) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", hz);
  return text;
}

std::string formatInWords(const PixelFormat& format) {
  std::string line =
      "  " + format.fourcc + (format.fourcc.size() < 4 ? std::string(4 - format.fourcc.size(), ' ') : "");
  if (!format.readable) return line + "  not read by Volto\n";
  if (format.sizes.empty()) line += "  any size";
  const char* separator = "  ";
  for (const FrameSize& size : format.sizes) {
    line += separator + std::to_string(size.width) + "x" + std::to_string(size.height);
    for (std::size_t i = 0; i < size.rates_hz.size(); ++i) line += (i == 0 ? " at " : "/") + rateText(size.rates_hz[i]);
    separator = ", ";
  }
  return line + "\n";
}

std::string controlInWords(const Control& control) {
  std::string line = "  --control " + control.name + "=" + std::to_string(control.value) + "   ";
  if (control.menu.empty())
    return line + std::to_string(control.minimum) + " to " + std::to_string(control.maximum) + "\n";
  const char* separator = "";
  for (const auto& [index, name] : control.menu) {
    line += separator + std::to_string(index) + ": " + name;
    separator = ", ";
  }
  return line + "\n";
}

}  // namespace

Json describeCameras(const std::vector<Camera>& cameras) {
  Json out{{"cameras", Json::array()}};
  for (const Camera& camera : cameras) {
    Json each{{"path", camera.node.path},       {"name", camera.identity.card}, {"by_id", camera.node.by_id},
              {"by_path", camera.node.by_path}, {"bus", camera.identity.bus},   {"driver", camera.identity.driver},
              {"problem", camera.problem},      {"formats", Json::array()},     {"controls", Json::array()}};
    for (const PixelFormat& format : camera.formats) each["formats"].push_back(describeFormat(format));
    for (const Control& control : camera.controls) each["controls"].push_back(describeControl(control));
    out["cameras"].push_back(std::move(each));
  }
  return out;
}

std::string camerasInWords(const std::vector<Camera>& cameras) {
  if (cameras.empty()) return "no cameras: there is no /dev/videoN that captures pictures; plug one in\n";
  std::string text;
  for (const Camera& camera : cameras) {
    if (!text.empty()) text += "\n";
    text += "camera:" + camera.node.path;
    if (!camera.identity.card.empty()) text += "  " + camera.identity.card;
    text += "\n";
    if (!camera.problem.empty()) text += "  cannot be used: " + camera.problem + "\n";
    if (!camera.node.by_id.empty()) text += "  always the same one: camera:" + camera.node.by_id + "\n";
    if (!camera.identity.bus.empty())
      text += "  at " + camera.identity.bus + ", driver " + camera.identity.driver + "\n";
    for (const PixelFormat& format : camera.formats) text += formatInWords(format);
    for (const Control& control : camera.controls) {
      if (control.writable && control.kind != "button" && control.kind != "other") text += controlInWords(control);
    }
  }
  return text;
}

}  // namespace volto::cli
