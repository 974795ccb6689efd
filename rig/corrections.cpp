#include "rig/corrections.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <Eigen/Geometry>

#include "rig/parallel.h"
#include "rig/pose_lab.h"

namespace volto::rig {
namespace {

using Vec = Eigen::Vector3f;

float smoothStep(float x) {
  x = std::clamp(x, 0.0F, 1.0F);
  return x * x * (3 - 2 * x);
}

Vec toVec(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

// Shapes that go wrong together, without the side.
struct Pair {
  std::string_view first, second;
  bool sided;  // both have a left and a right version
};
constexpr Pair kLidPairs[] = {{"eyeBlink", "eyeLookUp", true}, {"eyeBlink", "eyeLookDown", true},
                              {"eyeBlink", "eyeLookIn", true}, {"eyeBlink", "eyeLookOut", true},
                              {"eyeBlink", "eyeSquint", true}, {"eyeBlink", "cheekSquint", true}};
constexpr Pair kFoldPairs[] = {{"mouthSmileLeft", "mouthSmileRight", false},
                               {"mouthFrownLeft", "mouthFrownRight", false},
                               {"noseSneerLeft", "noseSneerRight", false},
                               {"mouthUpperUpLeft", "mouthUpperUpRight", false},
                               {"mouthLowerDownLeft", "mouthLowerDownRight", false},
                               {"mouthRollUpper", "mouthRollLower", false},
                               {"mouthFunnel", "mouthPucker", false},
                               {"mouthFunnel", "jawOpen", false},
                               {"mouthPucker", "jawOpen", false},
                               {"mouthClose", "jawOpen", false},
                               {"mouthShrugUpper", "mouthShrugLower", false},
                               {"browInnerUp", "browDown", true},
                               {"noseSneer", "mouthUpperUp", true},
                               {"mouthSmile", "mouthUpperUp", true},
                               {"mouthSmile", "cheekSquint", true},
                               {"mouthPress", "mouthFrown", true},
                               {"mouthStretch", "mouthLowerDown", true},
                               {"mouthDimple", "mouthSmile", true}};
// With jawOpen, by themselves.
constexpr std::string_view kWithOpenJaw[] = {"mouthSmile", "mouthFrown", "mouthStretch", "mouthLowerDown",
                                             "mouthUpperUp"};

class CorrectionMaker {
 public:
  CorrectionMaker(Rig& rig, const Skin& skin)
      : rig_(rig), skin_(skin), lab_(rig, skin), es_(static_cast<float>(rig.fapu.fapu.eye_separation)) {
    up_ = rig.mesh_from_head.col(1).cast<float>();
    forward_ = rig.mesh_from_head.col(2).cast<float>();
  }

  void make() {
    holdMouthCloseToJaw();
    std::vector<SparseDisplacement> of_shape(rig_.blendshapes.size());
    inParallel(of_shape.size(), [&](CorrectionMaker& maker, std::size_t k) { of_shape[k] = maker.shape(k); });
    for (std::size_t k = 0; k < of_shape.size(); ++k) rig_.blendshapes[k].correction = std::move(of_shape[k]);

    std::vector<std::pair<std::string, std::string>> pairs;
    for (const Pair& pair : kLidPairs) addSides(pair, pairs);
    for (const Pair& pair : kFoldPairs) addSides(pair, pairs);
    for (const std::string_view name : kWithOpenJaw)
      for (const char* side : {"Left", "Right"}) pairs.emplace_back(std::string(name) + side, "jawOpen");
    std::vector<Combination> combined(pairs.size());
    inParallel(pairs.size(), [&](CorrectionMaker& maker, std::size_t i) {
      combined[i] = maker.combine(pairs[i].first, pairs[i].second);
    });
    for (Combination& combination : combined)
      if (!combination.correction.empty()) rig_.combinations.push_back(std::move(combination));
  }

 private:
  // Each thread with a lab of its own; the rig stays as it is meanwhile.
  void inParallel(std::size_t count, const std::function<void(CorrectionMaker&, std::size_t)>& work) {
    std::atomic<std::size_t> next{0};
    parallelFor(std::clamp(std::thread::hardware_concurrency(), 1U, 8U), [&](std::size_t worker) {
      std::optional<CorrectionMaker> own;
      if (worker != 0) own.emplace(rig_, skin_);
      for (std::size_t i = next++; i < count; i = next++) work(own ? *own : *this, i);
    });
  }

  std::optional<std::size_t> indexOf(std::string_view name) const {
    for (std::size_t k = 0; k < rig_.blendshapes.size(); ++k)
      if (rig_.blendshapes[k].name == name) return k;
    return std::nullopt;
  }
  Vec point(std::string_view id) const {
    return rig_.feature_positions.row(static_cast<Eigen::Index>(featurePointIndex(id).value()))
        .transpose()
        .cast<float>();
  }
  std::vector<float> weightsOf(std::initializer_list<std::size_t> shapes) const {
    std::vector<float> out(rig_.blendshapes.size(), 0.0F);
    for (const std::size_t k : shapes) out[k] = 1;
    return out;
  }
  const SlitContact* slitAt(SlitContact::Place place) const {
    for (const SlitContact& slit : rig_.contacts.slits)
      if (slit.place == place) return &slit;
    return nullptr;
  }

  // mouthClose is the way of the lips back from an open jaw. Beyond what the jaw has opened they have nowhere to go.
  void holdMouthCloseToJaw() {
    constexpr float kTaken = 0.95F;
    const auto close = indexOf("mouthClose"), open = indexOf("jawOpen");
    if (!close || !open) return;
    lab_.setWeights(weightsOf({*close}));
    DenseDisplacement back = lab_.nothing();
    for (std::uint32_t v = 0; v < back.size(); ++v)
      if (rig_.association.kind[v] != AssociationKind::rigid_part)
        back[v] = -kTaken * (toVec(lab_.beforeContacts()[v]) - lab_.rest(v));
    Combination combination;
    combination.name = "mouthClose beyond jawOpen";
    combination.rule = Combination::Rule::excess;
    combination.drivers = {{static_cast<std::uint16_t>(*close), false}, {static_cast<std::uint16_t>(*open), false}};
    combination.correction = lab_.sparse(back);
    rig_.combinations.push_back(std::move(combination));
  }

  SparseDisplacement shape(std::size_t k) {
    const std::string& name = rig_.blendshapes[k].name;
    lab_.setWeights(weightsOf({k}));
    DenseDisplacement extra = lab_.nothing();
    const bool blink = name == "eyeBlinkLeft" || name == "eyeBlinkRight";
    const SlitContact* lids =
        !blink ? nullptr
               : slitAt(name.ends_with("Left") ? SlitContact::Place::left_eye : SlitContact::Place::right_eye);
    if (name == "cheekPuff") puffCheeks(extra);
    if (name == "tongueOut") putTongueOut(extra);
    if (name.starts_with("mouthRoll") || name.starts_with("mouthPress")) keepBeforeTeeth(extra);
    if (lids != nullptr) {
      closeWithoutFolds(*lids, extra);
    } else {
      lab_.unfold(extra);
    }
    return lab_.sparse(extra);
  }

  // Funnel and pucker both bring the lips forward. Together they do not bring them twice as far.
  void shareProtrusion(std::size_t shape, DenseDisplacement& extra) {
    constexpr float kSpared = 0.45F;
    lab_.setWeights(weightsOf({shape}));
    for (std::uint32_t v = 0; v < extra.size(); ++v)
      if (rig_.association.kind[v] != AssociationKind::rigid_part)
        extra[v] -= kSpared * (toVec(lab_.beforeContacts()[v]) - lab_.rest(v));
  }

  // Lips that close over an open jaw draw the chin's skin up: the jaw goes along, lest the teeth come through it. What
  // is added to a part's vertices is turned with the part afterwards, so turning back by a share of the angle first
  // leaves the rest of it.
  void keepJawInChin(std::size_t close, std::size_t open, DenseDisplacement& extra) {
    const std::int32_t chin = rig_.feature_vertex[featurePointIndex("2.10").value()];
    if (chin < 0) return;
    const auto v = static_cast<std::uint32_t>(chin);
    lab_.setWeights(weightsOf({open}));
    lab_.evaluate(lab_.nothing());
    const Vec alone = lab_.at(v) - lab_.rest(v);
    lab_.setWeights(weightsOf({close, open}));
    lab_.evaluate(lab_.nothing());
    const Vec both = lab_.at(v) - lab_.rest(v);
    if (!(alone.squaredNorm() > 0)) return;
    const float left = std::clamp(both.dot(alone) / alone.squaredNorm(), 0.2F, 1.0F);
    for (const PartMotion& motion : rig_.part_motions) {
      if (motion.follows != RigidPart::Follows::jaw) continue;
      for (const PartMotion::Turn& turn : motion.turns) {
        if (turn.shape != open) continue;
        const Vec rotation = (left - 1) * toVec(turn.rotation), pivot = toVec(motion.pivot);
        const float angle = rotation.norm();
        if (!(angle > 1e-6F)) continue;
        const Eigen::Matrix3f back = Eigen::AngleAxisf(angle, rotation / angle).toRotationMatrix();
        for (std::size_t i = 0; i < motion.vertices.size(); ++i) {
          const Vec arm = lab_.rest(motion.vertices[i]) - pivot;
          extra[motion.vertices[i]] += motion.share[i] * (back * arm - arm);
        }
      }
    }
  }

  void addSides(const Pair& pair, std::vector<std::pair<std::string, std::string>>& out) const {
    if (!pair.sided) {
      out.emplace_back(pair.first, pair.second);
      return;
    }
    for (const std::string side : {"Left", "Right"}) {
      std::string first = std::string(pair.first) + side;
      if (!indexOf(first)) first = pair.first;  // browInnerUp
      out.emplace_back(first, std::string(pair.second) + side);
    }
  }

  // Without correction where none is needed, or where the rig has no such shapes.
  Combination combine(const std::string& first, const std::string& second) {
    Combination combination;
    const auto a = indexOf(first), b = indexOf(second);
    if (!a || !b) return combination;
    DenseDisplacement extra = lab_.nothing();
    if (first == "mouthFunnel" && second == "mouthPucker") shareProtrusion(*b, extra);
    if (first == "mouthClose" && second == "jawOpen") keepJawInChin(*a, *b, extra);
    lab_.setWeights(weightsOf({*a, *b}));
    const SlitContact* closing = nullptr;
    if (first.starts_with("eyeBlink"))
      closing = slitAt(first.ends_with("Left") ? SlitContact::Place::left_eye : SlitContact::Place::right_eye);
    if (first == "mouthClose") closing = slitAt(SlitContact::Place::mouth);
    if (closing != nullptr) {
      closeWithoutFolds(*closing, extra);
    } else {
      lab_.unfold(extra);
    }
    combination.name = first + " + " + second;
    combination.drivers = {{static_cast<std::uint16_t>(*a), false}, {static_cast<std::uint16_t>(*b), false}};
    combination.correction = lab_.sparse(extra);
    return combination;
  }

  // --- lids

  // What is open between the margins, per column.
  std::vector<float> gaps(const SlitContact& slit) const {
    const std::array<float, kMaxSlitColumns> all = slitGaps(slit, lab_.positions());
    return {all.begin(), all.begin() + static_cast<std::ptrdiff_t>(slit.upper.size())};
  }

  // Leads the margins together, lids along the ball, a little beyond so that a blink that is not quite full closes too;
  // contact keeps them from passing each other.
  void close(const SlitContact& slit, DenseDisplacement& extra) {
    const float beyond = 0.004F * es_;
    const Vec up = toVec(slit.up);
    for (int round = 0; round < 6; ++round) {
      lab_.evaluate(extra);
      std::vector<float> gap = gaps(slit);
      float widest = 0;
      for (const float g : gap) widest = std::max(widest, g);
      if (widest < 1e-3F * es_) break;
      for (std::size_t i = 0; i < slit.vertex.size(); ++i) {
        const std::uint32_t v = slit.vertex[i];
        const auto j = std::min(static_cast<std::size_t>(slit.column[i]), gap.size() - 2);
        const float t = slit.column[i] - static_cast<float>(j), open = gap[j] + t * (gap[j + 1] - gap[j]);
        if (!(open > 0)) continue;
        const float ends =
            std::min(1.0F, 8 * std::min(slit.column[i], static_cast<float>(gap.size() - 1) - slit.column[i]) /
                               static_cast<float>(gap.size() - 1));
        const float by =
            (open + beyond * ends) * (slit.share[i] > 0 ? -slit.upper_share : slit.upper_share - 1) * slit.share[i];
        Vec way = up;
        if (slit.ball >= 0) {
          const Vec arm = lab_.at(v) - toVec(rig_.contacts.balls[static_cast<std::size_t>(slit.ball)].centre);
          const Vec tangent = up - up.dot(arm) / std::max(arm.squaredNorm(), 1e-12F) * arm;
          way = tangent / std::max(up.dot(tangent), 0.5F);
        }
        lab_.setPosition(v, lab_.at(v) + by * way, extra);
      }
    }
    lab_.evaluate(extra);
  }

  void closeWithoutFolds(const SlitContact& slit, DenseDisplacement& extra) {
    std::vector<std::uint32_t> margins;
    for (const auto* side : {&slit.upper, &slit.lower})
      for (const SlitContact::Sample& s : *side) {
        margins.push_back(s.first);
        margins.push_back(s.second);
      }
    for (int round = 0; round < 3; ++round) {
      close(slit, extra);
      lab_.unfold(extra, margins);
      const std::vector<float> gap = gaps(slit);
      if (*std::max_element(gap.begin(), gap.end()) < 0.006F * es_) return;
    }
    close(slit, extra);  // closed is what a blink must be
  }

  // --- cheeks

  // A puffed cheek is round: at least this far out along the skin's normal, from the middle of the cheek to its edge.
  // Height and width are those of ICT-FaceKit's.
  void puffCheeks(DenseDisplacement& extra) {
    const float height = 0.2F * es_, radius = 0.55F * es_;
    const std::vector<Position>& pose = lab_.evaluate(extra);
    for (const bool left : {true, false}) {
      const Vec middle = 0.45F * point(left ? "8.3" : "8.4") + 0.25F * point(left ? "5.1" : "5.2") +
                         0.3F * point(left ? "12.19" : "12.20");
      for (std::uint32_t v = 0; v < extra.size(); ++v) {
        if (rig_.association.kind[v] != AssociationKind::ray) continue;
        const float r = (lab_.rest(v) - middle).norm() / radius;
        if (r >= 1) continue;
        const Vec normal = skin_.normals.row(skin_.same_as[v]).transpose().cast<float>();
        const float wanted = height * (1 - smoothStep(r)), there = normal.dot(toVec(pose[v]) - lab_.rest(v));
        // Smoothly the larger of the two.
        const float missing = wanted - there, soft = 0.02F * es_;
        extra[v] += 0.5F * (missing + std::sqrt(missing * missing + soft * soft) - soft) * (1 - smoothStep(r)) * normal;
      }
    }
  }

  // --- tongue

  // Out between the lips: the tip farthest, the root not at all, thinner where it passes; the lips make room.
  void putTongueOut(DenseDisplacement& extra) {
    const RigidPart* tongue = nullptr;
    for (const RigidPart& part : rig_.rigid_parts)
      if (part.follows == RigidPart::Follows::jaw && part.name.find("ongue") != std::string::npos &&
          part.name.find("gum") == std::string::npos && part.name.find("eeth") == std::string::npos)
        tongue = &part;
    const SlitContact* lips = slitAt(SlitContact::Place::mouth);
    if (tongue == nullptr || lips == nullptr || tongue->vertices.size() < 8) return;
    float back = 1e30F, front = -1e30F;
    for (const std::uint32_t v : tongue->vertices) {
      back = std::min(back, forward_.dot(lab_.rest(v)));
      front = std::max(front, forward_.dot(lab_.rest(v)));
    }
    const Vec slit = 0.5F * (point("2.2") + point("2.3"));
    const float lip_front = std::max(forward_.dot(point("8.1")), forward_.dot(point("8.2")));
    const float out = lip_front + 0.3F * es_ - front, thickness = 0.07F * es_;
    if (!(front > back) || !(out > 0)) return;
    // Middle height of the tongue at each depth, so that its body can be led to the slit's height and made thin.
    constexpr int kSlices = 24;
    std::array<float, kSlices> low{}, high{};
    low.fill(1e30F);
    high.fill(-1e30F);
    const auto sliceOf = [&](std::uint32_t v) {
      return std::clamp(static_cast<int>((forward_.dot(lab_.rest(v)) - back) / (front - back) * kSlices), 0,
                        kSlices - 1);
    };
    for (const std::uint32_t v : tongue->vertices) {
      const auto s = static_cast<std::size_t>(sliceOf(v));
      low[s] = std::min(low[s], up_.dot(lab_.rest(v)));
      high[s] = std::max(high[s], up_.dot(lab_.rest(v)));
    }
    float all_low = 1e30F, all_high = -1e30F;
    for (std::size_t s = 0; s < kSlices; ++s) {
      all_low = std::min(all_low, low[s]);
      all_high = std::max(all_high, high[s]);
    }
    const float middle = 0.5F * (all_low + all_high);
    const float thin = std::min(1.0F, thickness / std::max(all_high - all_low, 1e-6F));
    for (const std::uint32_t v : tongue->vertices) {
      const float u = (forward_.dot(lab_.rest(v)) - back) / (front - back);
      const float along = std::pow(u, 1.3F), at_slit = smoothStep((u - 0.15F) / 0.45F);
      const float height = up_.dot(lab_.rest(v));
      const float wanted = up_.dot(slit) + thin * (height - middle) - 0.10F * es_ * smoothStep((u - 0.7F) / 0.3F);
      extra[v] += out * along * forward_ + at_slit * (wanted - height) * up_;
    }
    // Lips part by the tongue's thickness, over its width.
    float half_width = 0;
    const Vec side = up_.cross(forward_);
    for (const std::uint32_t v : tongue->vertices)
      half_width = std::max(half_width, std::abs(side.dot(lab_.rest(v) - slit)));
    for (std::size_t i = 0; i < lips->vertex.size(); ++i) {
      const float x = std::abs(side.dot(lab_.rest(lips->vertex[i]) - slit)) / (1.5F * half_width);
      const float room = thickness * (1.0F - smoothStep(0.7F * x));
      extra[lips->vertex[i]] += 0.6F * room * lips->share[i] * toVec(lips->up);
    }
  }

  // --- lips and teeth

  // Lips that were in front of the teeth stay there: pushed forward to where the teeth of this pose end, smoothly.
  void keepBeforeTeeth(DenseDisplacement& extra) {
    const SlitContact* lips = slitAt(SlitContact::Place::mouth);
    if (lips == nullptr) return;
    const std::vector<Position>& pose = lab_.evaluate(extra);
    const Vec side = up_.cross(forward_), origin = 0.5F * (point("2.2") + point("2.3"));
    constexpr int kCells = 48;
    const float cell = 1.6F * (point("8.3") - point("8.4")).norm() / kCells;
    const auto cellOf = [&](const Vec& p) -> std::array<int, 2> {
      return {static_cast<int>(std::floor(side.dot(p - origin) / cell)) + kCells / 2,
              static_cast<int>(std::floor(up_.dot(p - origin) / cell)) + kCells / 2};
    };
    std::vector<float> teeth(kCells * kCells, -1e30F);
    for (const RigidPart& part : rig_.rigid_parts) {
      const bool of_mouth =
          part.follows == RigidPart::Follows::jaw ||
          (part.follows == RigidPart::Follows::head &&
           (Eigen::Vector3d(part.centre[0], part.centre[1], part.centre[2]).cast<float>() - origin).norm() <
               1.2F * es_);
      if (!of_mouth || part.name.find("ongue") != std::string::npos) continue;
      for (const std::uint32_t v : part.vertices) {
        const Vec p = toVec(pose[v]);
        const auto [x, y] = cellOf(p);
        for (int dx = -1; dx <= 1; ++dx)  // vertices are no wider apart than this
          for (int dy = -1; dy <= 1; ++dy)
            if (x + dx >= 0 && x + dx < kCells && y + dy >= 0 && y + dy < kCells) {
              float& depth = teeth[static_cast<std::size_t>((y + dy) * kCells + x + dx)];
              depth = std::max(depth, forward_.dot(p));
            }
      }
    }
    std::vector<float> push(extra.size(), 0.0F);
    std::vector<std::uint32_t> touched;
    const float clearance = 0.02F * es_;
    for (const std::uint32_t v : lips->vertex) {
      const auto depthAt = [&](const Vec& p) {
        const auto [x, y] = cellOf(p);
        return x < 0 || x >= kCells || y < 0 || y >= kCells ? -1e30F : teeth[static_cast<std::size_t>(y * kCells + x)];
      };
      touched.push_back(v);
      const float teeth_at_rest = depthAt(lab_.rest(v));
      const float own = std::min(clearance, std::max(0.0F, forward_.dot(lab_.rest(v)) - teeth_at_rest));
      if (forward_.dot(lab_.rest(v)) < teeth_at_rest) continue;  // the inside of the mouth, behind the teeth
      push[v] = std::max(0.0F, depthAt(lab_.at(v)) + own - forward_.dot(lab_.at(v)));
      push[v] = std::min(push[v], 0.25F * es_);
    }
    // Spread to neighbours: never less than needed, falling off over some edges.
    for (int round = 0; round < 16; ++round) {
      std::vector<float> next = push;
      for (const std::uint32_t v : touched) {
        const std::uint32_t s = skin_.same_as[v];
        float sum = 0;
        int count = 0;
        for (std::uint32_t e = skin_.graph.start[s]; e < skin_.graph.start[s + 1]; ++e, ++count)
          sum += push[skin_.graph.neighbour[e]];
        if (count > 0) next[v] = std::max(0.7F * push[v] + 0.3F * sum / static_cast<float>(count), push[v] * 0.98F);
      }
      push = next;
    }
    for (const std::uint32_t v : touched) extra[v] += push[v] * forward_;
  }

  Rig& rig_;
  const Skin& skin_;
  PoseLab lab_;
  float es_;
  Vec up_, forward_;
};

}  // namespace

void makeCorrections(Rig& rig, const Skin& skin) { CorrectionMaker(rig, skin).make(); }

}  // namespace volto::rig
