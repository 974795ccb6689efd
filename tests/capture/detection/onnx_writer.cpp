#include "tests/capture/detection/onnx_writer.h"

#include <cstdint>
#include <cstring>

namespace volto::test {
namespace {

// Protocol buffers: a key and a value after another.
class Message {
 public:
  Message& number(unsigned field, std::uint64_t value) {
    varint(field << 3U);
    varint(value);
    return *this;
  }
  Message& bytes(unsigned field, const std::string& value) {
    varint((field << 3U) | 2U);
    varint(value.size());
    text_ += value;
    return *this;
  }
  Message& message(unsigned field, const Message& value) { return bytes(field, value.text_); }
  const std::string& text() const { return text_; }

 private:
  void varint(std::uint64_t value) {
    for (; value >= 0x80; value >>= 7U) text_ += static_cast<char>((value & 0x7F) | 0x80);
    text_ += static_cast<char>(value);
  }
  std::string text_;
};

template <typename T>
std::string rawBytes(const std::vector<T>& values) {
  std::string out(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(out.data(), values.data(), out.size());
  return out;
}

Message tensor(const std::string& name, const std::vector<int>& dims, unsigned type, const std::string& raw) {
  Message out;
  for (const int d : dims) out.number(1, static_cast<std::uint64_t>(d));
  return out.number(2, type).bytes(8, name).bytes(9, raw);
}

Message valueInfo(const std::string& name, const std::vector<int>& dims) {
  Message shape;
  for (const int d : dims) shape.message(1, Message().number(1, static_cast<std::uint64_t>(d)));
  return Message().bytes(1, name).message(2, Message().message(1, Message().number(1, 1).message(2, shape)));
}

Message node(const std::string& type, const std::vector<std::string>& inputs, const std::string& output) {
  Message out;
  for (const std::string& input : inputs) out.bytes(1, input);
  return out.bytes(2, output).bytes(3, output + "_node").bytes(4, type);
}

}  // namespace

std::string makeOnnx(int width, int height, const std::vector<OnnxOutput>& outputs) {
  constexpr unsigned kFloat = 1, kInt64 = 7;
  Message graph;
  graph.message(1, node("GlobalAveragePool", {"input"}, "mean"));
  graph.message(1, node("Flatten", {"mean"}, "colour"));
  graph.bytes(2, "made for a test");
  for (const OnnxOutput& output : outputs) {
    const int count = static_cast<int>(output.constant.size());
    std::vector<float> matrix = output.per_colour;
    if (matrix.empty()) matrix.assign(3 * output.constant.size(), 0.0F);
    // Transposed, and said so: OpenCV 4.6 takes a matrix without the attribute to be transposed.
    std::vector<float> transposed(matrix.size());
    for (std::size_t n = 0; n < output.constant.size(); ++n)
      for (std::size_t c = 0; c < 3; ++c) transposed[3 * n + c] = matrix[c * output.constant.size() + n];
    graph.message(1, node("Gemm", {"colour", output.name + "_m", output.name + "_c"}, output.name + "_flat")
                         .message(5, Message().bytes(1, "transB").number(3, 1).number(20, 2)));
    graph.message(1, node("Reshape", {output.name + "_flat", output.name + "_shape"}, output.name));
    graph.message(5, tensor(output.name + "_m", {count, 3}, kFloat, rawBytes(transposed)));
    graph.message(5, tensor(output.name + "_c", {count}, kFloat, rawBytes(output.constant)));
    const std::vector<std::int64_t> shape(output.shape.begin(), output.shape.end());
    graph.message(5, tensor(output.name + "_shape", {static_cast<int>(shape.size())}, kInt64, rawBytes(shape)));
  }
  graph.message(11, valueInfo("input", {1, 3, height, width}));
  for (const OnnxOutput& output : outputs) graph.message(12, valueInfo(output.name, output.shape));
  return Message().number(1, 7).message(7, graph).message(8, Message().bytes(1, "").number(2, 11)).text();
}

}  // namespace volto::test
