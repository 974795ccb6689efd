// volto-measure-remesh MESH POINTS.json [--list N] [--share S]
//
// The same head in three other meshes (every triangle in four; half of the vertices, or a share S; in another order):
// by how much vertices that both have move differently, % of the eye separation. Once for the operator alone and once
// for the whole pose with corrections and contacts, every blendshape at weight 1. --list: the N worst vertices.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "rig/build_rig.h"
#include "rig/mesh_io.h"
#include "rig/pose.h"
#include "tests/rig/remesh.h"

namespace volto::rig {
namespace {

using test::Remeshed;

struct Worst {
  double off = 0;
  std::string shape;
};

std::string textOf(const char* path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void compare(const char* what, const Rig& a, const Rig& b, const Remeshed& remeshed, bool whole_pose,
             std::size_t list) {
  const std::vector<Position> neutral_a = neutralPositions(a), neutral_b = neutralPositions(b);
  std::vector<Position> at_a(neutral_a.size()), at_b(neutral_b.size());
  std::vector<Worst> worst(remeshed.original.size());
  std::vector<float> weights(a.blendshapes.size());
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t k = 0; k < a.blendshapes.size(); ++k) {
    std::fill(weights.begin(), weights.end(), 0.0F);
    weights[k] = 1;
    if (whole_pose) {
      pose(a, weights, neutral_a, at_a);
      pose(b, weights, neutral_b, at_b);
    } else {
      poseByOperator(a, weights, neutral_a, at_a);
      poseByOperator(b, weights, neutral_b, at_b);
    }
    for (std::size_t v = 0; v < worst.size(); ++v) {
      if (remeshed.original[v] < 0) continue;
      const Position &p = at_a[static_cast<std::size_t>(remeshed.original[v])], &q = at_b[v];
      const double off = std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]) / a.fapu.fapu.eye_separation;
      sum += off;
      ++count;
      if (off > worst[v].off) worst[v] = {off, a.blendshapes[k].name};
    }
  }
  std::vector<std::size_t> order;
  std::size_t above[3] = {0, 0, 0};
  for (std::size_t v = 0; v < worst.size(); ++v) {
    if (remeshed.original[v] < 0) continue;
    order.push_back(v);
    if (worst[v].off > 0.01) ++above[0];
    if (worst[v].off > 0.02) ++above[1];
    if (worst[v].off > 0.05) ++above[2];
  }
  std::sort(order.begin(), order.end(), [&](std::size_t x, std::size_t y) { return worst[x].off > worst[y].off; });
  std::printf("%-10s %-9s mean %.3f worst %.2f  vertices %zu, off by more than 1 %%: %zu, 2 %%: %zu, 5 %%: %zu\n", what,
              whole_pose ? "pose" : "operator", 100 * sum / static_cast<double>(count), 100 * worst[order[0]].off,
              order.size(), above[0], above[1], above[2]);
  for (std::size_t i = 0; i < std::min(list, order.size()); ++i) {
    const std::size_t v = order[i];
    const auto o = static_cast<std::size_t>(remeshed.original[v]);
    std::size_t nearest = 0;
    for (std::size_t p = 1; p < kFeaturePointCount; ++p)
      if ((a.feature_positions.row(static_cast<Eigen::Index>(p)) -
           a.neutral.positions.row(static_cast<Eigen::Index>(o)))
              .norm() < (a.feature_positions.row(static_cast<Eigen::Index>(nearest)) -
                         a.neutral.positions.row(static_cast<Eigen::Index>(o)))
                            .norm())
        nearest = p;
    std::printf("  %6zu (%6zu) %.2f %-20s near %-5s at %.3f %.3f %.3f  kind %d %d triangle %d %d\n", o, v,
                100 * worst[v].off, worst[v].shape.c_str(), std::string(featurePoints()[nearest].id).c_str(),
                a.neutral.positions(static_cast<Eigen::Index>(o), 0),
                a.neutral.positions(static_cast<Eigen::Index>(o), 1),
                a.neutral.positions(static_cast<Eigen::Index>(o), 2), static_cast<int>(a.association.kind[o]),
                static_cast<int>(b.association.kind[v]), a.association.triangle[o], b.association.triangle[v]);
  }
}

}  // namespace
}  // namespace volto::rig

int main(int argc, char** argv) {
  using namespace volto::rig;
  try {
    if (argc < 3) {
      std::fprintf(stderr, "volto-measure-remesh MESH POINTS.json [--list N] [--share S]\n");
      return 2;
    }
    std::size_t list = 0;
    double share = 0.5;
    for (int i = 3; i + 1 < argc; i += 2) {
      if (std::string_view(argv[i]) == "--list") list = std::strtoul(argv[i + 1], nullptr, 10);
      if (std::string_view(argv[i]) == "--share") share = std::strtod(argv[i + 1], nullptr);
    }
    const Mesh mesh = readMesh(argv[1]);
    const FeaturePointChoices points = parseFeaturePoints(textOf(argv[2]), argv[2]);
    const Rig rig = buildRig(mesh, points);
    std::vector<std::uint32_t> keep;
    for (const auto& [p, choice] : points) keep.push_back(std::get<std::uint32_t>(choice));
    const auto run = [&](const char* what, const Remeshed& remeshed) {
      const Rig other = buildRig(remeshed.mesh, volto::test::pointsOn(remeshed, points));
      for (const bool whole : {false, true}) compare(what, rig, other, remeshed, whole, list);
    };
    run("finer", volto::test::subdivided(mesh));
    run("coarser", volto::test::decimated(mesh, share, keep));
    run("shuffled", volto::test::shuffled(mesh, 7));
  } catch (const std::exception& error) {
    std::fprintf(stderr, "volto-measure-remesh: %s\n", error.what());
    return 1;
  }
}
