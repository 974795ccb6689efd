// Transfer of a whole set of expressions: its time against a plain solver that factors for every shape, and its error
// against global interpolation over the same points. Needs the public test material.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include <Eigen/LU>
#include <Eigen/SparseCholesky>
#include <benchmark/benchmark.h>

#include "rig/build_rig.h"
#include "rig/mesh_io.h"
#include "tests/bench/report.h"
#include "tests/support/test_data.h"
#include "transfer/evaluation.h"
#include "transfer/expression_transfer.h"
#include "transfer/mask_transfer.h"
#include "transfer/mesh_set.h"

namespace volto::bench {
namespace {

constexpr std::size_t kFaceVertices = 9409;    // ICT-FaceKit: face, head and neck
constexpr std::size_t kNarrowFace = 6706;      // what is judged
using Triangle = std::array<std::uint32_t, 3>;

std::string fixed(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f", x);
  return text;
}

// The sparse system of the same size and pattern, as a textbook has it: assembled, factored and solved for one shape.
double plainUs(const rig::VertexPositions& positions, const std::vector<Triangle>& triangles) {
  return timeUs([&] {
    std::vector<Eigen::Triplet<double>> entries;
    for (const Triangle& t : triangles)
      for (int a = 0; a < 3; ++a) {
        entries.emplace_back(t[a], t[a], 1.0);
        entries.emplace_back(t[a], t[(a + 1) % 3], -0.5);
        entries.emplace_back(t[(a + 1) % 3], t[a], -0.5);
      }
    for (int v = 0; v < positions.rows(); ++v) entries.emplace_back(v, v, 0.01);
    Eigen::SparseMatrix<double> matrix(positions.rows(), positions.rows());
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    benchmark::DoNotOptimize(rig::VertexPositions(solver.solve(Eigen::MatrixXd(positions))));
  });
}

void transferTime(benchmark::State& state) {
  const auto data = test::dataDir();
  if (!data) return state.SkipWithError("no test material");
  const std::filesystem::path ict = *data / "meshes/ict";
  const rig::Mesh source = rig::readMesh(ict / "neutral.obj"), target = rig::readMesh(ict / "person_a.obj");
  transfer::MeshSet set;
  const double reading = timeUs([&] { set = transfer::readMeshSet(ict / "expressions", source); });
  std::vector<Triangle> triangles;
  for (const Triangle& t : rig::triangulate(source))
    if (std::all_of(t.begin(), t.end(), [](std::uint32_t v) { return v < kFaceVertices; })) triangles.push_back(t);
  const auto face = [](const rig::VertexPositions& p) { return rig::VertexPositions(p.topRows(kFaceVertices)); };
  transfer::Correspondence same;
  for (std::size_t t = 0; t < triangles.size(); ++t) same.source_triangle.push_back(static_cast<std::int32_t>(t));
  for (std::uint32_t v = 0; v < kFaceVertices; ++v) same.source_point.push_back({{v, v, v}, {1, 0, 0}});
  std::vector<rig::VertexPositions> examples;
  for (const auto& p : set.positions) examples.push_back(face(p));
  Samples factor, solve, plain;
  for (auto _ : state) {
    std::unique_ptr<transfer::DeformationTransfer> transfer;
    factor.add(timeUs([&] {
      transfer = std::make_unique<transfer::DeformationTransfer>(face(source.positions), triangles, face(target.positions),
                                                                 triangles, std::vector<std::uint32_t>{}, same,
                                                                 std::vector<transfer::SlitPair>{}, 6.3);
    }));
    solve.add(timeUs([&] { benchmark::DoNotOptimize(transfer->transfer(examples)); }));
    plain.add(plainUs(face(target.positions), triangles));
  }
  const auto count = static_cast<double>(examples.size());
  report("53 shapes by deformation, 9 409 vertices: factor", microseconds(factor.quantile(0.1)));
  report("  then all shapes", microseconds(solve.quantile(0.1)), {}, "together 150 ms");
  report("  per shape", microseconds(solve.quantile(0.1) / count),
         times(plain.quantile(0.1) / (solve.quantile(0.1) / count)) + " as fast as factoring for each");
  report("  reading the 53 files", microseconds(reading));
}
BENCHMARK(transferTime)->Iterations(5)->Unit(benchmark::kMillisecond);

// One interpolant over all points, of the displacement at each: multiquadric with Eck's stiffness, or the thin-plate spline
// of space (phi = r, with an affine part).
rig::VertexPositions globally(const rig::VertexPositions& points, const rig::VertexPositions& moved,
                              const rig::VertexPositions& vertices, bool thin_plate) {
  const Eigen::Index n = points.rows(), more = thin_plate ? 4 : 0;
  Eigen::VectorXd stiffness2 = Eigen::VectorXd::Zero(n);
  if (!thin_plate)
    for (Eigen::Index i = 0; i < n; ++i) {
      Eigen::VectorXd d2 = (points.rowwise() - points.row(i)).rowwise().squaredNorm();
      d2[i] = 1e300;
      stiffness2[i] = d2.minCoeff();
    }
  const auto phi = [&](const Eigen::RowVector3d& x, Eigen::Index i) {
    return std::sqrt((x - points.row(i)).squaredNorm() + stiffness2[i]);
  };
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n + more, n + more);
  for (Eigen::Index r = 0; r < n; ++r) {
    for (Eigen::Index c = 0; c < n; ++c) a(r, c) = phi(points.row(r), c);
    if (thin_plate) {
      a.row(r).tail(4) << 1, points.row(r);
      a.col(r).tail(4) = a.row(r).tail(4).transpose();
    }
  }
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(n + more, 3);
  b.topRows(n) = moved;
  const Eigen::MatrixXd w = a.fullPivLu().solve(b);
  rig::VertexPositions out(vertices.rows(), 3);
  Eigen::RowVectorXd row(n + more);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    for (Eigen::Index c = 0; c < n; ++c) row[c] = phi(vertices.row(v), c);
    if (thin_plate) row.tail(4) << 1, vertices.row(v);
    out.row(v) = vertices.row(v) + row * w;
  }
  return out;
}

// As `volto transfer` does it, per person and subdivision, over the narrow face; truth: the artist's displacements.
void transferError(benchmark::State& state) {
  const auto data = test::dataDir();
  if (!data) return state.SkipWithError("no test material");
  const std::filesystem::path ict = *data / "meshes/ict";
  std::ifstream file(test::sourceDir() / "tests/rig/ict_feature_points.json");
  std::stringstream points;
  points << file.rdbuf();
  const auto rigged = [&](const char* mesh, int levels) {
    rig::RigOptions options;
    options.subdivision.levels = levels;
    return rig::buildRig(rig::readMesh(ict / mesh), rig::parseFeaturePoints(points.str(), "ict"), options);
  };
  for (auto _ : state) {
    for (const char* person : {"neutral.obj", "person_a.obj", "person_b.obj"}) {
      for (int levels = 0; levels < 3; ++levels) {
        const rig::Rig source = rigged("neutral.obj", levels), target = rigged(person, levels);
        const transfer::MeshSet set = transfer::readMeshSet(ict / "expressions", source.neutral);
        transfer::EvaluationScope scope;
        scope.end_vertex = kNarrowFace;
        const auto errorOf = [&](const std::vector<rig::VertexPositions>& results) {
          return transfer::evaluate(target.neutral, source.neutral.positions, set.names, results, set.positions, scope)
              .mean_relative;
        };
        const transfer::ExpressionTransfer by_mask(source, target, {.method = transfer::Method::mask});
        const std::string who = std::string(person).substr(0, std::string(person).find('.'));
        const double mask = errorOf(by_mask.transfer(set.positions));
        // The same points' displacement, FAPU out and in as for the mask.
        const rig::RefinedMask driving = transfer::drivingMask(target);
        std::array<double, 2> global{};
        for (const bool thin_plate : {false, true}) {
          std::vector<rig::VertexPositions> results;
          for (const auto& example : set.positions) {
            const rig::VertexPositions moved = transfer::MaskTransfer(source, target).pointDisplacements(example);
            rig::VertexPositions all = target.neutral.positions;
            all.topRows(kNarrowFace) = globally(driving.positions, moved, target.neutral.positions.topRows(kNarrowFace), thin_plate);
            results.push_back(std::move(all));
          }
          global[thin_plate ? 1 : 0] = errorOf(results);
        }
        report("error on " + who + ", mask, " + std::to_string(driving.pointCount()) + " points", fixed(mask),
               "global multiquadric " + fixed(global[0]) + ", thin-plate spline " + fixed(global[1]));
        if (levels == 0) {
          const transfer::ExpressionTransfer by_deformation(source, target, {});
          std::vector<rig::VertexPositions> copied;
          for (const auto& example : set.positions)
            copied.push_back(target.neutral.positions + example - source.neutral.positions);
          report("error on " + who + ", deformation", fixed(errorOf(by_deformation.transfer(set.positions))),
                 "displacements copied " + fixed(errorOf(copied)) + " (they are the truth here)", "0.10");
        }
      }
    }
  }
}
BENCHMARK(transferError)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace volto::bench
