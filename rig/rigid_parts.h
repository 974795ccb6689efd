// What a head has besides its skin: eyeballs, teeth, tongue, lashes, brows, hair. Told apart by where they are and what
// shape they have; a material's name helps where the artist gave one.
#pragma once

#include <utility>
#include <vector>

#include "rig/association.h"
#include "rig/skin_rows.h"

namespace volto::rig {

struct HeadPlace {
  FeaturePointPositions points;    // mesh frame
  Eigen::Matrix3d mesh_from_head;  // rotation
  double eye_separation;           // mesh unit
};

// Finds the parts among the components that are not skin and gives their vertices rows:
// - an eyeball (a sphere at an eye, and what lies within it) has none: it follows the head and turns about its centre;
// - upper teeth and gums follow the head; lower ones and the tongue move affinely with the jaw's points, so that a turn
// of the jaw turns
//   them; a piece of gum that joins both goes over from one to the other;
// - small things on the skin (lashes, brows, the wet edge of the lids) move with the skin at their root, as a whole;
// - everything else follows the skin it lies on, less and less with distance, and not at all from a third of the eye
// separation on. Fills rows, and association.kind and .triangle of those vertices.
struct PlacedParts {
  std::vector<RigidPart> parts;
  // Vertices that follow the skin: displacement = sum of weight times that of a vertex of the skin.
  struct Binding {
    std::uint32_t vertex;
    std::vector<std::pair<std::uint32_t, double>> of;
  };
  std::vector<Binding> bindings;
};
// What `edits` say about a part goes before what is found. Throws InputError when one names a vertex of the skin itself.
PlacedParts placeParts(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin, const HeadPlace& place,
                       const std::vector<PartEdit>& edits, SkinAssociation& association, SkinRows& rows);

}  // namespace volto::rig
