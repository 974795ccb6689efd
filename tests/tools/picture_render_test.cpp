#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "rig/mesh_io.h"
#include "tests/support/test_data.h"
#include "tools/picture/ambient_occlusion.h"
#include "tools/picture/head_renderer.h"
#include "tools/picture/mask_overlay.h"
#include "tools/picture/shading.h"
#include "tools/picture/visibility.h"

namespace volto::picture {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

rig::Mesh meshOf(const std::vector<std::array<double, 3>>& points,
                 const std::vector<std::vector<std::uint32_t>>& polygons) {
  rig::Mesh mesh;
  mesh.positions.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t v = 0; v < points.size(); ++v) {
    for (std::size_t a = 0; a < 3; ++a)
      mesh.positions(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(a)) = points[v][a];
  }
  mesh.polygon_start.push_back(0);
  for (const auto& polygon : polygons) {
    mesh.corner_vertices.insert(mesh.corner_vertices.end(), polygon.begin(), polygon.end());
    mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
  }
  return mesh;
}

// A ball of quads, mirror symmetric in x, with a bump in front for a nose.
rig::Mesh ballWithNose() {
  constexpr std::uint32_t kAround = 48, kUp = 25;
  std::vector<std::array<double, 3>> points;
  for (std::uint32_t j = 0; j < kUp; ++j) {
    const double latitude = std::numbers::pi * (static_cast<double>(j) / (kUp - 1) - 0.5);
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const double longitude = 2.0 * std::numbers::pi * i / kAround;
      std::array<double, 3> p{std::sin(longitude) * std::cos(latitude), 1.3 * std::sin(latitude),
                              std::cos(longitude) * std::cos(latitude)};
      const double nose = 0.5 * std::exp(-20.0 * (p[0] * p[0] + p[1] * p[1])) * (p[2] > 0 ? 1.0 : 0.0);
      p[2] += nose;
      points.push_back(p);
    }
  }
  std::vector<std::vector<std::uint32_t>> polygons;
  for (std::uint32_t j = 0; j + 1 < kUp; ++j) {
    for (std::uint32_t i = 0; i < kAround; ++i) {
      const std::uint32_t next = (i + 1) % kAround;
      polygons.push_back({j * kAround + i, j * kAround + next, (j + 1) * kAround + next, (j + 1) * kAround + i});
    }
  }
  return meshOf(points, polygons);
}

std::size_t drawnPixels(const Rendered& rendered) {
  std::size_t count = 0;
  for (const float depth : rendered.depth) count += std::isfinite(depth);
  return count;
}

TEST(Visibility, KnownTriangleCoversExactlyItsSamples) {
  // Legs of 4 pixels along the axes, corner at (2, 2): the samples with (x - 2) + (y - 2) < 4, at pixel centres.
  const std::vector<Camera::Point> points{{2, 2, 1}, {6, 2, 1}, {2, 6, 1}};
  const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}};
  VisibilityBuffer out;
  rasterise(points, triangles, 10, 10, 1, 0.01F, out);
  for (int y = 0; y < 10; ++y) {
    for (int x = 0; x < 10; ++x) {
      const bool surely_inside =
          x >= 2 && y >= 2 && (x - 2) + (y - 2) < 3;  // the sum of both centres is one more; 3 lies on the edge
      const bool on_edge = x >= 2 && y >= 2 && (x - 2) + (y - 2) == 3;
      const bool drawn = out.triangle[static_cast<std::size_t>(y * 10 + x)] == 0;
      if (!on_edge) {
        EXPECT_EQ(drawn, surely_inside) << x << " " << y;
      }
    }
  }
}

TEST(Visibility, NeighboursLeaveNoGapAndDoNotOverlap) {
  // A fan about a point that lies on a sample, its rim outside the picture: every sample belongs to exactly one
  // triangle.
  std::vector<Camera::Point> points{{16.5F, 16.5F, 1}};
  std::vector<std::array<std::uint32_t, 3>> triangles;
  constexpr std::uint32_t kRim = 16;
  for (std::uint32_t i = 0; i < kRim; ++i) {
    const float angle = 2.0F * std::numbers::pi_v<float> * static_cast<float>(i) / kRim;
    points.push_back({16.5F + 60.0F * std::cos(angle), 16.5F + 60.0F * std::sin(angle), 1});
    triangles.push_back({0, 1 + i, 1 + (i + 1) % kRim});
  }
  std::vector<int> times(32 * 32, 0);
  VisibilityBuffer out;
  for (const auto& triangle : triangles) {
    rasterise(points, std::vector{triangle}, 32, 32, 1, 0.01F, out);
    for (std::size_t i = 0; i < times.size(); ++i) times[i] += out.triangle[i] != kNoTriangle;
  }
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_EQ(times[i], 1) << i % 32 << " " << i / 32;
}

TEST(Visibility, NearerSurfaceHidesFartherInEitherOrder) {
  const std::vector<Camera::Point> points{{0, 0, 5}, {20, 0, 5}, {0, 20, 5}, {0, 0, 2}, {20, 0, 2}, {0, 20, 2}};
  const std::array<std::uint32_t, 3> far{0, 1, 2}, near{3, 4, 5};
  VisibilityBuffer out;
  rasterise(points, std::vector{far, near}, 8, 8, 1, 0.01F, out);
  EXPECT_EQ(out.triangle[9], 1U);
  EXPECT_FLOAT_EQ(out.inverse_depth[9], 0.5F);
  rasterise(points, std::vector{near, far}, 8, 8, 1, 0.01F, out);
  EXPECT_EQ(out.triangle[9], 0U);
}

TEST(Visibility, InterpenetratingTrianglesAreCutAtTheirCommonLine) {
  // Depth rises to the right in one and to the left in the other; 1 / depth is equal in the middle.
  const std::vector<Camera::Point> points{{0, 0, 1}, {16, 0, 2}, {0, 64, 1}, {16, 64, 2},
                                          {0, 0, 2}, {16, 0, 1}, {0, 64, 2}, {16, 64, 1}};
  const std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}, {1, 3, 2}, {4, 5, 6}, {5, 7, 6}};
  VisibilityBuffer out;
  rasterise(points, triangles, 16, 16, 1, 0.01F, out);
  EXPECT_LT(out.triangle[8 * 16 + 3], 2U);
  EXPECT_GE(out.triangle[8 * 16 + 12], 2U);
}

TEST(Visibility, WhatCannotBeDrawnIsLeftOutQuietly) {
  const std::vector<Camera::Point> points{
      {1, 1, 1},     {5, 1, 1},   {1, 5, 1},      {9, 1, 1},
      {kNan, 1, 1},  {5, 5, -1},  {5, 5, 0.001F}, {5, 5, std::numeric_limits<float>::infinity()},
      {1e30F, 2, 1}, {5, 5, kNan}};
  std::vector<std::array<std::uint32_t, 3>> triangles{{0, 0, 1}, {0, 1, 3}, {1, 1, 1}};  // no area
  for (std::uint32_t bad = 4; bad < points.size(); ++bad) triangles.push_back({0, 1, bad});
  VisibilityBuffer out;
  rasterise(points, triangles, 12, 12, 2, 0.01F, out);
  for (const std::uint32_t triangle : out.triangle) EXPECT_EQ(triangle, kNoTriangle);
}

TEST(Camera, YawTurnsTheHeadToTheSubjectsLeftAndPitchUp) {
  const std::vector<Vec3> cube{{-1, -1, -1}, {1, 1, 1}};
  ViewOptions view = frontView(100);
  const Vec3 nose{0, 0, 1};
  // The subject's left is on the right of the picture.
  const auto straight = fitCamera(cube, view);
  EXPECT_NEAR(straight.project(nose).x_px, 50.0F, 1e-3F);
  EXPECT_GT(straight.project({1, 0, 0}).x_px, 55.0F);
  EXPECT_LT(straight.project({0, 1, 0}).y_px, 45.0F);
  view.yaw_deg = 30.0F;
  EXPECT_GT(fitCamera(cube, view).project(nose).x_px, 55.0F);
  view.yaw_deg = 0.0F;
  view.pitch_deg = 30.0F;
  EXPECT_LT(fitCamera(cube, view).project(nose).y_px, 45.0F);
}

TEST(Camera, TrackedRotationIsInTheCameraFrame) {
  const std::vector<Vec3> cube{{-1, -1, -1}, {1, 1, 1}};
  ViewOptions view = frontView(100);
  const float half = std::numbers::pi_v<float> / 12.0F;  // 30 degrees in all
  // About the camera's y axis (down): carries z (away) towards x (right), so a face that looks at the camera turns to
  // the picture's left.
  view.head_rotation = {0.0F, std::sin(half), 0.0F, std::cos(half)};
  EXPECT_LT(fitCamera(cube, view).project({0, 0, 1}).x_px, 45.0F);
  // About the camera's x axis (right): carries y (down) towards z (away); the nose, at -z, goes down... to +y.
  view.head_rotation = {std::sin(half), 0.0F, 0.0F, std::cos(half)};
  EXPECT_GT(fitCamera(cube, view).project({0, 0, 1}).y_px, 55.0F);
  view.head_rotation = {0, 0, 0, 0};
  EXPECT_THROW(fitCamera(cube, view), std::invalid_argument);
}

TEST(Camera, WholeHeadIsInThePictureFromEverySide) {
  const rig::Mesh mesh = ballWithNose();
  HeadRenderer renderer(mesh);
  for (const float yaw : {0.0F, 35.0F, -90.0F, 180.0F}) {
    for (const auto& [width, height] : {std::pair{120, 120}, {200, 90}, {90, 200}}) {
      ViewOptions view;
      view.width_px = width;
      view.height_px = height;
      view.yaw_deg = yaw;
      const Rendered rendered = renderer.render(view);
      for (int x = 0; x < width; ++x) {
        EXPECT_TRUE(std::isinf(rendered.depth[static_cast<std::size_t>(x)]));
        EXPECT_TRUE(std::isinf(rendered.depth[static_cast<std::size_t>((height - 1) * width + x)]));
      }
      EXPECT_GT(drawnPixels(rendered), static_cast<std::size_t>(std::min(width, height) * std::min(width, height) / 3));
    }
  }
}

TEST(HeadRenderer, SameInputGivesTheSameBytes) {
  const rig::Mesh mesh = ballWithNose();
  HeadRenderer first(mesh), second(mesh);
  const auto a = first.render(threeQuarterView(96)).picture.rgb;
  second.render(sideView(64));  // what was drawn before leaves no trace
  EXPECT_EQ(a, second.render(threeQuarterView(96)).picture.rgb);
}

TEST(HeadRenderer, SymmetricHeadInFrontalLightGivesASymmetricPicture) {
  HeadRenderer renderer(ballWithNose());
  ViewOptions view = frontView(128);
  view.lighting = Lighting::frontal;
  const auto difference = [&] {
    const Picture picture = renderer.render(view).picture;
    double sum = 0.0;
    for (int y = 0; y < 128; ++y) {
      for (int x = 0; x < 64; ++x) sum += std::abs(picture.at(x, y).g - picture.at(127 - x, y).g);
    }
    return sum / (64.0 * 128.0);
  };
  EXPECT_LT(difference(), 1.0);
  view.lighting = Lighting::studio;
  EXPECT_GT(difference(), 5.0) << "the studio's key light comes from the left; this test could not fail";
}

TEST(HeadRenderer, SurfaceTowardsTheKeyLightIsBrighter) {
  HeadRenderer renderer(ballWithNose());
  const Picture picture = renderer.render(frontView(128)).picture;
  EXPECT_GT(picture.at(40, 45).g, picture.at(88, 100).g + 20);
}

TEST(HeadRenderer, WindingOfPolygonsDoesNotMatter) {
  const rig::Mesh mesh = ballWithNose();
  rig::Mesh turned = mesh;
  for (std::size_t p = 0; p < turned.polygonCount(); ++p) {
    std::reverse(turned.corner_vertices.begin() + turned.polygon_start[p],
                 turned.corner_vertices.begin() + turned.polygon_start[p + 1]);
  }
  const auto a = HeadRenderer(mesh).render(frontView(96)).picture,
             b = HeadRenderer(turned).render(frontView(96)).picture;
  double sum = 0.0;
  for (std::size_t i = 0; i < a.rgb.size(); ++i) sum += std::abs(a.rgb[i] - b.rgb[i]);
  EXPECT_LT(sum / static_cast<double>(a.rgb.size()), 1.0);
}

TEST(HeadRenderer, VerticesThatAreNotFiniteTakeTheirTrianglesAlong) {
  const rig::Mesh mesh = ballWithNose();
  HeadRenderer renderer(mesh);
  const std::size_t whole = drawnPixels(renderer.render(frontView(96)));
  rig::VertexPositions positions = mesh.positions;
  positions(12 * 48 + 0, 1) = std::numeric_limits<double>::quiet_NaN();  // the tip of the nose
  positions(12 * 48 + 1, 2) = std::numeric_limits<double>::infinity();
  const Rendered damaged = renderer.render(positions, frontView(96));
  EXPECT_GT(drawnPixels(damaged), whole * 9 / 10);
  positions.setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(drawnPixels(renderer.render(positions, frontView(96))), 0U);
}

TEST(HeadRenderer, VerticesBehindTheViewerDoNotHarm) {
  const rig::Mesh mesh = ballWithNose();
  HeadRenderer renderer(mesh);
  rig::VertexPositions positions = mesh.positions;
  positions(12 * 48 + 0, 2) = 1e6;  // far behind the viewer
  positions(12 * 48 + 1, 0) = 1e30;
  EXPECT_GT(drawnPixels(renderer.render(positions, frontView(96))), 1000U);
}

TEST(HeadRenderer, MeshesThatCannotBeDrawnAreRefusedInWords) {
  const auto complaint = [](const rig::Mesh& mesh) -> std::string {
    try {
      HeadRenderer{mesh};
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(complaint(rig::Mesh{}).find("no polygons"), std::string::npos);
  EXPECT_NE(complaint(meshOf({{0, 0, 0}}, {})).find("no polygons"), std::string::npos);
  EXPECT_NE(complaint(meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 3}})).find("vertex 3, the mesh has 3"),
            std::string::npos);
  const double nan = std::nan("");
  EXPECT_NE(complaint(meshOf({{nan, 0, 0}, {nan, 0, 0}, {nan, 1, 0}}, {{0, 1, 2}})).find("finite"), std::string::npos);

  const rig::Mesh good = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}});
  HeadRenderer renderer(good);
  EXPECT_THROW(renderer.render(rig::VertexPositions(2, 3)), std::invalid_argument);
  ViewOptions view;
  view.width_px = 0;
  EXPECT_THROW(renderer.render(view), std::invalid_argument);
  view = frontView(32);
  view.samples = 5;
  EXPECT_THROW(renderer.render(view), std::invalid_argument);
  Look look = lookOf(good);
  look.polygon_surface.clear();
  EXPECT_THROW(HeadRenderer(good, look), std::invalid_argument);
}

TEST(HeadRenderer, FlatMeshAndPointSizedMeshDoNotHarm) {
  rig::Mesh flat = meshOf({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, {{0, 1, 2, 3}});
  EXPECT_GT(drawnPixels(HeadRenderer(flat).render(frontView(64))), 2000U);
  EXPECT_EQ(drawnPixels(HeadRenderer(flat).render(sideView(64))), 0U);
  rig::Mesh point = meshOf({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}}, {{0, 1, 2}});
  EXPECT_EQ(drawnPixels(HeadRenderer(point).render(frontView(64))), 0U);
}

TEST(Look, WellKnownNamesGetTheirMaterial) {
  EXPECT_EQ(surfaceByName("Eye_White_L").name, "eye_white");
  EXPECT_EQ(surfaceByName("upper_teeth").name, "teeth");
  EXPECT_EQ(surfaceByName("Eyelashes").name, "eyelashes");
  EXPECT_EQ(surfaceByName("lower lip").name, "lips");
  EXPECT_EQ(surfaceByName("Material.001").name, "skin");
  EXPECT_FALSE(surfaceByName("EyeOcclusion").drawn);
  EXPECT_LT(surfaceByName("pupil").albedo.x, surfaceByName("iris").albedo.x);
}

TEST(Look, ColourOfTheFileWinsOverTheName) {
  rig::Mesh mesh = meshOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {0, 1, 2}});
  mesh.materials.resize(2);
  mesh.materials[0] = {"skin", {0.1F, 0.2F, 0.3F}};
  mesh.materials[1].name = "iris";
  mesh.polygon_material = {0, 1};
  const Look look = lookOf(mesh);
  EXPECT_FLOAT_EQ(look.surfaces[0].albedo.y, 0.2F);
  EXPECT_FLOAT_EQ(look.surfaces[1].albedo.y, surfaceByName("iris").albedo.y);
  EXPECT_EQ(look.polygon_surface, (std::vector<std::uint16_t>{0, 1}));
}

TEST(HeadRenderer, SeamOfTextureCoordinatesIsNotSeen) {
  const rig::Mesh whole = ballWithNose();
  // The same ball with every polygon's corners for themselves.
  rig::Mesh cut = whole;
  cut.positions.resize(static_cast<Eigen::Index>(whole.corner_vertices.size()), 3);
  for (std::size_t c = 0; c < whole.corner_vertices.size(); ++c) {
    cut.positions.row(static_cast<Eigen::Index>(c)) = whole.positions.row(whole.corner_vertices[c]);
    cut.corner_vertices[c] = static_cast<std::uint32_t>(c);
  }
  Look look;
  look.surfaces = {surfaceByName("skin")};
  look.polygon_surface.assign(whole.polygonCount(), 0);
  // And once more with the corners a hair apart, so that nothing says that they belong together: facets.
  rig::Mesh facets = cut;
  for (Eigen::Index v = 0; v < facets.positions.rows(); ++v)
    facets.positions(v, 2) += 1e-6 * static_cast<double>(v % 7);
  const auto render = [&](const rig::Mesh& mesh) { return HeadRenderer(mesh, look).render(frontView(96)).picture; };
  const Picture smooth = render(whole), cut_smooth = render(cut), flat = render(facets);
  const auto difference = [&](const Picture& other) {
    std::int64_t sum = 0;
    for (std::size_t i = 0; i < smooth.rgb.size(); ++i) sum += std::abs(int{smooth.rgb[i]} - int{other.rgb[i]});
    return sum;
  };
  EXPECT_LT(4 * difference(cut_smooth), difference(flat)) << difference(cut_smooth) << ", facets " << difference(flat);
}

// A large sheet and a small ball before it; the ball's polygons come first.
rig::Mesh ballBeforeASheet() {
  rig::Mesh mesh = ballWithNose();
  for (Eigen::Index v = 0; v < mesh.positions.rows(); ++v) {
    Eigen::Vector3d p = mesh.positions.row(v).transpose();
    p.y() /= 1.3;
    mesh.positions.row(v) = p.normalized().transpose();
  }
  const auto offset = static_cast<std::uint32_t>(mesh.vertexCount());
  mesh.positions.conservativeResize(mesh.positions.rows() + 3, 3);
  mesh.positions.bottomRows(3) << -20, -20, -3, 20, -20, -3, 0, 20, -3;
  for (std::uint32_t k = 0; k < 3; ++k) mesh.corner_vertices.push_back(offset + k);
  mesh.polygon_start.push_back(static_cast<std::uint32_t>(mesh.corner_vertices.size()));
  return mesh;
}

TEST(Look, EyeballWithoutMaterialIsKnownByItsShape) {
  const rig::Mesh mesh = ballBeforeASheet();
  const auto ball_polygons = mesh.polygonCount() - 1;
  const Look look = lookOf(mesh);
  ASSERT_EQ(look.eyeballs.size(), 1U);
  EXPECT_NEAR(length(look.eyeballs[0].centre), 0.0F, 0.05F);
  EXPECT_EQ(look.surfaces[look.polygon_surface[0]].eyeball, 0);
  EXPECT_EQ(look.surfaces[look.polygon_surface[ball_polygons]].name, "skin");
}

TEST(Look, IrisIsPaintedOnlyWhereNoMaterialShowsOne) {
  rig::Mesh mesh = ballBeforeASheet();
  mesh.polygon_material.assign(mesh.polygonCount(), 0);
  mesh.polygon_material.back() = 1;
  mesh.materials = {{"eye", {0.9F, 0.9F, 0.8F}}, {"skin", {0.24F, 0.55F, 0.42F}}};
  const Look painted = lookOf(mesh);
  ASSERT_EQ(painted.eyeballs.size(), 1U);
  const Surface& eye = painted.surfaces[painted.polygon_surface[0]];
  EXPECT_EQ(eye.eyeball, 0);
  EXPECT_FLOAT_EQ(eye.albedo.z, 0.8F) << "the white is the artist's";
  EXPECT_FLOAT_EQ(painted.surfaces[painted.polygon_surface.back()].albedo.y, 0.55F);
  mesh.materials.push_back({"iris", {0.7F, 0.4F, 0.1F}});
  EXPECT_TRUE(lookOf(mesh).eyeballs.empty());
}

TEST(Look, VertexColoursAreShown) {
  rig::Mesh mesh = ballBeforeASheet();
  mesh.vertex_colours.assign(mesh.vertexCount(), {1.0F, 1.0F, 1.0F});
  EXPECT_FALSE(hasOwnLook(mesh)) << "white for all is what programs write that know no colours";
  mesh.vertex_colours[0] = {0.5F, 0.25F, 0.125F};
  ASSERT_TRUE(hasOwnLook(mesh));
  const Look look = lookOf(mesh);
  EXPECT_FLOAT_EQ(look.surfaces[0].albedo.y, 1.0F);
  EXPECT_FLOAT_EQ(look.vertex_tint[0].y, 0.25F);
  EXPECT_TRUE(look.eyeballs.empty()) << "the colours show the iris, if any";
}

TEST(Look, MaterialsThatSayNothingCountAsNone) {
  rig::Mesh mesh = ballBeforeASheet();
  mesh.polygon_material.assign(mesh.polygonCount(), 0);
  mesh.materials.resize(1);
  mesh.materials[0].name = "Material.001";
  EXPECT_FALSE(hasOwnLook(mesh));
  EXPECT_EQ(lookOf(mesh).eyeballs.size(), 1U) << "told by its shape";
  mesh.materials[0].colour = {0.2F, 0.2F, 0.2F};
  EXPECT_TRUE(hasOwnLook(mesh));
}

TEST(Look, IrisAndPupilFaceTheAxis) {
  const Eyeball eye{{0, 0, 0}, {0, 0, 1}};
  const Vec3 white{0.7F, 0.7F, 0.7F};
  EXPECT_LT(eyeballAlbedo(eye, white, {0, 0, 1}).x, 0.02F);                  // pupil
  EXPECT_LT(eyeballAlbedo(eye, white, {0.35F, 0, 0.94F}).x, 0.4F);           // iris
  EXPECT_NEAR(eyeballAlbedo(eye, white, {0.75F, 0, 0.66F}).x, 0.7F, 0.05F);  // white
}

TEST(AmbientOcclusion, CornerIsDarkerThanAnOpenPlane) {
  // A floor that meets a wall: left half rises towards the viewer.
  OcclusionInput in;
  in.width = in.height = 64;
  in.focal_px = 64;
  in.middle_x = in.middle_y = 32;
  in.radius = 2.0F;
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const float u = (static_cast<float>(x) + 0.5F - 32.0F) / 64.0F;
      const bool wall = x < 32;  // the plane z = 10 + 20 (x / z) ... seen at 45 degrees
      in.depth.push_back(wall ? 10.0F / (1.0F - 1.5F * u) : 10.0F);
      in.normal.push_back(wall ? normalised({1.5F, 0, 1}) : Vec3{0, 0, 1});
    }
  }
  std::vector<float> open;
  ambientOcclusion(in, open);
  const float at_corner = open[32 * 64 + 33], in_the_open = open[32 * 64 + 60];
  EXPECT_LT(at_corner, in_the_open - 0.1F);
  EXPECT_GT(in_the_open, 0.97F);
}

TEST(MaskOverlay, PointInFrontIsDrawnInFullAndOneBehindTheHeadFaintly) {
  HeadRenderer renderer(ballWithNose());
  Rendered rendered = renderer.render(frontView(128));
  const Picture before = rendered.picture;
  const OverlayStyle style;
  drawPoints(rendered, std::vector<Vec3>{{0.5F, 0.0F, 0.87F}, {-0.5F, 0.0F, -0.87F}}, style);
  const auto at = [&](Vec3 p) {
    const auto q = rendered.camera.project(p);
    return rendered.picture.at(static_cast<int>(q.x_px), static_cast<int>(q.y_px));
  };
  EXPECT_EQ(at({0.5F, 0.0F, 0.87F}), style.point);
  EXPECT_NE(at({-0.5F, 0.0F, -0.87F}), style.point);
  EXPECT_NE(before.rgb, rendered.picture.rgb);
}

TEST(HeadRenderer, PublicHeadsAreDrawnWithTheirEyes) {
  VOLTO_REQUIRE_DATA(data);
  const rig::Mesh mesh = rig::readMesh(data / "meshes/ict/neutral.obj");
  const Look look = lookOf(mesh);
  // Each eye of this head is a ball around another.
  ASSERT_GE(look.eyeballs.size(), 2U);
  std::size_t left = 0, right = 0;
  for (const Eyeball& eye : look.eyeballs) {
    EXPECT_NEAR(std::abs(eye.centre.x), 3.1F, 0.3F);  // centimetres
    (eye.centre.x > 0 ? left : right) += 1;
  }
  EXPECT_EQ(left, right);
  // Iris and pupil are seen: dark pixels where the eyes' axes meet the surface.
  HeadRenderer renderer(mesh, look);
  const Rendered rendered = renderer.render(frontView(256));
  for (const Eyeball& eye : look.eyeballs) {
    const auto pupil = rendered.camera.project(eye.centre + eye.axis * 1.2F);
    EXPECT_LT(rendered.picture.at(static_cast<int>(pupil.x_px), static_cast<int>(pupil.y_px)).r, 90);
  }
}

}  // namespace
}  // namespace volto::picture
