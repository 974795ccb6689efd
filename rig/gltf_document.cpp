#include "rig/gltf_document.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <optional>

#include <nlohmann/json.hpp>

#include "rig/errors.h"
#include "rig/file_bytes.h"
#include "rig/mesh_limits.h"
#include "rig/text_scanner.h"

namespace volto::rig {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxJsonBytes = std::size_t{64} << 20;
constexpr int kMaxJsonDepth = 64;
constexpr std::size_t kMaxBuffers = 1024;
constexpr std::size_t kMaxTargets = 4096;
static_assert(std::endian::native == std::endian::little);

std::uint32_t word(std::string_view bytes, std::size_t at) {
  std::uint32_t value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

class Opener {
 public:
  Opener(std::string_view bytes, const std::string& name, const std::filesystem::path& folder)
      : bytes_(bytes), name_(name), folder_(folder) {}

  GltfDocument open() {
    splitContainer();
    parseJson();
    checkVersion();
    buffers();
    materials();
    model();
    return std::move(document_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + what); }
  [[noreturn]] void failAt(std::size_t byte, const std::string& what) const {
    fail("@" + std::to_string(byte) + ": " + what);
  }

  void splitContainer() {
    if (!bytes_.starts_with("glTF")) {
      json_text_ = bytes_;
      if (json_text_.starts_with("\xEF\xBB\xBF")) json_text_.remove_prefix(3), json_at_ = 3;
      const std::size_t first = json_text_.find_first_not_of(" \t\r\n");
      if (first == json_text_.npos || json_text_[first] != '{')
        fail("neither GLB nor glTF JSON; is it the right file?");
      return;
    }
    if (bytes_.size() < 20) fail("a GLB file of " + std::to_string(bytes_.size()) + " bytes; it is cut");
    if (word(bytes_, 4) != 2) failAt(4, "GLB version " + std::to_string(word(bytes_, 4)) + "; version 2 is read");
    const std::size_t length = word(bytes_, 8);
    if (length > bytes_.size())
      failAt(8, "the GLB file says it has " + std::to_string(length) + " bytes, it has " +
                    std::to_string(bytes_.size()) + "; it is cut");
    std::size_t at = 12;
    for (int chunk = 0; at + 8 <= length; ++chunk) {
      const std::size_t size = word(bytes_, at), kind = word(bytes_, at + 4);
      if (size > length - at - 8)
        failAt(at, "a GLB chunk of " + std::to_string(size) + " bytes reaches beyond the file");
      const std::string_view content = bytes_.substr(at + 8, size);
      if (chunk == 0) {
        if (kind != 0x4E4F534AU) failAt(at + 4, "the first GLB chunk is not JSON");
        json_text_ = content;
        json_at_ = at + 8;
      } else if (kind == 0x004E4942U && !glb_chunk_) {
        glb_chunk_ = content;
      }
      at += 8 + size;
    }
    if (json_text_.empty()) fail("the GLB file holds no JSON");
  }

  void parseJson() {
    if (json_text_.size() > kMaxJsonBytes) fail("more than 64 MiB of JSON; is its data inside it? write it as GLB");
    // The parser itself copes with any depth; what walks the result afterwards does not.
    int depth = 0;
    bool in_string = false;
    for (std::size_t i = 0; i < json_text_.size(); ++i) {
      const char c = json_text_[i];
      if (in_string) {
        if (c == '\\') ++i;
        if (c == '"') in_string = false;
      } else if (c == '"') {
        in_string = true;
      } else if (c == '{' || c == '[') {
        if (++depth > kMaxJsonDepth) failAt(json_at_ + i, "JSON nested deeper than 64 levels");
      } else if (c == '}' || c == ']') {
        --depth;
      }
    }
    try {
      json_ = Json::parse(json_text_);
    } catch (const Json::parse_error& error) {
      failAt(json_at_ + error.byte, "the JSON is damaged here");
    } catch (const Json::exception&) {
      fail("the JSON holds a number that is too large");
    }
    if (!json_.is_object()) fail("the JSON is no object; is it a glTF file?");
    for (const auto& [key, value] : json_.items()) {
      if (!value.is_array()) continue;
      for (const Json& entry : value)
        if (!entry.is_object() && key != "extensionsUsed" && key != "extensionsRequired")
          fail(inQuotes(key) + " holds something that is no object");
    }
  }

  const Json* member(const Json& object, const char* key) const {
    const auto found = object.find(key);
    return found == object.end() ? nullptr : &*found;
  }

  void checkVersion() {
    const Json* asset = member(json_, "asset");
    const Json* version = asset != nullptr && asset->is_object() ? member(*asset, "version") : nullptr;
    if (version == nullptr || !version->is_string()) fail("no asset.version; is it a glTF file?");
    const std::string number = version->get<std::string>();
    if (!number.starts_with("2.")) fail("glTF version '" + printable(number) + "'; version 2 is read");
    const Json* required = member(json_, "extensionsRequired");
    if (required == nullptr || !required->is_array()) return;
    for (const Json& entry : *required) {
      const std::string extension = entry.is_string() ? entry.get<std::string>() : "?";
      const auto begins = [&](const char* prefix) { return extension.starts_with(prefix); };
      // What changes only the looks, or is read.
      if (begins("KHR_materials_") || begins("KHR_texture_") || begins("EXT_texture_") || begins("KHR_lights_") ||
          begins("VRM") || begins("KHR_mesh_quantization"))
        continue;
      fail("needs the extension " + printable(extension) +
           ", which is not read; export the mesh without it (no compression)");
    }
  }

  void buffers() {
    const Json* list = member(json_, "buffers");
    if (list == nullptr) return;
    if (!list->is_array() || list->size() > kMaxBuffers) fail("'buffers' is no list of at most 1024 buffers");
    document_.owned.reserve(list->size());  // views into it must stay
    std::size_t total = 0;
    for (std::size_t i = 0; i < list->size(); ++i) {
      const Json& buffer = (*list)[i];
      const std::string which = "buffer " + std::to_string(i);
      const Json* length = member(buffer, "byteLength");
      if (length == nullptr || !length->is_number_unsigned()) fail(which + " has no byteLength");
      const auto wanted = length->get<std::uint64_t>();
      const Json* uri = member(buffer, "uri");
      std::string_view content;
      if (uri == nullptr) {
        if (i != 0 || !glb_chunk_) fail(which + " has no uri, and no GLB chunk stands for it");
        content = *glb_chunk_;
      } else if (!uri->is_string()) {
        fail(which + " has a uri that is no text");
      } else {
        document_.owned.push_back(bufferFrom(uri->get_ref<const std::string&>(), which, wanted));
        content = document_.owned.back();
        total += content.size();
        if (total > kMaxMeshFileBytes) fail("buffers of more than 256 MiB together");
      }
      if (wanted > content.size())
        fail(which + " needs " + std::to_string(wanted) + " bytes, there are " + std::to_string(content.size()) +
             "; it is cut");
      document_.buffers.push_back(content.substr(0, static_cast<std::size_t>(wanted)));
    }
  }

  std::string bufferFrom(const std::string& uri, const std::string& which, std::uint64_t wanted) {
    if (uri.starts_with("data:")) {
      const std::size_t comma = uri.find(";base64,");
      if (comma == uri.npos || comma > 256) fail(which + " is a data URI without base64");
      auto decoded = base64(std::string_view(uri).substr(comma + 8));
      if (!decoded) fail(which + " is a data URI with damaged base64");
      return std::move(*decoded);
    }
    const std::string path = withoutPercent(uri);
    const std::string shown = which + " ('" + printable(path) + "') ";
    if (folder_.empty()) fail(shown + "lies in another file, which is not opened here");
    const std::filesystem::path relative(path);
    bool inside = !path.empty() && path.find('\0') == path.npos && path.find('\\') == path.npos &&
                  path.find(':') == path.npos && relative.is_relative();
    for (const auto& part : relative) inside = inside && part != ".." && part != ".";
    if (!inside) fail(shown + "lies outside the file's folder; it is not opened. Pack everything into one GLB file");
    // No part of the way may be a link that leads elsewhere.
    std::filesystem::path way = folder_;
    for (const auto& part : relative) {
      way /= part;
      std::error_code ignored;
      if (std::filesystem::is_symlink(way, ignored)) fail(shown + "is a symbolic link; it is not followed");
    }
    try {
      std::string content = readFileBytes(folder_ / relative, kMaxMeshFileBytes, LinksFollowed::no);
      if (content.size() < wanted)
        fail(shown + "needs " + std::to_string(wanted) + " bytes, there are " + std::to_string(content.size()) +
             "; it is cut");
      return content;
    } catch (const std::system_error& error) {
      fail(shown + "cannot be read: " + error.code().message() + "; it belongs beside the glTF file");
    }
  }

  static std::string withoutPercent(const std::string& uri) {
    const auto digit = [](char c) {
      return c >= '0' && c <= '9'   ? c - '0'
             : c >= 'a' && c <= 'f' ? c - 'a' + 10
             : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                    : -1;
    };
    std::string out;
    for (std::size_t i = 0; i < uri.size(); ++i) {
      if (uri[i] == '%' && i + 2 < uri.size() && digit(uri[i + 1]) >= 0 && digit(uri[i + 2]) >= 0) {
        out += static_cast<char>(digit(uri[i + 1]) * 16 + digit(uri[i + 2]));
        i += 2;
      } else {
        out += uri[i];
      }
    }
    return out;
  }

  static std::optional<std::string> base64(std::string_view text) {
    while (text.ends_with('=')) text.remove_suffix(1);
    if (text.size() % 4 == 1) return {};
    std::string out;
    out.reserve(text.size() / 4 * 3 + 2);
    std::uint32_t bits = 0;
    int held = 0;
    for (const char c : text) {
      const int value = c >= 'A' && c <= 'Z'   ? c - 'A'
                        : c >= 'a' && c <= 'z' ? c - 'a' + 26
                        : c >= '0' && c <= '9' ? c - '0' + 52
                        : c == '+'             ? 62
                        : c == '/'             ? 63
                                               : -1;
      if (value < 0) return {};
      bits = (bits << 6) | static_cast<std::uint32_t>(value);
      held += 6;
      if (held >= 8) {
        held -= 8;
        out += static_cast<char>((bits >> held) & 0xFF);
      }
    }
    return out;
  }

  void materials() {
    const Json* list = member(json_, "materials");
    if (list == nullptr || !list->is_array()) return;
    if (list->size() > kMaxMaterials) fail("more than 65536 materials");
    for (const Json& material : *list) {
      const Json* metal = member(material, "pbrMetallicRoughness");
      document_.textured.push_back(metal != nullptr && metal->is_object() && metal->contains("baseColorTexture"));
    }
  }

  // Only what is read goes on to tinygltf: images, animations, extras and extensions can do no harm then.
  void model() {
    Json kept = {{"asset", {{"version", "2.0"}}}};
    if (const Json* scene = member(json_, "scene"); scene != nullptr && scene->is_number_unsigned())
      kept["scene"] = *scene;
    const auto keep = [&](const char* name, std::initializer_list<const char*> keys) {
      const Json* from = member(json_, name);
      if (from == nullptr || !from->is_array()) return;
      Json& to = kept[name] = Json::array();
      for (const Json& entry : *from) {
        Json out = Json::object();
        for (const char* key : keys)
          if (const Json* value = member(entry, key)) out[key] = *value;
        to.push_back(std::move(out));
      }
    };
    keep("scenes", {"nodes"});
    keep("nodes", {"children", "mesh", "skin", "matrix", "translation", "rotation", "scale", "name"});
    keep("meshes", {"primitives", "name", "extras"});
    keep("skins", {"joints", "inverseBindMatrices"});
    keep("accessors", {"bufferView", "byteOffset", "componentType", "normalized", "count", "type", "sparse"});
    keep("bufferViews", {"buffer", "byteOffset", "byteLength", "byteStride"});
    keep("materials", {"name", "pbrMetallicRoughness"});
    Json none = Json::array();
    const auto list = [&](const char* key) -> Json& { return kept.contains(key) ? kept[key] : none; };
    for (Json& material : list("materials")) {
      Json* metal = material.contains("pbrMetallicRoughness") ? &material["pbrMetallicRoughness"] : nullptr;
      if (metal == nullptr) continue;
      Json colour = metal->is_object() && metal->contains("baseColorFactor") ? (*metal)["baseColorFactor"] : Json();
      *metal = Json::object();
      if (colour.is_array()) (*metal)["baseColorFactor"] = std::move(colour);
    }
    for (Json& mesh : list("meshes")) {
      if (!mesh.contains("primitives") || !mesh["primitives"].is_array()) fail("a mesh without primitives");
      for (Json& primitive : mesh["primitives"]) {
        if (!primitive.is_object()) fail("a primitive that is no object");
        for (const char* key : {"extensions", "extras"}) primitive.erase(key);
        keepTargetPositions(primitive);
      }
      document_.target_names.push_back(targetNames(mesh));
      mesh.erase("extras");
    }
    const std::string text = kept.dump(-1, ' ', true, Json::error_handler_t::replace);
    tinygltf::TinyGLTF loader;
    std::string error, warning;
    const bool loaded = loader.LoadASCIIFromString(&document_.model, &error, &warning, text.data(),
                                                   static_cast<unsigned>(text.size()), "", tinygltf::REQUIRE_VERSION);
    if (!loaded) {
      std::string first = error.substr(0, std::min(error.find('\n'), std::size_t{200}));
      for (char& c : first)
        if (static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) > 0x7E) c = '?';
      fail("damaged glTF: " + (first.empty() ? "it cannot be read" : first));
    }
    if (document_.textured.size() != document_.model.materials.size())
      document_.textured.resize(document_.model.materials.size(), false);
  }

  // Of the morph targets only how they move the vertices.
  void keepTargetPositions(Json& primitive) const {
    const auto targets = primitive.find("targets");
    if (targets == primitive.end()) return;
    if (!targets->is_array() || targets->size() > kMaxTargets) fail("'targets' is no list of at most 4096 morph targets");
    for (Json& target : *targets) {
      if (!target.is_object()) fail("a morph target that is no object");
      const Json* position = member(target, "POSITION");
      if (position != nullptr && !position->is_number_unsigned()) fail("a morph target whose POSITION is no accessor");
      target = position == nullptr ? Json::object() : Json{{"POSITION", *position}};
    }
  }
  std::vector<std::string> targetNames(const Json& mesh) const {
    std::vector<std::string> out;
    const Json* extras = member(mesh, "extras");
    const Json* names = extras != nullptr && extras->is_object() ? member(*extras, "targetNames") : nullptr;
    if (names == nullptr || !names->is_array() || names->size() > kMaxTargets) return out;
    for (const Json& name : *names) out.push_back(name.is_string() ? name.get<std::string>() : std::string());
    return out;
  }

  std::string_view bytes_;
  const std::string& name_;
  const std::filesystem::path& folder_;
  std::string_view json_text_;
  std::size_t json_at_ = 0;
  std::optional<std::string_view> glb_chunk_;
  Json json_;
  GltfDocument document_;
};

// --- accessors ---

class AccessorReader {
 public:
  AccessorReader(const GltfDocument& document, const std::string& name) : document_(document), name_(name) {}

  std::vector<double> read(int index, std::size_t components, std::size_t most) {
    which_ = "accessor " + std::to_string(index);
    if (index < 0 || static_cast<std::size_t>(index) >= document_.model.accessors.size()) fail("does not exist");
    const tinygltf::Accessor& accessor = document_.model.accessors[static_cast<std::size_t>(index)];
    if (tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(accessor.type)) != static_cast<int>(components))
      fail("does not hold " + std::to_string(components) + " numbers an element");
    if (accessor.count > most)
      fail("has " + std::to_string(accessor.count) + " elements, more than the limit of " + std::to_string(most));
    const std::size_t size = sizeOf(accessor.componentType);
    std::vector<double> values;
    if (accessor.bufferView >= 0) {
      const View view = viewOf(accessor.bufferView, accessor.byteOffset, accessor.count, components * size);
      values.resize(accessor.count * components);
      for (std::size_t i = 0; i < accessor.count; ++i)
        for (std::size_t c = 0; c < components; ++c)
          values[i * components + c] =
              value(view.bytes.data() + i * view.stride + c * size, accessor.componentType, accessor.normalized);
    } else {
      // All zero, changed by the sparse part. It must not be longer than a file of this size can mean.
      values.resize(accessor.count * components, 0.0);
    }
    if (accessor.sparse.isSparse) applySparse(accessor, components, size, values);
    return values;
  }

 private:
  struct View {
    std::string_view bytes;  // from the first element on
    std::size_t stride;
  };

  [[noreturn]] void fail(const std::string& what) const { throw InputError(name_ + ": " + which_ + " " + what); }

  std::size_t sizeOf(int component_type) const {
    switch (component_type) {
      case TINYGLTF_COMPONENT_TYPE_BYTE:
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return 1;
      case TINYGLTF_COMPONENT_TYPE_SHORT:
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return 2;
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
      case TINYGLTF_COMPONENT_TYPE_FLOAT:
        return 4;
      default:
        fail("has an unknown component type");
    }
  }

  View viewOf(int index, std::size_t offset, std::size_t count, std::size_t element) const {
    if (static_cast<std::size_t>(index) >= document_.model.bufferViews.size())
      fail("names a buffer view that does not exist");
    const tinygltf::BufferView& view = document_.model.bufferViews[static_cast<std::size_t>(index)];
    if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= document_.buffers.size())
      fail("lies in a buffer that does not exist");
    const std::string_view buffer = document_.buffers[static_cast<std::size_t>(view.buffer)];
    if (view.byteOffset > buffer.size() || view.byteLength > buffer.size() - view.byteOffset)
      fail("lies in a buffer view that reaches beyond its buffer of " + std::to_string(buffer.size()) + " bytes");
    const std::size_t stride = view.byteStride == 0 ? element : view.byteStride;
    if (stride < element || stride > 65535) fail("has a stride that does not fit its elements");
    // count is at most 2^24 here and stride 2^16, so nothing overflows.
    const std::size_t needed = count == 0 ? 0 : (count - 1) * stride + element;
    if (offset > view.byteLength || needed > view.byteLength - offset)
      fail("needs " + std::to_string(needed) + " bytes, its view has " +
           std::to_string(offset > view.byteLength ? 0 : view.byteLength - offset));
    return {buffer.substr(view.byteOffset + offset, needed), stride};
  }

  template <typename T>
  static double number(const char* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  }
  static double value(const char* at, int component_type, bool normalized) {
    switch (component_type) {
      case TINYGLTF_COMPONENT_TYPE_BYTE:
        return normalized ? std::max(number<std::int8_t>(at) / 127.0, -1.0) : number<std::int8_t>(at);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
        return normalized ? number<std::uint8_t>(at) / 255.0 : number<std::uint8_t>(at);
      case TINYGLTF_COMPONENT_TYPE_SHORT:
        return normalized ? std::max(number<std::int16_t>(at) / 32767.0, -1.0) : number<std::int16_t>(at);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
        return normalized ? number<std::uint16_t>(at) / 65535.0 : number<std::uint16_t>(at);
      case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
        return number<std::uint32_t>(at);
      default:
        return number<float>(at);
    }
  }

  void applySparse(const tinygltf::Accessor& accessor, std::size_t components, std::size_t size,
                   std::vector<double>& values) const {
    const auto& sparse = accessor.sparse;
    if (sparse.count < 0 || static_cast<std::size_t>(sparse.count) > accessor.count)
      fail("has more sparse values than elements");
    if (sparse.indices.bufferView < 0 || sparse.values.bufferView < 0 || sparse.indices.byteOffset < 0 ||
        sparse.values.byteOffset < 0)
      fail("has a damaged sparse part");
    const auto count = static_cast<std::size_t>(sparse.count);
    const int index_type = sparse.indices.componentType;
    if (index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
        index_type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)
      fail("has sparse indices of an unknown type");
    const std::size_t index_size = sizeOf(index_type);
    const View indices =
        viewOf(sparse.indices.bufferView, static_cast<std::size_t>(sparse.indices.byteOffset), count, index_size);
    const View changed =
        viewOf(sparse.values.bufferView, static_cast<std::size_t>(sparse.values.byteOffset), count, components * size);
    double before = -1;
    for (std::size_t i = 0; i < count; ++i) {
      const double at = value(indices.bytes.data() + i * indices.stride, index_type, false);
      if (at <= before || at >= static_cast<double>(accessor.count))
        fail("has sparse indices out of order or out of range");
      before = at;
      for (std::size_t c = 0; c < components; ++c)
        values[static_cast<std::size_t>(at) * components + c] =
            value(changed.bytes.data() + i * changed.stride + c * size, accessor.componentType, accessor.normalized);
    }
  }

  const GltfDocument& document_;
  const std::string& name_;
  std::string which_;
};

}  // namespace

GltfDocument openGltf(std::string_view bytes, const std::string& name, const std::filesystem::path& folder) {
  return Opener(bytes, name, folder).open();
}

std::vector<double> readAccessor(const GltfDocument& document, int accessor, std::size_t components, std::size_t most,
                                 const std::string& name) {
  return AccessorReader(document, name).read(accessor, components, most);
}

}  // namespace volto::rig
