// volto-measure-subdivision FOLDER POINTS.json [VERTICES]
//
// Self-transfer (Queiroz, Figure 20): the expressions of FOLDER/expressions/*.obj over FOLDER/neutral.obj, reproduced
// from the displacements of the mask's points alone, at several subdivisions; beside it one global multiquadric and one
// global thin-plate spline over the same points. Relative error over the first VERTICES vertices (all when left out):
// the mean over the expressions of |made - truth| / |truth|.
//
// Before that, the jump of displacement across the borders of the mask's triangles (rig/rig_health.h) against that of
// the paper's hard association, on the mesh and on one with every triangle cut in four: what a smooth field leaves on a
// coarse mesh goes with the square of its edges, a jump stays. And that of the expressions themselves, which know
// nothing of the mask: what the measure sees of the skin's own folds.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "rig/build_rig.h"
#include "rig/measure/global_splines.h"
#include "rig/mesh_io.h"
#include "rig/multiquadric.h"
#include "rig/rig_health.h"

namespace {

using namespace volto::rig;

std::string textOf(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

double secondsSince(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Examples {
  std::vector<std::string> names;
  std::vector<VertexPositions> displacements;
};

Examples readExamples(const std::filesystem::path& folder, const Mesh& neutral, Eigen::Index counted) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".obj") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  Examples out;
  for (const auto& file : files) {
    VertexPositions d = readMesh(file).positions - neutral.positions;
    if (d.topRows(counted).norm() / std::sqrt(static_cast<double>(counted)) < 1e-3) continue;  // nothing moves there
    out.names.push_back(file.stem().string());
    out.displacements.push_back(std::move(d));
  }
  return out;
}

struct Line {
  double mean = 0, worst = 0;
  std::string worst_name;
};

template <class Make>
Line measure(const Examples& examples, Eigen::Index counted, const Make& make) {
  Line line;
  for (std::size_t k = 0; k < examples.names.size(); ++k) {
    const VertexPositions& truth = examples.displacements[k];
    const double error = (make(truth).topRows(counted) - truth.topRows(counted)).norm() / truth.topRows(counted).norm();
    line.mean += error / static_cast<double>(examples.names.size());
    if (error > line.worst) {
      line.worst = error;
      line.worst_name = examples.names[k];
    }
  }
  return line;
}

// Every triangle in four; the vertices that were there keep their numbers.
Mesh finer(const Mesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  std::vector<Eigen::RowVector3d> added;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto next = static_cast<std::uint32_t>(mesh.vertexCount() + added.size());
    const auto [at, is_new] = middles.try_emplace(std::minmax(a, b), next);
    if (is_new) added.emplace_back((mesh.positions.row(a) + mesh.positions.row(b)) / 2);
    return at->second;
  };
  Mesh out;
  out.polygon_start.push_back(0);
  for (const auto& [a, b, c] : triangulate(mesh)) {
    const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    for (const std::uint32_t corner : {a, ab, ca, b, bc, ab, c, ca, bc, ab, bc, ca})
      out.corner_vertices.push_back(corner);
    for (int i = 0; i < 4; ++i) out.polygon_start.push_back(out.polygon_start.back() + 3);
  }
  out.positions.resize(mesh.positions.rows() + static_cast<Eigen::Index>(added.size()), 3);
  out.positions.topRows(mesh.positions.rows()) = mesh.positions;
  for (std::size_t i = 0; i < added.size(); ++i)
    out.positions.row(mesh.positions.rows() + static_cast<Eigen::Index>(i)) = added[i];
  return out;
}

std::vector<std::int16_t> trianglesByRay(const Rig& rig) {
  std::vector<std::int16_t> triangle = rig.association.triangle;
  for (std::size_t v = 0; v < triangle.size(); ++v)
    if (rig.association.kind[v] != AssociationKind::ray) triangle[v] = -1;
  return triangle;
}

// The mask's surface cut otherwise: by which corner of its triangle a vertex is nearest to. Half way between the
// points, where no region ends: what a field shows there it shows everywhere.
std::vector<std::int16_t> nearestPoints(const Rig& rig, const std::vector<std::int16_t>& triangle) {
  std::vector<std::int16_t> out(triangle.size(), -1);
  for (std::size_t v = 0; v < triangle.size(); ++v) {
    if (triangle[v] < 0) continue;
    double nearest = std::numeric_limits<double>::infinity();
    for (const std::uint8_t p : maskTriangles()[static_cast<std::size_t>(triangle[v])]) {
      const double distance =
          (rig.feature_positions.row(p) - rig.neutral.positions.row(static_cast<Eigen::Index>(v))).norm();
      if (distance >= nearest) continue;
      nearest = distance;
      out[v] = p;
    }
  }
  return out;
}

// Jump of displacement where neighbours belong to different triangles of the mask, over all expressions: the rig's, and
// that of the paper's hard association, where every vertex moves by its own triangle's RBF alone.
void reportSmoothness(const Rig& rig) {
  const std::vector<std::int16_t> triangle = trianglesByRay(rig);
  std::vector<Multiquadric> rbf(kMaskTriangleCount);
  const VertexPositions at = rig.feature_positions;
  for (std::size_t t = 0; t < kMaskTriangleCount; ++t)
    rbf[t] = Multiquadric(
        at, std::vector<std::uint16_t>(rig.region_of_influence[t].begin(), rig.region_of_influence[t].end()));
  std::vector<Eigen::RowVectorXd> weights(triangle.size());
  for (std::size_t v = 0; v < triangle.size(); ++v)
    if (triangle[v] >= 0)
      rbf[static_cast<std::size_t>(triangle[v])].weightsAt(
          rig.neutral.positions.row(static_cast<Eigen::Index>(v)).transpose(), weights[v]);
  const std::vector<std::int16_t> cells = nearestPoints(rig, triangle);
  double ours = 0, hard = 0, elsewhere = 0;
  int shapes = 0;
  for (const Blendshape& shape : rig.blendshapes) {
    if (!shape.moves_mask) continue;
    const auto motion = [&shape](std::size_t p) {
      const auto& d = shape.mask_displacement[p];
      return Eigen::RowVector3d(d[0], d[1], d[2]);
    };
    VertexPositions blended = VertexPositions::Zero(rig.neutral.positions.rows(), 3), own = blended;
    for (std::size_t v = 0; v < triangle.size(); ++v) {
      const auto row = static_cast<Eigen::Index>(v);
      for (std::uint32_t e = rig.deformation.row_start[v]; e < rig.deformation.row_start[v + 1]; ++e)
        blended.row(row) += rig.deformation.weight[e] * motion(rig.deformation.point[e]);
      if (triangle[v] < 0) continue;
      const auto points = rbf[static_cast<std::size_t>(triangle[v])].points();
      for (std::size_t j = 0; j < points.size(); ++j)
        own.row(row) += weights[v][static_cast<Eigen::Index>(j)] * motion(points[j]);
    }
    ours += borderJump(rig.neutral, triangle, blended).relative();
    hard += borderJump(rig.neutral, triangle, own).relative();
    elsewhere += borderJump(rig.neutral, cells, blended).relative();
    ++shapes;
  }
  std::printf(
      "%zu vertices: jump across borders relative to the displacement there: %.5f; hard association: %.5f; ratio "
      "%.1f\n",
      rig.neutral.vertexCount(), ours / shapes, hard / shapes, hard / ours);
  // Curvature over an edge and a jump add up as squares.
  const auto added = [&](double at_borders) {
    return std::sqrt(std::max(at_borders * at_borders - elsewhere * elsewhere, 0.0)) / shapes;
  };
  std::printf(
      "%zu vertices: the same where no region ends, half way between points: %.5f; borders add %.5f; hard "
      "association's "
      "%.5f; ratio %.1f\n",
      rig.neutral.vertexCount(), elsewhere / shapes, added(ours), added(hard), added(hard) / added(ours));
}

void reportOwnSmoothness(const Rig& rig, const Examples& examples) {
  const std::vector<std::int16_t> triangle = trianglesByRay(rig);
  double sum = 0;
  for (const VertexPositions& truth : examples.displacements)
    sum += borderJump(rig.neutral, triangle, truth).relative();
  std::printf("%zu vertices: the same of the expressions themselves: %.5f\n", rig.neutral.vertexCount(),
              sum / static_cast<double>(examples.displacements.size()));
}

int run(int argc, char** argv) {
  const std::filesystem::path folder = argv[1];
  const Mesh neutral = readMesh(folder / "neutral.obj");
  const FeaturePointChoices points = parseFeaturePoints(textOf(argv[2]), argv[2]);
  const auto counted = argc > 3 ? static_cast<Eigen::Index>(std::atol(argv[3])) : neutral.positions.rows();
  const Examples examples = readExamples(folder / "expressions", neutral, counted);
  std::printf("%zu expressions, %td vertices counted of %zu\n", examples.names.size(), counted, neutral.vertexCount());
  std::printf("%-16s %6s %9s %9s %-14s %8s %8s %8s\n", "subdivision", "points", "regions", "worst", "", "global",
              "thin", "rigging");
  std::printf("%-16s %6s %9s %9s %-14s %8s %8s %8s\n", "", "", "", "", "", "multiq.", "plate", "s");
  const auto start_of_rigging = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  const Rig plain = buildRig(neutral, points);
  std::printf("rigging: %.2f s, %.2f s of all processors\n", secondsSince(start_of_rigging),
              static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC);
  reportSmoothness(plain);
  reportOwnSmoothness(plain, examples);
  reportSmoothness(buildRig(finer(neutral), points));
  const VertexPositions at = neutral.positions.topRows(counted);
  const auto report = [&](const std::string& name, const Subdivision& subdivision) {
    RigOptions options;
    options.subdivision = subdivision;
    if (subdivision.budget > 0) options.examples = examples.displacements;
    const auto start = std::chrono::steady_clock::now();
    const Rig rig = buildRig(neutral, points, options);
    const double seconds = secondsSince(start);
    VertexPositions mask_points = rig.feature_positions;
    if (!rig.refined.empty()) mask_points = rig.refined.positions;
    const auto taken = [&](const VertexPositions& truth) {
      if (!rig.refined.empty()) return pointDisplacements(rig.refined, neutral.positions, truth);
      VertexPositions d(static_cast<Eigen::Index>(volto::kFeaturePointCount), 3);
      for (std::size_t p = 0; p < volto::kFeaturePointCount; ++p)
        d.row(static_cast<Eigen::Index>(p)) = truth.row(rig.feature_vertex[p]);
      return d;
    };
    const Line regions = measure(examples, counted, [&](const VertexPositions& truth) -> VertexPositions {
      const VertexPositions d = taken(truth);
      if (!rig.refined.empty()) return displaceVertices(rig.refined, d);
      VertexPositions made = VertexPositions::Zero(truth.rows(), 3);
      for (std::size_t v = 0; v < rig.deformation.vertexCount(); ++v)
        for (std::uint32_t e = rig.deformation.row_start[v]; e < rig.deformation.row_start[v + 1]; ++e)
          made.row(static_cast<Eigen::Index>(v)) += rig.deformation.weight[e] * d.row(rig.deformation.point[e]);
      return made;
    });
    // All expressions side by side, so that the dense systems are factored once.
    Eigen::MatrixXd all(mask_points.rows(), 3 * static_cast<Eigen::Index>(examples.names.size()));
    for (std::size_t k = 0; k < examples.names.size(); ++k)
      all.middleCols(3 * static_cast<Eigen::Index>(k), 3) = taken(examples.displacements[k]);
    const auto measured = [&](const Eigen::MatrixXd& made) {
      std::size_t k = 0;
      return measure(examples, counted, [&](const VertexPositions&) -> VertexPositions {
        return made.middleCols(3 * static_cast<Eigen::Index>(k++), 3);
      });
    };
    const Line multiquadric = measured(globalMultiquadric(mask_points, all, at));
    const Line plate = measured(globalThinPlate(mask_points, all, at));
    std::printf("%-16s %6td %9.4f %9.4f %-14s %8.4f %8.4f %8.2f\n", name.c_str(), mask_points.rows(), regions.mean,
                regions.worst, regions.worst_name.c_str(), multiquadric.mean, plate.mean, seconds);
    std::fflush(stdout);
    return static_cast<std::size_t>(mask_points.rows());
  };
  for (const int level : {0, 1, 2, 4}) {
    Subdivision all;
    all.levels = level;
    const std::size_t count = report("all " + std::to_string(level), all);
    if (level == 0 || level > 2) continue;
    for (const std::size_t part : {2, 4}) {
      Subdivision automatic;
      automatic.budget = (count - volto::kFeaturePointCount) / part;
      report("auto 1/" + std::to_string(part) + " of " + std::to_string(level), automatic);
    }
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 4) {
    std::fputs("usage: volto-measure-subdivision FOLDER POINTS.json [VERTICES]\n", stderr);
    return 2;
  }
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "volto-measure-subdivision: %s\n", error.what());
    return 65;
  }
}
