#include "rig/rigid_parts.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string_view>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include "rig/closest_point.h"
#include "rig/errors.h"
#include "rig/parallel.h"

namespace volto::rig {
namespace {

double smoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

using OperatorRow = std::array<double, kFeaturePointCount>;
using Binding = PlacedParts::Binding;

std::size_t pointIndex(std::string_view id) { return featurePointIndex(id).value(); }

// Everything below is measured in the head frame, in eye separations.
struct Component {
  std::vector<std::uint32_t> vertices;
  std::string material;  // lower case
  Eigen::Vector3d low, high, centre;

  bool named(std::initializer_list<std::string_view> words) const {
    return std::any_of(words.begin(), words.end(), [this](auto word) { return material.find(word) != material.npos; });
  }
};

struct Sphere {
  Eigen::Vector3d centre;
  double radius = 0;
  double roughness = 0;  // rms distance from the sphere, in radii
  double lean = 1;       // length of the mean direction: 0 a whole sphere, 0.5 half of one, near 1 a small patch
};

std::optional<Sphere> fitSphere(const VertexPositions& at, const std::vector<std::uint32_t>& vertices) {
  if (vertices.size() < 12) return std::nullopt;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const std::uint32_t v : vertices) mean += at.row(v).transpose();
  mean /= static_cast<double>(vertices.size());
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const std::uint32_t v : vertices) {
    Eigen::Vector4d row;
    row << at.row(v).transpose() - mean, 1.0;
    normal += row * row.transpose();
    right += row * row.head<3>().squaredNorm();
  }
  normal.diagonal().array() += 1e-12;
  const Eigen::Vector4d solution = normal.ldlt().solve(right);
  Sphere s;
  s.centre = solution.head<3>() / 2 + mean;
  const double radius2 = solution[3] + solution.head<3>().squaredNorm() / 4;
  if (!(radius2 > 0) || !s.centre.allFinite()) return std::nullopt;
  s.radius = std::sqrt(radius2);
  double error2 = 0;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  for (const std::uint32_t v : vertices) {
    const Eigen::Vector3d d = at.row(v).transpose() - s.centre;
    error2 += std::pow(d.norm() - s.radius, 2);
    direction += d.normalized();
  }
  s.roughness = std::sqrt(error2 / static_cast<double>(vertices.size())) / s.radius;
  s.lean = direction.norm() / static_cast<double>(vertices.size());
  return s;
}

std::size_t firstTriangleAt(std::size_t point) {
  const auto triangles = maskTriangles();
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (std::find(triangles[t].begin(), triangles[t].end(), point) != triangles[t].end()) return t;
  return 0;
}

class PartPlacer {
 public:
  PartPlacer(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin, const HeadPlace& place,
             SkinAssociation& association, SkinRows& rows)
      : mesh_(mesh),
        skin_(skin),
        is_skin_(is_skin),
        place_(place),
        association_(association),
        rows_(rows),
        at_((mesh.positions * place.mesh_from_head) / place.eye_separation),
        points_((place.points * place.mesh_from_head) / place.eye_separation),
        skin_triangles_(skinTriangles()) {
    mouth_ = (point("2.2") + point("2.3")) / 2;
    mouth_width_ = std::max((point("8.3") - point("8.4")).norm(), 0.1);
    prepareJaw();
  }

  PlacedParts place(const std::vector<PartEdit>& edits) {
    components_ = components();
    done_.assign(components_.size(), false);
    for (const PartEdit& edit : edits) placeAsTold(edit);
    if (components_.empty()) return {};
    placeEye(RigidPart::Follows::left_eye, "left", (point("3.7") + point("3.11")) / 2);
    placeEye(RigidPart::Follows::right_eye, "right", (point("3.8") + point("3.12")) / 2);
    placeMouth();
    for (std::size_t c = 0; c < components_.size(); ++c)
      if (!done_[c]) placeOnSkin(components_[c]);
    return {std::move(parts_), std::move(bindings_)};
  }

 private:
  Eigen::Vector3d point(std::string_view id) const { return points_.row(static_cast<Eigen::Index>(pointIndex(id))); }

  std::vector<std::array<std::uint32_t, 3>> skinTriangles() const {
    std::vector<std::array<std::uint32_t, 3>> triangles;
    for (const auto& t : skin_.triangles)
      if (is_skin_[skin_.component[t[0]]]) triangles.push_back(t);
    return triangles;
  }

  std::vector<Component> components() const {
    std::vector<std::int32_t> slot(is_skin_.size(), -1);
    std::vector<Component> out;
    std::vector<bool> used(mesh_.vertexCount(), false);
    for (const std::uint32_t v : mesh_.corner_vertices) used[v] = true;
    for (std::uint32_t v = 0; v < mesh_.vertexCount(); ++v) {
      const std::uint32_t c = skin_.component[v];
      if (is_skin_[c] || !used[v]) continue;
      if (slot[c] < 0) {
        slot[c] = static_cast<std::int32_t>(out.size());
        out.emplace_back();
        out.back().low = out.back().high = at_.row(v);
        out.back().centre.setZero();
      }
      Component& part = out[static_cast<std::size_t>(slot[c])];
      part.vertices.push_back(v);
      part.low = part.low.cwiseMin(at_.row(v).transpose());
      part.high = part.high.cwiseMax(at_.row(v).transpose());
      part.centre += at_.row(v).transpose();
    }
    for (Component& part : out) part.centre /= static_cast<double>(part.vertices.size());
    if (!mesh_.polygon_material.empty())
      for (std::size_t p = mesh_.polygonCount(); p-- > 0;) {
        const std::int32_t s = slot[skin_.component[mesh_.corner_vertices[mesh_.polygon_start[p]]]];
        if (s < 0) continue;
        std::string name = mesh_.materials[mesh_.polygon_material[p]].name;
        for (char& ch : name)
          if (ch >= 'A' && ch <= 'Z') ch = static_cast<char>(ch - 'A' + 'a');
        out[static_cast<std::size_t>(s)].material = std::move(name);
      }
    return out;
  }

  std::array<double, 3> meshFrame(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d q = place_.mesh_from_head * p * place_.eye_separation;
    return {q[0], q[1], q[2]};
  }

  void setRow(std::uint32_t v, const OperatorRow& row, std::int16_t triangle) {
    association_.kind[v] = AssociationKind::rigid_part;
    for (std::size_t p = 0; p < kFeaturePointCount; ++p)
      if (row[p] != 0) row_.add(p, row[p]);
    setBuiltRow(v, triangle);
  }

  void setBuiltRow(std::uint32_t v, std::int16_t triangle) {
    if (!row_.moves()) {
      row_.clear();
      return;
    }
    association_.triangle[v] = triangle;
    rows_.set(v, row_);
  }

  // The row of a vertex that follows the skin as `binding` says.
  void bind(Binding binding, std::int16_t triangle) {
    association_.kind[binding.vertex] = AssociationKind::rigid_part;
    for (const auto& [of, weight] : binding.of)
      if (rows_.moves(of)) row_.addRow(rows_.rows, static_cast<std::size_t>(rows_.row_of_vertex[of]), weight);
    row_.dropSmall();
    setBuiltRow(binding.vertex, triangle);
    bindings_.push_back(std::move(binding));
  }

  void addPart(const std::string& name, RigidPart::Follows follows, const Component& part,
               const Eigen::Vector3d& centre) {
    RigidPart out;
    out.name = part.material.empty() ? name : part.material;
    out.follows = follows;
    out.vertices = part.vertices;
    out.centre = meshFrame(centre);
    for (const std::uint32_t v : part.vertices) association_.kind[v] = AssociationKind::rigid_part;
    parts_.push_back(std::move(out));
  }

  // --- what a person said

  void placeAsTold(const PartEdit& edit) {
    const std::string vertex = "part at vertex " + std::to_string(edit.vertex);
    if (edit.vertex >= mesh_.vertexCount()) throw InputError(vertex + ": the mesh has " + std::to_string(mesh_.vertexCount()));
    if (is_skin_[skin_.component[edit.vertex]]) throw InputError(vertex + " is the skin itself, no separate part");
    for (std::size_t c = 0; c < components_.size(); ++c) {
      const Component& part = components_[c];
      if (!std::binary_search(part.vertices.begin(), part.vertices.end(), edit.vertex)) continue;
      if (done_[c]) throw InputError(vertex + " is in a part that was told what to follow already");
      done_[c] = true;
      const std::size_t before = parts_.size();
      if (edit.follows == RigidPartFollows::skin) {
        placeOnSkin(part);
      } else {
        const bool eye = edit.follows == RigidPartFollows::left_eye || edit.follows == RigidPartFollows::right_eye;
        const auto ball = eye ? fitSphere(at_, part.vertices) : std::nullopt;
        addPart(edit.name, edit.follows, part, ball ? ball->centre : part.centre);
        const auto jaw_triangle = static_cast<std::int16_t>(firstTriangleAt(pointIndex("2.10")));
        if (edit.follows == RigidPartFollows::jaw)
          for (const std::uint32_t v : part.vertices) setRow(v, jawRow(at_.row(v).transpose()), jaw_triangle);
      }
      if (!edit.name.empty() && parts_.size() > before) parts_.back().name = edit.name;
      return;
    }
    throw InputError(vertex + " is in no polygon");
  }

  // --- eyes

  void placeEye(RigidPart::Follows follows, const std::string& side, const Eigen::Vector3d& eye) {
    std::optional<Sphere> ball;
    std::vector<std::optional<Sphere>> spheres(components_.size());
    for (std::size_t c = 0; c < components_.size(); ++c) {
      if (done_[c]) continue;
      const Component& part = components_[c];
      if (((part.low + part.high) / 2 - eye).norm() > 0.6 || part.named({"lash", "brow", "teeth", "tongue"})) continue;
      const auto sphere = fitSphere(at_, part.vertices);
      if (!sphere || sphere->roughness > 0.15 || sphere->radius < 0.08 || sphere->radius > 0.6) continue;
      const Eigen::Vector3d away = sphere->centre - eye;
      if (std::abs(away[0]) > 0.4 || std::abs(away[1]) > 0.3 || away[2] > 0.15) continue;
      const bool round = sphere->lean < 0.7 || (sphere->lean < 0.85 && part.named({"eye"}));
      if (!round) continue;
      spheres[c] = sphere;
      // The largest round thing is the ball; a cornea or a lens belongs to it.
      if (!ball || sphere->radius * (1 - sphere->lean) > ball->radius * (1 - ball->lean)) ball = sphere;
    }
    if (!ball) return;
    for (std::size_t c = 0; c < components_.size(); ++c) {
      if (done_[c]) continue;
      const Component& part = components_[c];
      bool belongs = spheres[c] && (spheres[c]->centre - ball->centre).norm() < 0.5 * ball->radius;
      if (!belongs && !part.named({"lash", "brow", "lid"})) {
        double farthest = 0;
        for (const std::uint32_t v : part.vertices)
          farthest = std::max(farthest, (at_.row(v).transpose() - ball->centre).norm());
        belongs = farthest <
                  (part.named({"iris", "pupil", "cornea", "lens", "sclera", "eyeball"}) ? 1.2 : 0.99) * ball->radius;
      }
      if (!belongs) continue;
      done_[c] = true;
      addPart(side + " eyeball", follows, part, ball->centre);
    }
  }

  // --- mouth

  bool inMouth(const Component& part) const {
    const Eigen::Vector3d d = (part.centre - mouth_) / mouth_width_;
    const bool inside = std::abs(d[0]) < 0.75 && std::abs(d[1]) < 0.8 && d[2] < 0.05 && d[2] > -1.6;
    const Eigen::Vector3d size = (part.high - part.low) / mouth_width_;
    if (!inside || size[0] > 2.0 || size[1] > 1.6 || size[2] > 2.6) return false;
    if (part.named({"teeth", "tooth", "tongue", "gum", "denture", "mouth"})) return true;
    // Behind the lips: nothing of it lies well in front of them.
    const double lips = std::max(point("8.1")[2], point("8.2")[2]);
    return part.high[2] < lips + 0.02 * mouth_width_;
  }

  // Weights that carry the affine motion which the jaw's points have in the least-squares sense. Skin follows the bone
  // under it only in part, the less the farther back: on the ICT head the chin nearly all the way, the jaw line and the
  // corner of the jaw as said here.
  struct JawPoint {
    std::string_view id;
    double trust, follows_bone;
  };
  static constexpr std::array<JawPoint, 8> kJaw = {{{"2.1", 1.0, 1.0},
                                                    {"2.10", 1.0, 1.0},
                                                    {"2.11", 1.0, 1.0},
                                                    {"2.12", 1.0, 1.0},
                                                    {"12.17", 0.7, 0.85},
                                                    {"12.18", 0.7, 0.85},
                                                    {"2.13", 0.4, 0.42},
                                                    {"2.14", 0.4, 0.42}}};

  void prepareJaw() {
    Eigen::Matrix<double, 4, 4> normal = Eigen::Matrix4d::Zero();
    Eigen::Matrix<double, 4, 8> columns;
    for (std::size_t i = 0; i < kJaw.size(); ++i) {
      Eigen::Vector4d b;
      b << 1.0, point(kJaw[i].id) - mouth_;
      normal += kJaw[i].trust * b * b.transpose();
      columns.col(static_cast<Eigen::Index>(i)) = kJaw[i].trust / kJaw[i].follows_bone * b;
    }
    normal.diagonal().tail<3>().array() += 0.01;  // points in one plane say nothing of what happens away from it
    jaw_ = normal.ldlt().solve(columns);
    for (std::size_t i = 0; i < kJaw.size(); ++i) jaw_point_[i] = pointIndex(kJaw[i].id);
  }

  OperatorRow jawRow(const Eigen::Vector3d& at) const {
    Eigen::Vector4d b;
    b << 1.0, at - mouth_;
    const Eigen::Matrix<double, 1, 8> weights = b.transpose() * jaw_;
    OperatorRow row{};
    for (std::size_t i = 0; i < kJaw.size(); ++i) row[jaw_point_[i]] = weights[static_cast<Eigen::Index>(i)];
    return row;
  }

  void placeMouth() {
    std::vector<std::size_t> inside;
    double low = mouth_[1], high = mouth_[1], left = mouth_[0], right = mouth_[0];
    for (std::size_t c = 0; c < components_.size(); ++c)
      if (!done_[c] && inMouth(components_[c])) {
        inside.push_back(c);
        low = std::min(low, components_[c].low[1]);
        high = std::max(high, components_[c].high[1]);
        left = std::min(left, components_[c].low[0]);
        right = std::max(right, components_[c].high[0]);
      }
    if (inside.empty()) return;
    // Where upper and lower teeth meet: near the slit of the lips, and near the middle of all that is in there.
    const double split = high - low > 0.35 * mouth_width_ ? 0.25 * mouth_[1] + 0.75 * (high + low) / 2 : mouth_[1];

    std::vector<std::uint32_t> upper_teeth, lower_teeth;
    std::vector<std::size_t> joined;
    const auto jaw_triangle =
        static_cast<std::int16_t>(firstTriangleAt(pointIndex("2.10")));
    for (const std::size_t c : inside) {
      const Component& part = components_[c];
      done_[c] = true;
      const Eigen::Vector3d size = part.high - part.low;
      // A tongue lies along the middle, deeper than wide and narrower than the teeth; it can reach above the lower
      // ones.
      const bool tongue = part.named({"tongue"}) ||
                          (std::abs(part.centre[0] - mouth_[0]) < 0.1 * mouth_width_ && part.vertices.size() > 30 &&
                           size[2] > std::max(1.2 * size[0], 0.5 * mouth_width_) && size[0] < 0.7 * (right - left) &&
                           part.centre[1] < split + 0.1 * mouth_width_);
      const bool both = !tongue && part.low[1] < split - 0.12 * mouth_width_ &&
                        part.high[1] > split + 0.12 * mouth_width_ && part.high[1] - part.low[1] > 0.6 * (high - low) &&
                        !part.named({"upper", "lower"});
      if (both) {
        joined.push_back(c);
        continue;
      }
      const bool lower = tongue || part.named({"lower"}) || (!part.named({"upper"}) && part.centre[1] < split);
      auto& teeth = lower ? lower_teeth : upper_teeth;
      teeth.insert(teeth.end(), part.vertices.begin(), part.vertices.end());
      addPart(tongue  ? "tongue"
              : lower ? "lower teeth"
                      : "upper teeth",
              lower ? RigidPart::Follows::jaw : RigidPart::Follows::head, part, part.centre);
      if (lower)
        for (const std::uint32_t v : part.vertices) setRow(v, jawRow(at_.row(v).transpose()), jaw_triangle);
    }
    for (const std::size_t c : joined) placeJoined(components_[c], split, upper_teeth, lower_teeth, jaw_triangle);
  }

  // Gums of both jaws in one piece: each vertex goes with the teeth it is nearer to, with a smooth passage between.
  void placeJoined(const Component& part, double split, const std::vector<std::uint32_t>& upper,
                   const std::vector<std::uint32_t>& lower, std::int16_t jaw_triangle) {
    addPart("gums and tongue", RigidPart::Follows::jaw, part, part.centre);
    const auto seeds = [&](const std::vector<std::uint32_t>& teeth) {
      std::vector<GeodesicSource> out;
      for (const std::uint32_t v : part.vertices) {
        if (!skin_.stands(v)) continue;
        const double near = 0.04 * mouth_width_;
        if (std::any_of(teeth.begin(), teeth.end(), [&](std::uint32_t t) {
              return std::abs(at_(v, 0) - at_(t, 0)) < near && (at_.row(v) - at_.row(t)).norm() < near;
            }))
          out.push_back({v, 0.0F});
      }
      return out;
    };
    const auto upper_seeds = seeds(upper), lower_seeds = seeds(lower);
    const bool by_teeth = !upper_seeds.empty() && !lower_seeds.empty();
    const auto to_upper = geodesicDistances(skin_.graph, upper_seeds).distance;
    const auto to_lower = geodesicDistances(skin_.graph, lower_seeds).distance;
    for (const std::uint32_t v : part.vertices) {
      const std::uint32_t s = skin_.same_as[v];
      double share = 0;
      if (by_teeth && to_upper[s] < kUnreached && to_lower[s] < kUnreached)
        share = smoothStep(0.5 + 1.5 * (to_upper[s] / (to_upper[s] + to_lower[s] + 1e-12) - 0.5));
      else
        share = smoothStep((split - at_(v, 1)) / (0.3 * mouth_width_) + 0.5);
      OperatorRow row = jawRow(at_.row(v).transpose());
      for (double& w : row) w *= share;
      setRow(v, row, jaw_triangle);
    }
  }

  // --- things on the skin

  struct Root {
    Eigen::Vector3d at;
    std::vector<std::pair<std::uint32_t, double>> of;
    std::int16_t triangle;
  };

  double chainDistance(std::initializer_list<std::string_view> chain, const Eigen::Vector3d& p) const {
    double best = std::numeric_limits<double>::infinity();
    for (auto a = chain.begin(), b = a + 1; b != chain.end(); ++a, ++b)
      best = std::min(best, closestPointOnTriangle(p, point(*a), point(*b), point(*b)).distance);
    return best;
  }

  // The lid that a small thing at an eye belongs to: the margin that it is clearly nearer to.
  SlitSide lidOf(const Component& part) const {
    double upper_left = 0, lower_left = 0, upper_right = 0, lower_right = 0;
    for (const std::uint32_t v : part.vertices) {
      const Eigen::Vector3d p = at_.row(v);
      upper_left += chainDistance({"3.11", "12.5", "3.1", "12.6", "3.7"}, p);
      lower_left += chainDistance({"3.11", "12.7", "3.3", "12.8", "3.7"}, p);
      upper_right += chainDistance({"3.8", "12.9", "3.2", "12.10", "3.12"}, p);
      lower_right += chainDistance({"3.8", "12.11", "3.4", "12.12", "3.12"}, p);
    }
    const bool left = std::min(upper_left, lower_left) < std::min(upper_right, lower_right);
    const double upper = (left ? upper_left : upper_right) / static_cast<double>(part.vertices.size());
    const double lower = (left ? lower_left : lower_right) / static_cast<double>(part.vertices.size());
    if (std::min(upper, lower) > 0.25 || std::max(upper, lower) < 1.25 * std::min(upper, lower)) return SlitSide::none;
    if (upper < lower) return left ? SlitSide::left_upper_lid : SlitSide::right_upper_lid;
    return left ? SlitSide::left_lower_lid : SlitSide::right_lower_lid;
  }

  void placeOnSkin(const Component& part) {
    constexpr double kReach = 0.35;
    const bool small = (part.high - part.low).norm() < 0.9;
    const SlitSide lid = small ? lidOf(part) : SlitSide::none;
    // What is no farther than that from the part: few triangles, mostly.
    const ClosestPoint surface(at_, trianglesNear(at_, skin_triangles_, part.low.array() - kReach, part.high.array() + kReach, [&](const auto& t) {
      return lid == SlitSide::none ||
             std::none_of(t.begin(), t.end(), [&](std::uint32_t v) { return opposite(association_.side[v], lid); });
    }));
    std::vector<SurfacePoint> nearest(part.vertices.size());
    double closest = kReach;
    for (std::size_t i = 0; i < part.vertices.size(); ++i) {
      nearest[i] = surface.find(at_.row(part.vertices[i]).transpose(), kReach);
      if (nearest[i].triangle >= 0) closest = std::min(closest, nearest[i].distance);
    }
    const auto cornersAt = [&](const SurfacePoint& on_skin, double share, std::int16_t& triangle) {
      const auto& corners = surface.triangle(on_skin.triangle);
      std::vector<std::pair<std::uint32_t, double>> of;
      triangle = -1;
      double most = -1;
      for (std::size_t k = 0; k < 3; ++k) {
        if (on_skin.barycentric[k] > most) {
          most = on_skin.barycentric[k];
          triangle = association_.triangle[corners[k]];
        }
        if (on_skin.barycentric[k] > 0) of.emplace_back(corners[k], share * on_skin.barycentric[k]);
      }
      return of;
    };
    if (small && closest < 0.1) return placeByRoots(part, nearest, closest, cornersAt);

    bool moves = false;
    for (std::size_t i = 0; i < part.vertices.size(); ++i) {
      if (nearest[i].triangle < 0) continue;
      const double share = 1 - smoothStep((nearest[i].distance - 0.02) / (kReach - 0.02));
      std::int16_t triangle = -1;
      auto of = cornersAt(nearest[i], share, triangle);
      bind({part.vertices[i], std::move(of)}, triangle);
      moves |= rows_.row_of_vertex[part.vertices[i]] >= 0;
    }
    addPart("part " + std::to_string(parts_.size() + 1), moves ? RigidPart::Follows::skin : RigidPart::Follows::head,
            part, part.centre);
  }

  template <class CornersAt>
  void placeByRoots(const Component& part, const std::vector<SurfacePoint>& nearest, double closest,
                    const CornersAt& cornersAt) {
    addPart("part " + std::to_string(parts_.size() + 1), RigidPart::Follows::skin, part, part.centre);
    std::vector<Root> roots;
    for (std::size_t i = 0; i < part.vertices.size(); ++i)
      if (nearest[i].triangle >= 0 && nearest[i].distance < closest + 0.015) {
        std::int16_t triangle = -1;
        auto of = cornersAt(nearest[i], 1.0, triangle);
        roots.push_back({at_.row(part.vertices[i]), std::move(of), triangle});
      }
    std::vector<Binding> bindings(part.vertices.size());
    std::vector<std::int16_t> triangles(part.vertices.size());
    parallelFor(part.vertices.size(), [&](std::size_t i) {
      const std::uint32_t v = part.vertices[i];
      std::vector<double> share(roots.size());
      double total = 0, largest = 0;
      std::int16_t& triangle = triangles[i];
      triangle = -1;
      for (std::size_t r = 0; r < roots.size(); ++r) {
        const double near = 1 / ((roots[r].at - at_.row(v).transpose()).squaredNorm() + 1e-6);
        share[r] = near * near;
        total += share[r];
        if (share[r] > largest) {
          largest = share[r];
          triangle = roots[r].triangle;
        }
      }
      Binding binding{v, {}};
      for (std::size_t r = 0; r < roots.size(); ++r) {
        if (share[r] < 1e-6 * total) continue;  // compact() would drop them, one by one
        for (const auto& [of, weight] : roots[r].of) binding.of.emplace_back(of, share[r] / total * weight);
      }
      bindings[i] = compact(std::move(binding));
    });
    for (std::size_t i = 0; i < bindings.size(); ++i) bind(std::move(bindings[i]), triangles[i]);
  }

  // One entry per vertex, without those that say next to nothing; the sum stays.
  static Binding compact(Binding binding) {
    std::sort(binding.of.begin(), binding.of.end());
    std::vector<std::pair<std::uint32_t, double>> merged;
    double before = 0, after = 0;
    for (const auto& [of, weight] : binding.of) {
      if (merged.empty() || merged.back().first != of) merged.emplace_back(of, 0.0);
      merged.back().second += weight;
      before += weight;
    }
    std::erase_if(merged, [](const auto& entry) { return entry.second < 1e-4; });
    for (const auto& [of, weight] : merged) after += weight;
    if (after > 0)
      for (auto& [of, weight] : merged) weight *= before / after;
    return {binding.vertex, std::move(merged)};
  }

  const Mesh& mesh_;
  const Skin& skin_;
  const std::vector<bool>& is_skin_;
  const HeadPlace& place_;
  SkinAssociation& association_;
  SkinRows& rows_;
  VertexPositions at_;
  FeaturePointPositions points_;
  std::vector<std::array<std::uint32_t, 3>> skin_triangles_;
  Eigen::Vector3d mouth_;
  double mouth_width_ = 1;
  Eigen::Matrix<double, 4, 8> jaw_;  // jawRow() is linear in (1, place)
  std::array<std::size_t, 8> jaw_point_{};
  std::vector<Component> components_;
  std::vector<bool> done_;
  std::vector<RigidPart> parts_;
  std::vector<Binding> bindings_;
  RowBuilder row_{kFeaturePointCount};
};

}  // namespace

PlacedParts placeParts(const Mesh& mesh, const Skin& skin, const std::vector<bool>& is_skin, const HeadPlace& place,
                       const std::vector<PartEdit>& edits, SkinAssociation& association, SkinRows& rows) {
  return PartPlacer(mesh, skin, is_skin, place, association, rows).place(edits);
}

}  // namespace volto::rig
