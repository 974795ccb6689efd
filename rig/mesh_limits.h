// How large a mesh may be, in every format. Above this the answer is one line, before anything is allocated.
#pragma once

#include <cstddef>

namespace volto::rig {

inline constexpr std::size_t kMaxMeshFileBytes = std::size_t{256} << 20;
inline constexpr std::size_t kMaxVertices = 1'000'000;
inline constexpr std::size_t kMaxPolygons = 2'000'000;
inline constexpr std::size_t kMaxCorners = 16'000'000;
inline constexpr std::size_t kMaxPolygonCorners = 4'096;
inline constexpr std::size_t kMaxLineBytes = 65'536;
inline constexpr std::size_t kMaxMaterials = 65'536;
inline constexpr std::size_t kMaxNotes = 20;

}  // namespace volto::rig
