// Networks made for a test: the average colour of the picture, times a matrix, plus a constant, in any shape. Written
// as ONNX by hand, so that the outputs of models that are not at hand can be played.
#pragma once

#include <string>
#include <vector>

namespace volto::test {

struct OnnxOutput {
  std::string name;
  std::vector<int> shape;         // begins with 1
  std::vector<float> constant;    // one per number of the shape
  std::vector<float> per_colour;  // empty, or 3 by numbers, row by row: what each channel's mean adds
};

// Input "input", 1 x 3 x height x width.
std::string makeOnnx(int width, int height, const std::vector<OnnxOutput>& outputs);

}  // namespace volto::test
