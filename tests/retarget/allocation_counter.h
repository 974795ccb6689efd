// Counts every operator new of this program.
#pragma once

#include <cstddef>

namespace volto::test {

std::size_t allocationCount();

}  // namespace volto::test
