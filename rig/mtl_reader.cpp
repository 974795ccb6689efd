#include "rig/mtl_reader.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>
#include <unordered_map>

#include "rig/errors.h"
#include "rig/file_bytes.h"
#include "rig/mesh_builder.h"
#include "rig/text_scanner.h"

namespace volto::rig {
namespace {

constexpr std::size_t kMaxLibraryBytes = std::size_t{4} << 20;

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

// Kd r [g b]; nothing for "Kd spectral file" and for what is no number.
std::optional<std::array<float, 3>> colour(std::string_view text) {
  std::array<float, 3> out{};
  std::size_t count = 0;
  for (text = trimmed(text); !text.empty() && count < 3; text = trimmed(text)) {
    float value = 0;
    const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || !std::isfinite(value)) return {};
    out[count++] = std::clamp(value, 0.0F, 1.0F);
    text.remove_prefix(static_cast<std::size_t>(stop - text.data()));
    if (!text.empty() && text.front() != ' ' && text.front() != '\t') return {};
  }
  if (count == 1) out[1] = out[2] = out[0];  // one number stands for all three
  return count == 1 || count == 3 ? std::optional(out) : std::nullopt;
}

bool isPlainFileName(const std::string& name) {
  if (name.empty() || name.size() > 255 || name == "." || name == "..") return false;
  for (const char c : name)
    if (c == '/' || c == '\\' || c == ':' || static_cast<unsigned char>(c) < 0x20) return false;
  return true;
}

}  // namespace

void applyMaterialLibrary(std::string_view text, Mesh& mesh) {
  std::unordered_map<std::string_view, Mesh::Material*> by_name;
  for (Mesh::Material& material : mesh.materials) by_name.emplace(material.name, &material);
  Mesh::Material* current = nullptr;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    const std::string_view line = trimmed(text.substr(0, end));
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
    if (line.starts_with("newmtl ") || line.starts_with("newmtl\t")) {
      const auto found = by_name.find(trimmed(line.substr(7)).substr(0, 256));
      current = found == by_name.end() ? nullptr : found->second;
    } else if (current != nullptr && (line.starts_with("Kd ") || line.starts_with("Kd\t"))) {
      if (const auto kd = colour(line.substr(3))) current->colour = *kd;
    }
  }
}

void readMaterialLibraries(const std::filesystem::path& folder, std::span<const std::string> names, Mesh& mesh) {
  Notes notes;
  const auto read = [&](const std::string& name, bool may_be_several) {
    const std::string shown = "material library '" + printable(name) + "' ";
    if (!isPlainFileName(name)) {
      notes.add(shown + "was not opened: only a file beside the mesh is; colours are by material name");
      return true;
    }
    try {
      applyMaterialLibrary(readFileBytes(folder / name, kMaxLibraryBytes, LinksFollowed::no), mesh);
    } catch (const std::system_error& error) {
      if (may_be_several && error.code().value() == ENOENT) return false;
      notes.add(shown + "was not read (" + error.code().message() + "); colours are by material name");
    } catch (const InputError&) {
      notes.add(shown + "was not read: no regular file of at most 4 MiB; colours are by material name");
    }
    return true;
  };
  for (const std::string& name : names) {
    // A blank may be part of the name, as most programs write it, or stand between two names, as the format has it.
    if (read(name, name.find(' ') != name.npos)) continue;
    for (std::string_view rest = trimmed(name); !rest.empty();) {
      const std::size_t end = std::min(rest.find(' '), rest.size());
      read(std::string(rest.substr(0, end)), false);
      rest = trimmed(rest.substr(end));
    }
  }
  for (std::string& note : notes.take()) mesh.notes.push_back(std::move(note));
}

std::string formatMtl(const Mesh& mesh) {
  std::string out;
  for (const Mesh::Material& material : mesh.materials) {
    out += "newmtl " + material.name + "\nKd";
    for (const float part : material.colour) {
      std::array<char, 32> digits;
      out += ' ';
      out.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), part).ptr);
    }
    out += '\n';
  }
  return out;
}

}  // namespace volto::rig
