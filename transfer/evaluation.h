// How far a set of expressions is from what it should be: per expression and per region of the face.
//
// Error = |result - expected| per vertex, where expected = neutral + (truth - truth_neutral): the truth may be another
// person's expressions, carried over as displacements. Relative error = root of (sum of error^2 / sum of expected
// displacement^2), the measure that transfers are judged by; lengths are also given as a share of the eye separation
// where it is known.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "rig/contacts.h"
#include "rig/mesh.h"

namespace volto::transfer {

struct ErrorFigures {
  std::size_t vertices = 0;
  double rms = 0;           // mesh unit
  double maximum = 0;       // mesh unit
  double expected_rms = 0;  // how far the expected expression moves these vertices
  // Nothing where the expected expression does not move (expected_rms below 1e-4 of the mesh's size): there is nothing
  // to relate to.
  std::optional<double> relative;
};

struct ExpressionEvaluation {
  std::string name;
  ErrorFigures whole;
  std::vector<ErrorFigures> regions;  // one per name in Evaluation::region_names
  // Where this shape is made to be added to another one of the set (transfer/added_examples.h), the name of that one:
  // what follows is counted on their sum.
  std::string counted_with;
  // Triangles whose area changed by more than a factor 3 against what was expected, and those that are inside out
  // against the expected shape (normals more than 90 degrees apart).
  std::size_t area_distorted = 0, flipped = 0;
  // How deep lips and lids have passed each other and skin entered an eyeball, beyond rest; where contacts are known.
  std::optional<rig::Penetration> result_passes, expected_passes;
  // Pairs of the skin's triangles that go through each other and do not at rest, one of them at least in lips or lids
  // (EvaluationScope::intersecting); by less than 0.0005 eye separations they only touch. Nothing where lips and lids are
  // not known.
  struct Crossings {
    std::size_t pairs = 0;
    std::vector<std::size_t> regions;  // one per region: pairs with a triangle in it
  };
  std::optional<Crossings> result_crossings, expected_crossings;
};

struct Evaluation {
  std::vector<std::string> region_names;
  std::vector<ExpressionEvaluation> expressions;
  double mean_relative = 0;           // over the expressions that have one
  std::size_t related = 0;            // how many those are
  std::vector<float> rms_per_vertex;  // #V: over all expressions; 0 for vertices that are not judged
};

struct EvaluationScope {
  std::size_t first_vertex = 0, end_vertex = SIZE_MAX;  // only these are judged
  std::vector<std::string> region_names;                // empty: no regions
  std::vector<std::int16_t> region_of_vertex;           // #V: index into region_names, -1: none
  const rig::Contacts* contacts = nullptr;              // of the neutral mesh; borrowed for the call
  double eye_separation = 0;                            // mesh unit, where contacts are given
  std::vector<bool> intersecting;                       // one per region: lips and lids; empty: none is looked at
  std::vector<std::array<std::uint32_t, 3>> skin;       // what they may go through
};

// One `result` and one `truth` per name. Several at a time, the same figures however many. Throws std::invalid_argument when sizes differ.
Evaluation evaluate(const rig::Mesh& neutral, const rig::VertexPositions& truth_neutral,
                    std::span<const std::string> names, std::span<const rig::VertexPositions> results,
                    std::span<const rig::VertexPositions> truths, const EvaluationScope& scope = {});

}  // namespace volto::transfer
