// Poses of a character while it is being rigged: with a correction that is still being made, and with what is wrong
// with the result. Internal to rig/.
#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "rig/pose.h"
#include "rig/skin.h"

namespace volto::rig {

// A displacement of every vertex.
using DenseDisplacement = std::vector<Eigen::Vector3f>;

class PoseLab {
 public:
  // Borrows both; what the rig gains later (corrections, combinations) counts from the next setWeights() on.
  PoseLab(const Rig& rig, const Skin& skin);

  // The pose under work: one weight per blendshape. evaluate() adds `extra` before contacts and fills positions().
  void setWeights(std::span<const float> weights);
  const std::vector<Position>& evaluate(const DenseDisplacement& extra);
  const std::vector<Position>& positions() const { return positions_; }
  const std::vector<Position>& beforeContacts() const { return base_; }
  const std::vector<Position>& neutral() const { return neutral_; }

  // Relaxes the displacement around triangles (both ways to cut a quad) that turned by nearly a right angle or lost
  // nearly all of their area, until there are none, or for a while: what it takes is added to `extra`. `held`: vertices
  // that give way last. Returns whether no such triangle is left.
  bool unfold(DenseDisplacement& extra, std::span<const std::uint32_t> held = {});

  // The vertex is to be at `to`, contacts permitting: `extra` follows.
  void setPosition(std::uint32_t v, const Eigen::Vector3f& to, DenseDisplacement& extra);

  DenseDisplacement nothing() const { return DenseDisplacement(neutral_.size(), Eigen::Vector3f::Zero()); }
  // Without what could not be seen.
  SparseDisplacement sparse(const DenseDisplacement& dense) const;

  Eigen::Vector3f at(std::uint32_t v) const { return Eigen::Map<const Eigen::Vector3f>(positions_[v].data()); }
  Eigen::Vector3f rest(std::uint32_t v) const { return Eigen::Map<const Eigen::Vector3f>(neutral_[v].data()); }

 private:
  void place(std::uint32_t v, const DenseDisplacement& extra);
  float uprightness(std::size_t triangle) const;  // cosine of the angle it turned by; -1 without area

  // Contacts that have vertices in common, of balls and slits; what else moves does not move these.
  struct ContactGroup {
    Contacts contacts;                   // without riders, which are no skin
    std::vector<std::uint32_t> vertices;  // that they may move, ascending
    std::vector<std::uint8_t> reads;      // #V: whether they depend on it
  };
  void groupContacts();

  const Rig& rig_;
  const Skin& skin_;
  float es_;
  std::vector<Position> neutral_, base_, positions_;
  std::vector<std::array<std::uint32_t, 3>> triangles_;
  std::vector<Eigen::Vector3f> rest_normal_;
  std::vector<float> rest_area_;  // twice it
  std::vector<std::uint32_t> triangles_of_start_, triangles_of_;  // of each standing vertex
  std::vector<std::uint32_t> doubles_;                            // vertices that another one stands for
  std::vector<ContactGroup> contact_groups_;
  std::vector<std::int32_t> slit_of_;      // #V: the slit where it gives way, -1
  std::vector<bool> free_;                 // skin that may be corrected
};

}  // namespace volto::rig
