#include "transfer/expression_transfer.h"

#include <algorithm>
#include <optional>
#include <stdexcept>

#include <Eigen/Geometry>

#include "rig/contacts.h"
#include "rig/parallel.h"
#include "rig/pose.h"
#include "rig/weld.h"
#include "transfer/added_examples.h"
#include "transfer/closing.h"
#include "transfer/correspondence.h"
#include "transfer/lining.h"
#include "transfer/mask_transfer.h"
#include "transfer/part_transfer.h"
#include "transfer/surface.h"

namespace volto::transfer {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Float3 = std::array<float, 3>;

rig::VertexPositions difference(const std::vector<Float3>& before, const std::vector<Float3>& after) {
  rig::VertexPositions moved(static_cast<Eigen::Index>(before.size()), 3);
  for (std::size_t v = 0; v < after.size(); ++v)
    for (std::size_t k = 0; k < 3; ++k)
      moved(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(k)) =
          static_cast<double>(after[v][k]) - static_cast<double>(before[v][k]);
  return moved;
}

// What resolveContacts moves, in double precision.
rig::VertexPositions outOfContact(const rig::Contacts& contacts, const std::vector<Float3>& neutral,
                                  const rig::VertexPositions& positions) {
  const std::vector<Float3> before = rig::inSinglePrecision(positions);
  std::vector<Float3> after = before;
  rig::resolveContacts(contacts, neutral, after);
  return difference(before, after);
}

std::vector<std::uint32_t> weldOf(const rig::Rig& rig) {
  // Seams of texture coordinates alone: lips and lids that touch at rest are slits.
  std::vector<rig::Slit> slits;
  for (const rig::SlitContact& contact : rig.contacts.slits) {
    rig::Slit slit;
    for (std::size_t k = 0; k < contact.upper.size(); ++k) {
      slit.upper.push_back(at(rig.neutral.positions, contact.upper[k]));
      slit.lower.push_back(at(rig.neutral.positions, contact.lower[k]));
    }
    slits.push_back(std::move(slit));
  }
  return rig::weldSeams(rig.neutral, slits);
}

}  // namespace

struct ExpressionTransfer::State {
  const rig::Rig& source;
  const rig::Rig& target;
  bool same;
  MaskTransfer mask;
  std::optional<PartTransfer> parts;  // where the meshes differ
  std::optional<Lining> lining;       // there too
  rig::Contacts contacts;             // the target's
  std::optional<DeformationTransfer> deformation;
  Eigen::Matrix3d source_from_target = Eigen::Matrix3d::Identity();
  std::vector<Float3> source_neutral, target_neutral;
  std::size_t corresponding = 0;

  State(const rig::Rig& s, const rig::Rig& t)
      : source(s),
        target(t),
        same(rig::sameTopology(s.neutral, t.neutral)),
        mask(s, t),
        source_neutral(rig::neutralPositions(s)),
        target_neutral(rig::neutralPositions(t)) {
    contacts = t.contacts;
    if (same) return;
    parts.emplace(s, t);
    guardSkin(weldOf(t));
  }

  // The source's vertices, and after them the target's as the mask has them, turned into the source's frame: what of
  // the target corresponds to nothing of the source takes its deformation from there.
  rig::VertexPositions stacked(const rig::VertexPositions& of_source, const rig::VertexPositions& by_mask) const {
    rig::VertexPositions all(of_source.rows() + by_mask.rows(), 3);
    all.topRows(of_source.rows()) = of_source;
    all.bottomRows(by_mask.rows()) = by_mask * source_from_target.transpose();
    return all;
  }

  // Every triangle of the target's skin, to be brought back when it turns over: what other shapes than its own may do.
  void guardSkin(std::span<const std::uint32_t> weld) {
    contacts.folds = {};
    const double least = 1e-9 * target.fapu.fapu.eye_separation * target.fapu.fapu.eye_separation;
    for (const Triangle& t : skinTriangles(target).triangles) {
      const Triangle welded = {weld[t[0]], weld[t[1]], weld[t[2]]};
      const Eigen::Vector3d a = target.neutral.positions.row(welded[0]), b = target.neutral.positions.row(welded[1]),
                            d = target.neutral.positions.row(welded[2]);
      const Eigen::Vector3d normal = (b - a).cross(d - a);
      if (!(normal.norm() > least)) continue;
      const Eigen::Vector3f unit = normal.normalized().cast<float>();
      contacts.folds.triangle.push_back(welded);
      contacts.folds.normal.push_back({unit.x(), unit.y(), unit.z()});
      contacts.folds.least.push_back(static_cast<float>(0.01 * normal.norm()));
    }
    contacts.folds.watched = contacts.folds.triangle.size();
    for (std::uint32_t v = 0; v < weld.size(); ++v)
      if (weld[v] != v && target_neutral[v] == target_neutral[weld[v]]) contacts.folds.copies.push_back({v, weld[v]});
  }

  // Lids along the eyeball, lips and lids on their own side. On the same mesh, what the artist let pass on the source
  // may pass on the target: an example's own lids lie on its eyeball as closely as it was made.
  void resolve(const rig::VertexPositions& example, rig::VertexPositions& result) const {
    if (contacts.empty()) return;
    // What unfolds may open again by a little.
    constexpr int kTimes = 3;
    for (int time = 0; !same && time < kTimes; ++time) {
      const std::vector<Float3> before = rig::inSinglePrecision(result);
      std::vector<Float3> closed = before;
      closeAsSource(source, source_neutral, rig::inSinglePrecision(example), target, target_neutral, closed);
      result += difference(before, closed);
      if (time + 1 < kTimes) result += outOfContact(contacts, target_neutral, result);
    }
    if (!same) return settle(result);
    rig::VertexPositions moved = outOfContact(contacts, target_neutral, result);
    if (!source.contacts.empty()) {
      const rig::VertexPositions allowed = outOfContact(source.contacts, source_neutral, example);
      const double size = target.fapu.fapu.eye_separation / source.fapu.fapu.eye_separation;
      for (Eigen::Index v = 0; v < moved.rows(); ++v) {
        const double length = moved.row(v).norm();
        if (length > 0) moved.row(v) *= std::max(0.0, 1 - size * allowed.row(v).norm() / length);
      }
    }
    result += moved;
  }

  // Out of contact for good: what unfolds pushes its neighbours, and lining that is put behind the skin may fold. A live
  // face has 24 rounds for that (rig/contacts.cpp), a transfer as many as it takes.
  void settle(rig::VertexPositions& result) const {
    constexpr int kMost = 12;
    constexpr double kStillEs = 1e-5;
    for (int time = 0; time < kMost; ++time) {
      const rig::VertexPositions before = result;
      if (lining && time + 1 < kMost) lining->keepBehind(result);
      result += outOfContact(contacts, target_neutral, result);
      if ((result - before).cwiseAbs().maxCoeff() < kStillEs * target.fapu.fapu.eye_separation) return;
    }
  }

  void prepareDeformation(int threads) {
    const auto source_triangles = rig::triangulate(source.neutral), target_triangles = rig::triangulate(target.neutral);
    Correspondence c = same ? sameTopology(target.neutral) : correspondThroughGenericHead(source, target);
    c.target_from_head = target.mesh_from_head;
    c.target_from_source = target.mesh_from_head * source.mesh_from_head.transpose();
    c.displacement_scale = mask.vertexRatios();
    source_from_target = c.target_from_source.transpose();
    std::vector<Triangle> all_triangles = source_triangles;
    rig::VertexPositions all_positions = source.neutral.positions;
    for (const SurfacePoint& p : c.source_point) corresponding += isNone(p) ? 0U : 1U;
    const std::vector<std::uint32_t> weld = weldOf(target);
    if (!same) {
      const std::vector<bool> enclosed = enclosedByCorrespondence(target.neutral, c, weld);
      c.anchor_share.assign(enclosed.size(), 1.0);
      for (std::size_t v = 0; v < enclosed.size(); ++v)
        if (enclosed[v]) c.anchor_share[v] = 0;
      std::vector<Triangle> skin;
      for (const Triangle& t : target_triangles)
        if (std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return isNone(c.source_point[v]); }))
          skin.push_back(t);
      lining.emplace(target, enclosed, std::move(skin));
      const auto offset = static_cast<std::uint32_t>(source.neutral.vertexCount());
      for (const Triangle& t : target_triangles) all_triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
      all_positions = stacked(source.neutral.positions, target.neutral.positions);
      // What the face encloses hangs between its rims like a sheet of rubber: the mask's points lie on the lips, and
      // what they would make of palate and cheeks behind tears them.
      const auto inside = [&](std::uint32_t v) { return enclosed[v]; };
      for (std::size_t t = 0; t < target_triangles.size(); ++t)
        if (c.source_triangle[t] < 0 && std::none_of(target_triangles[t].begin(), target_triangles[t].end(), inside))
          c.source_triangle[t] = static_cast<std::int32_t>(source_triangles.size() + t);
      for (std::uint32_t v = 0; v < c.source_point.size(); ++v) {
        if (!isNone(c.source_point[v])) continue;
        c.source_point[v] = {{offset + v, offset + v, offset + v}, {1, 0, 0}};
        c.displacement_scale[v].setOnes();
      }
    }
    deformation.emplace(all_positions, all_triangles, target.neutral.positions, target_triangles, weld, std::move(c),
                        slitPairs(source, target), target.fapu.fapu.eye_separation,
                        DeformationTransferOptions{.threads = threads});
  }
};

ExpressionTransfer::ExpressionTransfer(const rig::Rig& source, const rig::Rig& target,
                                       const ExpressionTransferOptions& options) {
  state_ = std::make_unique<State>(source, target);
  if (options.method == Method::deformation) state_->prepareDeformation(options.threads);
}

ExpressionTransfer::~ExpressionTransfer() = default;

std::vector<rig::VertexPositions> ExpressionTransfer::transfer(std::span<const rig::VertexPositions> examples) const {
  const State& s = *state_;
  for (const rig::VertexPositions& example : examples)
    if (example.rows() != s.source.neutral.positions.rows())
      throw std::invalid_argument("ExpressionTransfer: an example with another number of vertices than the source");
  // What is made to be added to another example is carried with it, since lips that pass each other have no meaning.
  const std::vector<std::int32_t> added =
      addedTo(s.source.contacts, s.source.fapu.fapu.eye_separation, s.source.neutral.positions, examples);
  std::vector<rig::VertexPositions> sums;
  if (std::any_of(added.begin(), added.end(), [](std::int32_t to) { return to >= 0; })) {
    sums.assign(examples.begin(), examples.end());
    for (std::size_t i = 0; i < sums.size(); ++i)
      if (added[i] >= 0)
        sums[i] = together(s.source.neutral.positions, examples[i], examples[static_cast<std::size_t>(added[i])]);
    examples = sums;
  }
  std::vector<rig::VertexPositions> results(examples.size());
  const bool by_mask = !s.deformation || !s.same;
  if (by_mask) rig::parallelFor(examples.size(), [&](std::size_t i) { results[i] = s.mask.transfer(examples[i]); });
  if (s.deformation && s.same) results = s.deformation->transfer(examples);
  if (s.deformation && !s.same) {
    std::vector<rig::VertexPositions> all(examples.size());
    rig::parallelFor(examples.size(), [&](std::size_t i) { all[i] = s.stacked(examples[i], results[i]); });
    results = s.deformation->transfer(all);
  }
  rig::parallelFor(examples.size(), [&](std::size_t i) {
    s.resolve(examples[i], results[i]);
    if (s.parts) s.parts->apply(examples[i], results[i]);
  });
  // None is added to one that is itself added to another (transfer/added_examples.h): the order does not matter.
  for (std::size_t i = 0; i < results.size(); ++i)
    if (added[i] >= 0) results[i] += s.target.neutral.positions - results[static_cast<std::size_t>(added[i])];
  return results;
}

bool ExpressionTransfer::sameMesh() const { return state_->same; }
std::size_t ExpressionTransfer::maskPoints() const { return state_->mask.targetPointCount(); }
std::size_t ExpressionTransfer::correspondingVertices() const { return state_->corresponding; }

}  // namespace volto::transfer
