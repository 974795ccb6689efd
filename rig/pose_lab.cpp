#include "rig/pose_lab.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Geometry>

namespace volto::rig {
namespace {

constexpr int kMostRounds = 72;
constexpr int kHeldRounds = 48;   // then what should be held gives way too
constexpr int kPatience = 48;     // rounds without a better one
constexpr int kGrowthRounds = 8;  // in which the region gets no wider than its folds
constexpr int kAllGrows = 16;     // from this round on
constexpr int kSteps = 5;         // of a round
constexpr float kLeaning = 0.4F;
constexpr float kFoldCosine = 0.12F;  // a little before a triangle stands at right angles to where it was
constexpr float kFolded = 0.02F;
constexpr double kCostOfMoving = 1;  // a vertex by an eye separation, in folded triangles
constexpr float kLeastArea = 0.01F;  // of what it was

}  // namespace

PoseLab::PoseLab(const Rig& rig, const Skin& skin)
    : rig_(rig),
      skin_(skin),
      es_(static_cast<float>(rig.fapu.fapu.eye_separation)),
      neutral_(neutralPositions(rig)),
      base_(neutral_),
      positions_(neutral_),
      free_(neutral_.size(), false) {
  for (std::uint32_t v = 0; v < free_.size(); ++v)
    free_[v] = rig.association.kind[v] == AssociationKind::ray || rig.association.kind[v] == AssociationKind::geodesic;
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    const Eigen::Vector3f normal = (rest(b) - rest(a)).cross(rest(c) - rest(a));
    if (a == b || b == c || c == a || !(normal.norm() > 1e-9F * es_ * es_)) return;
    triangles_.push_back({a, b, c});
    rest_normal_.push_back(normal);
    rest_area_.push_back(normal.norm());
  };
  const Mesh& mesh = rig.neutral;
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p) {
    const std::uint32_t first = mesh.polygon_start[p], corners = mesh.polygon_start[p + 1] - first;
    const auto corner = [&](std::uint32_t c) { return mesh.corner_vertices[first + c % corners]; };
    bool any_free = false;
    for (std::uint32_t c = 0; c < corners; ++c) any_free = any_free || free_[corner(c)];
    if (!any_free) continue;
    if (corners == 4) {
      for (std::uint32_t c = 0; c < 4; ++c) add(corner(c), corner(c + 1), corner(c + 2));
    } else {
      for (std::uint32_t c = 2; c < corners; ++c) add(corner(0), corner(c - 1), corner(c));
    }
  }
  triangles_of_start_.assign(neutral_.size() + 1, 0);
  for (const auto& t : triangles_)
    for (const std::uint32_t v : t) ++triangles_of_start_[skin_.same_as[v] + 1];
  for (std::size_t v = 0; v < neutral_.size(); ++v) triangles_of_start_[v + 1] += triangles_of_start_[v];
  triangles_of_.resize(triangles_of_start_.back());
  std::vector<std::uint32_t> filled(triangles_of_start_.begin(), triangles_of_start_.end() - 1);
  for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    for (const std::uint32_t v : triangles_[t]) triangles_of_[filled[skin_.same_as[v]]++] = t;
  for (std::uint32_t v = 0; v < neutral_.size(); ++v)
    if (skin_.same_as[v] != v && free_[v]) doubles_.push_back(v);
  slit_of_.assign(neutral_.size(), -1);
  for (std::size_t k = 0; k < rig.contacts.slits.size(); ++k)
    for (const std::uint32_t v : rig.contacts.slits[k].vertex)
      slit_of_[skin_.same_as[v]] = static_cast<std::int32_t>(k);
  groupContacts();
}

void PoseLab::groupContacts() {
  const Contacts& all = rig_.contacts;
  const std::size_t balls = all.balls.size(), count = balls + all.slits.size();
  std::vector<std::vector<std::uint8_t>> reads(count, std::vector<std::uint8_t>(neutral_.size(), 0));
  for (std::size_t i = 0; i < count; ++i) {
    const std::vector<std::uint32_t>& vertices = i < balls ? all.balls[i].vertex : all.slits[i - balls].vertex;
    for (const std::uint32_t v : vertices) reads[i][v] = 1;
    if (i < balls) continue;
    for (const auto* side : {&all.slits[i - balls].upper, &all.slits[i - balls].lower})
      for (const SlitContact::Sample& s : *side) reads[i][s.first] = reads[i][s.second] = 1;
  }
  std::vector<std::size_t> group(count);
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t j = 0; j < i; ++j) {
      bool shared = (i >= balls && all.slits[i - balls].ball == static_cast<std::int32_t>(j));
      for (std::size_t v = 0; v < neutral_.size() && !shared; ++v) shared = (reads[i][v] & reads[j][v]) != 0;
      if (!shared) continue;
      const std::size_t from = std::max(group[i], group[j]), to = std::min(group[i], group[j]);
      std::replace(group.begin(), group.end(), from, to);
    }
  for (std::size_t g = 0; g < count; ++g) {
    if (group[g] != g) continue;
    ContactGroup out;
    out.reads.assign(neutral_.size(), 0);
    std::vector<std::int32_t> new_index(balls, -1);
    for (std::size_t i = 0; i < count; ++i) {
      if (group[i] != g) continue;
      for (std::size_t v = 0; v < neutral_.size(); ++v) out.reads[v] |= reads[i][v];
      const std::vector<std::uint32_t>& vertices = i < balls ? all.balls[i].vertex : all.slits[i - balls].vertex;
      out.vertices.insert(out.vertices.end(), vertices.begin(), vertices.end());
      if (i < balls) {
        new_index[i] = static_cast<std::int32_t>(out.contacts.balls.size());
        out.contacts.balls.push_back(all.balls[i]);
      } else {
        out.contacts.slits.push_back(all.slits[i - balls]);
        std::int32_t& ball = out.contacts.slits.back().ball;
        if (ball >= 0) ball = new_index[static_cast<std::size_t>(ball)];
      }
    }
    std::sort(out.vertices.begin(), out.vertices.end());
    out.vertices.erase(std::unique(out.vertices.begin(), out.vertices.end()), out.vertices.end());
    contact_groups_.push_back(std::move(out));
  }
}

void PoseLab::setWeights(std::span<const float> weights) {
  poseByOperator(rig_, weights, neutral_, base_);
  addToPose(rig_, weights, true, neutral_, base_);
}

const std::vector<Position>& PoseLab::evaluate(const DenseDisplacement& extra) {
  for (std::size_t v = 0; v < positions_.size(); ++v)
    for (std::size_t axis = 0; axis < 3; ++axis) positions_[v][axis] = base_[v][axis] + extra[v].data()[axis];
  for (const ContactGroup& group : contact_groups_) resolveContacts(group.contacts, neutral_, positions_);
  return positions_;
}

void PoseLab::place(std::uint32_t v, const DenseDisplacement& extra) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    positions_[v][axis] = base_[v][axis] + extra[v][static_cast<Eigen::Index>(axis)];
}

void PoseLab::setPosition(std::uint32_t v, const Eigen::Vector3f& to, DenseDisplacement& extra) {
  extra[v] = to - Eigen::Map<const Eigen::Vector3f>(base_[v].data());
  place(v, extra);
}

float PoseLab::uprightness(std::size_t triangle) const {
  const auto& [a, b, c] = triangles_[triangle];
  if (positions_[a] == neutral_[a] && positions_[b] == neutral_[b] && positions_[c] == neutral_[c]) return 1;
  const Eigen::Vector3f now = (at(b) - at(a)).cross(at(c) - at(a));
  const float rest = rest_area_[triangle], area = now.norm();
  return area > kLeastArea * rest ? now.dot(rest_normal_[triangle]) / (area * rest) : -1.0F;
}

bool PoseLab::unfold(DenseDisplacement& extra, std::span<const std::uint32_t> held) {
  evaluate(extra);
  // What is looked at again in every round: triangles that lean already, and all around the skin that is being relaxed.
  std::vector<std::uint32_t> suspects;
  std::vector<std::uint8_t> suspected(triangles_.size(), 0);
  const auto suspect = [&](std::uint32_t t) {
    if (suspected[t] == 0) suspects.push_back(t);
    suspected[t] = 1;
  };
  std::vector<std::uint8_t> away(neutral_.size());
  for (std::size_t v = 0; v < away.size(); ++v) away[v] = positions_[v] != neutral_[v] ? 1 : 0;
  for (std::uint32_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    if ((away[a] | away[b] | away[c]) != 0 && uprightness(t) < kLeaning) suspect(t);
  }
  if (suspects.empty()) return true;

  std::vector<std::uint32_t> region, copies, seeds;
  std::vector<std::uint8_t> in_region(neutral_.size(), 0), is_held(neutral_.size(), 0);
  for (const std::uint32_t v : held) is_held[skin_.same_as[v]] = 1;
  // The mask says where its points go; or a fold at a corner of the mouth would take the opening of the jaw back.
  for (const std::int32_t v : rig_.feature_vertex)
    if (v >= 0) is_held[skin_.same_as[static_cast<std::uint32_t>(v)]] = 1;
  // Where lips or lids are relaxed, the push of their contact becomes part of the correction: it would be made again on
  // top of itself.
  std::vector<std::uint8_t> kept(rig_.contacts.slits.size(), 0), to_keep(kept);
  // Contacts that nothing of the region has to do with stay as evaluate() left them.
  std::vector<std::uint8_t> touched(contact_groups_.size(), 0);
  const auto touch = [&](std::uint32_t v) {
    for (std::size_t g = 0; g < touched.size(); ++g) touched[g] |= contact_groups_[g].reads[v];
  };
  const auto addToRegion = [&](std::uint32_t v) {
    if (in_region[v] != 0 || !free_[v]) return;
    in_region[v] = 1;
    touch(v);
    region.push_back(v);
    if (slit_of_[v] >= 0) to_keep[static_cast<std::size_t>(slit_of_[v])] = 1;
    for (std::uint32_t i = triangles_of_start_[v]; i < triangles_of_start_[v + 1]; ++i) suspect(triangles_of_[i]);
  };
  std::vector<Eigen::Vector3f> moved(neutral_.size(), Eigen::Vector3f::Zero()), next;
  const std::vector<Position> given = positions_;
  DenseDisplacement best = extra;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  std::size_t left = fewest;  // by the best
  double lowest = std::numeric_limits<double>::infinity();
  int best_round = 0;
  for (int round = 0; round < kMostRounds; ++round) {
    seeds.clear();
    std::size_t folded = 0;
    for (const std::uint32_t t : suspects) {
      const float upright = uprightness(t);
      if (upright >= kFoldCosine) continue;
      folded += upright < kFolded ? 1 : 0;
      for (const std::uint32_t v : triangles_[t]) seeds.push_back(skin_.same_as[v]);
    }
    // The last few folds are not worth what relaxing ever more skin around them does to its form (fold_guard.h opens
    // them where they are).
    double cost = static_cast<double>(folded);
    for (const std::uint32_t v : region)
      cost += kCostOfMoving / es_ * (at(v) - Eigen::Map<const Eigen::Vector3f>(given[v].data())).norm();
    if (cost < lowest) {
      lowest = cost;
      best = extra;
      left = folded;
    }
    if (seeds.empty() || round > best_round + kPatience) break;
    if (folded < fewest) {
      fewest = folded;
      best_round = round;
    }
    // The region only grows, so that a fold is not chased to and fro; all of it when a narrow one does not do.
    const bool all_grows = round >= kAllGrows && round % kGrowthRounds == kGrowthRounds / 2;
    if (all_grows) seeds.insert(seeds.end(), region.begin(), region.end());
    for (const std::uint32_t v : seeds) {
      addToRegion(v);
      if (round % kGrowthRounds != 0 && !all_grows) continue;
      for (std::uint32_t e = skin_.graph.start[v]; e < skin_.graph.start[v + 1]; ++e)
        addToRegion(skin_.graph.neighbour[e]);
    }
    std::sort(region.begin(), region.end());
    for (std::size_t k = 0; k < kept.size(); ++k) {
      if (kept[k] != 0 || to_keep[k] == 0) continue;
      kept[k] = 1;
      for (const std::uint32_t v : rig_.contacts.slits[k].vertex) setPosition(v, at(v), extra);
    }
    // Jacobi steps: every displacement half way to the mean of its neighbours'.
    for (const std::uint32_t v : region) {
      moved[v] = at(v) - rest(v);
      for (std::uint32_t e = skin_.graph.start[v]; e < skin_.graph.start[v + 1]; ++e)
        moved[skin_.graph.neighbour[e]] = at(skin_.graph.neighbour[e]) - rest(skin_.graph.neighbour[e]);
    }
    next.resize(region.size());
    for (int step = 0; step < kSteps; ++step) {
      for (std::size_t i = 0; i < region.size(); ++i) {
        const std::uint32_t v = region[i];
        next[i] = moved[v];
        const auto count = static_cast<float>(skin_.graph.start[v + 1] - skin_.graph.start[v]);
        if (count == 0 || (is_held[v] != 0 && round < kHeldRounds)) continue;
        Eigen::Vector3f sum = Eigen::Vector3f::Zero();
        for (std::uint32_t e = skin_.graph.start[v]; e < skin_.graph.start[v + 1]; ++e)
          sum += moved[skin_.graph.neighbour[e]];
        next[i] = 0.5F * moved[v] + 0.5F / count * sum;
      }
      for (std::size_t i = 0; i < region.size(); ++i) moved[region[i]] = next[i];
    }
    for (std::size_t i = 0; i < region.size(); ++i) {
      // Not added to what `extra` was: contact may have undone part of that, and would again.
      setPosition(region[i], moved[region[i]] + rest(region[i]), extra);
    }
    for (const std::uint32_t v : doubles_)
      if (in_region[skin_.same_as[v]] != 0) {
        extra[v] = extra[skin_.same_as[v]];
        place(v, extra);
        touch(v);
      }
    for (const ContactGroup& group : contact_groups_) {
      if (touched[static_cast<std::size_t>(&group - contact_groups_.data())] == 0) continue;
      for (const std::uint32_t v : group.vertices) place(v, extra);
      resolveContacts(group.contacts, neutral_, positions_);
    }
  }
  extra = std::move(best);
  evaluate(extra);
  return left == 0;
}

SparseDisplacement PoseLab::sparse(const DenseDisplacement& dense) const {
  SparseDisplacement out;
  for (std::uint32_t v = 0; v < dense.size(); ++v) {
    if (!(dense[v].squaredNorm() > 1e-10F * es_ * es_)) continue;
    out.vertex.push_back(v);
    out.displacement.push_back({dense[v][0], dense[v][1], dense[v][2]});
  }
  return out;
}

}  // namespace volto::rig
