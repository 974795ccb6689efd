// OBJ files that are one mesh, moved: a set of expressions. What follows the vertices is the same text in each of them,
// so it is read once; of the others nothing but the positions is.
#pragma once

#include <filesystem>
#include <mutex>
#include <string>
#include <string_view>

#include "rig/mesh.h"

namespace volto::rig {

// Calls from several threads are fine. Borrows `neutral`, which must outlive it.
class ObjSeries {
 public:
  explicit ObjSeries(const Mesh& neutral) : neutral_(neutral) {}

  // The positions of the mesh in the file, of any format that readMesh() knows; an OBJ whose text is, but for its
  // coordinates and the comments before them, that of one that was read before takes the short way. The same result and
  // the same errors as readMesh() and requireSameTopology().
  VertexPositions read(const std::filesystem::path& path);

  std::size_t shortReads() const { return short_reads_; }  // for tests; not while others read

 private:
  const Mesh& neutral_;
  std::mutex mutex_;
  std::string rest_;  // after the vertices, of a file that is this mesh; empty: none was read yet
  std::size_t short_reads_ = 0;
};

}  // namespace volto::rig
