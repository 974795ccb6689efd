#include "transfer/mesh_set.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>
#include <thread>

#include "rig/mesh_io.h"
#include "rig/obj_series.h"

namespace volto::transfer {
MeshSet readMeshSet(const std::filesystem::path& folder, const rig::Mesh& neutral, int threads) {
  MeshSet set;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(folder))
    if (rig::isMeshFileName(entry.path()) && !entry.is_directory()) set.files.push_back(entry.path());
  if (set.files.empty())
    throw rig::InputError(folder.string() + ": no meshes in this folder; it must hold one mesh file per expression");
  std::sort(set.files.begin(), set.files.end());
  for (const std::filesystem::path& file : set.files) set.names.push_back(file.stem().string());
  std::vector<std::string> sorted = set.names;
  std::sort(sorted.begin(), sorted.end());
  if (const auto twice = std::adjacent_find(sorted.begin(), sorted.end()); twice != sorted.end())
    throw rig::InputError(folder.string() + ": two meshes are called \"" + *twice + "\"; rename or remove one");

  set.positions.resize(set.size());
  rig::ObjSeries series(neutral);
  std::vector<std::exception_ptr> failures(set.size());
  std::atomic<std::size_t> next{0};
  const auto work = [&] {
    for (std::size_t i = next++; i < set.size(); i = next++) {
      try {
        set.positions[i] = series.read(set.files[i]);
      } catch (...) {
        failures[i] = std::current_exception();
      }
    }
  };
  {
    const int wanted = threads > 0 ? threads : static_cast<int>(std::max(1U, std::thread::hardware_concurrency()));
    std::vector<std::jthread> helpers;
    for (int t = 1; t < wanted; ++t) helpers.emplace_back(work);
    work();
  }
  // The first in order of names, however the threads ran.
  for (const std::exception_ptr& failure : failures)
    if (failure) std::rethrow_exception(failure);
  return set;
}

std::vector<std::string> stillMeshes(const MeshSet& set, const rig::Mesh& neutral) {
  const double size = (neutral.positions.colwise().maxCoeff() - neutral.positions.colwise().minCoeff()).norm();
  std::vector<std::string> still;
  for (std::size_t i = 0; i < set.size(); ++i)
    if ((set.positions[i] - neutral.positions).rowwise().norm().maxCoeff() <= 1e-6 * size)
      still.push_back(set.names[i]);
  return still;
}

}  // namespace volto::transfer
