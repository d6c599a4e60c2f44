// How a step's parts spread over the detector's threads, without knowing the detector.
#pragma once

#include <cstddef>
#include <functional>

#include "lazyccd/bullet/precision.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// body(first, last) over disjoint pieces of [0, count), as Detector::parallel_for().
using ParallelFor =
    std::function<void(std::size_t count, std::size_t grain,
                       const std::function<void(std::size_t first, std::size_t last)>& body)>;

// What takes longer than to share it out, of contacts.
constexpr std::size_t contacts_grain = 512;

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
