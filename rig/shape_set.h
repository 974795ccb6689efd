// A vocabulary of blendshapes and what each of its words means in ARKit's: by it one program's weights become
// another's.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "frames/arkit_blendshapes.h"

namespace volto::rig {

class ShapeSet {
 public:
  struct Part {
    std::uint16_t arkit = 0;  // index of the ARKit name
    double weight = 0;        // of it, at full weight of the shape; 0..1
  };
  struct Shape {
    std::string name;
    std::vector<Part> parts;  // ascending by ARKit shape; none: it means nothing to a face (VRM's neutral)
    bool one_way = false;     // understood, but never written: others of the set say the same
  };
  // The known name nearest to one that is not known, or nothing.
  using Suggest = std::function<std::string(std::string_view, std::span<const std::string>)>;

  // A data file: rows "shape,arkit,weight[,one_way]", as assets/shape_sets/*.csv say. Throws InputError "file:line:
  // what; what to do": an unknown ARKit name, a row twice, a weight that is not 0..1, no rows, more than 1000 shapes.
  static ShapeSet parse(std::string_view text, const std::string& name_for_errors, const Suggest& suggest = {});

  // The sets shipped with Volto, compiled into the library: arkit, facs, ict, vrm0, vrm1.
  static std::span<const ShapeSet> shipped();
  // One of them, or null.
  static const ShapeSet* shipped(std::string_view name);

  // Of each name its meaning in `known`, in the order of `names`. Names that are not there mean nothing.
  static ShapeSet ofNames(std::span<const std::string> names, const ShapeSet& known);

  const std::string& name() const { return name_; }
  std::span<const Shape> shapes() const { return shapes_; }
  // Null for a name that the set has not; case matters, but not in ARKit names.
  const Shape* find(std::string_view name) const;

  // Sums of weight times part, cut at 0 and 1. `weights`: one per shape.
  void toArkit(std::span<const float> weights, ArkitWeights& out) const;
  // The weights of this set that come nearest (bounded least squares over the ARKit shapes that `observed` allows, with
  // a trace of a pull to zero, so that shapes of one meaning share it alike). Exact where the set can say it. A shape
  // is observed when at least half of what it means is.
  void fromArkit(const ArkitWeights& weights, const ArkitObserved& observed, std::span<float> out,
                 std::span<std::uint8_t> out_observed) const;

 private:
  std::string name_;
  std::vector<Shape> shapes_;
};

// The shipped set that most of the names belong to, at least half of them; null when there is none.
const ShapeSet* shapeSetOf(std::span<const std::string> names);

}  // namespace volto::rig
