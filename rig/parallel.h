// Independent pieces of work on all cores. What comes out does not depend on how many there are.
#pragma once

#include <cstddef>
#include <functional>

namespace volto::rig {

// Calls work(i) for every i < count, from up to eight threads; returns when all are done. Each call writes only what is
// its own. The first exception is thrown on.
void parallelFor(std::size_t count, const std::function<void(std::size_t)>& work);

}  // namespace volto::rig
