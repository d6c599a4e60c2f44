// A vector whose new elements are not initialized. Large arrays that threads fill at once would
// otherwise be written twice, the first time by one thread.
#pragma once

#include <boost/core/noinit_adaptor.hpp>
#include <memory>
#include <vector>

namespace lazyccd {

template <class T>
using NoinitVector = std::vector<T, boost::noinit_adaptor<std::allocator<T>>>;

}  // namespace lazyccd
