#include "tests/rig/fitting_support.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <random>
#include <sstream>

#include <Eigen/Geometry>

#include "rig/mesh_io.h"

namespace volto::rig::test {
namespace {

Eigen::Vector3d positionOf(const Mesh& mesh, const FeaturePointChoice& choice) {
  if (const auto* vertex = std::get_if<std::uint32_t>(&choice)) return mesh.positions.row(*vertex);
  return std::get<Eigen::Vector3d>(choice);
}

}  // namespace

KnownHead KnownHead::read(const std::filesystem::path& mesh, const std::filesystem::path& points) {
  std::ostringstream text;
  text << std::ifstream(points, std::ios::binary).rdbuf();
  return {readMesh(mesh), parseFeaturePoints(text.str(), points.string())};
}

KnownHead KnownHead::placedAnyhow(unsigned seed) const {
  KnownHead out = *this;
  if (seed == 0) return out;
  std::mt19937 random(seed);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0 * 2 - 1; };
  const Eigen::Matrix3d rotation =
      Eigen::Quaterniond(uniform(), uniform(), uniform(), uniform()).normalized().toRotationMatrix();
  const double scale = std::pow(10.0, 2 * uniform());
  const Eigen::RowVector3d translation = 50 * scale * Eigen::RowVector3d(uniform(), uniform(), uniform());
  out.mesh.positions = ((mesh.positions * rotation.transpose() * scale).rowwise() + translation).eval();
  for (auto& [p, choice] : out.truth)
    if (auto* at = std::get_if<Eigen::Vector3d>(&choice)) *at = scale * (rotation * *at) + translation.transpose();
  return out;
}

KnownHead KnownHead::mirrored() const {
  KnownHead out = *this;
  out.mesh.positions.col(0) *= -1;
  return out;
}

KnownHead KnownHead::insideOut() const {
  KnownHead out = *this;
  for (std::size_t p = 0; p < mesh.polygonCount(); ++p)
    std::reverse(out.mesh.corner_vertices.begin() + mesh.polygon_start[p],
                 out.mesh.corner_vertices.begin() + mesh.polygon_start[p + 1]);
  return out;
}

Eigen::Vector3d KnownHead::at(std::string_view id) const {
  return positionOf(mesh, truth.at(featurePointIndex(id).value()));
}

double KnownHead::eyeSeparation() const { return ((at("3.7") + at("3.11") - at("3.8") - at("3.12")) / 2).norm(); }

FeaturePointChoices KnownHead::told(std::span<const std::string_view> ids) const {
  FeaturePointChoices out;
  for (const std::string_view id : ids) {
    const std::size_t p = featurePointIndex(id).value();
    out[p] = truth.at(p);
  }
  return out;
}

FitError errorOf(const FittedPoints& fitted, const KnownHead& head) {
  FitError out;
  const double eye_separation = head.eyeSeparation();
  for (std::size_t p = 0; p < kFeaturePointCount; ++p) {
    const Eigen::Vector3d is = positionOf(head.mesh, fitted.points.at(p));
    const double error = (is - positionOf(head.mesh, head.truth.at(p))).norm() / eye_separation;
    out.mean += error / kFeaturePointCount;
    if (error > out.worst) {
      out.worst = error;
      out.worst_point = featurePoints()[p].id;
    }
  }
  return out;
}

}  // namespace volto::rig::test
