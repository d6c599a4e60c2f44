#include <lazyccd/query.h>
#include <lazyccd/threads.h>
#include <nanobind/ndarray.h>

#include <cstdint>

#include "bindings.h"

namespace lazyccd::python {

namespace nb = nanobind;
using namespace nb::literals;

namespace {

using Points = nb::ndarray<const double, nb::device::cpu, nb::c_contig, nb::shape<-1, 4, 3>>;
template <class T>
using Result = nb::ndarray<T, nb::device::cpu, nb::c_contig, nb::ndim<1>>;

constexpr std::size_t kGrain = 512;  // queries that a thread takes at once

// Decides all queries of one kind and writes one element of `hit` and `toi` for each.
void decide_all(int kind, const Points& start, const Points& end, double separation, int threads,
                const Result<std::uint8_t>& hit, const Result<double>& toi) {
  const double* const from = start.data();
  const double* const to = end.data();
  std::uint8_t* const hits = hit.data();
  double* const times = toi.data();
  const std::size_t count = start.shape(0);
  const nb::gil_scoped_release released;
  Threads(threads).parallel_for(count, kGrain, [&](std::size_t first, std::size_t last) {
    for (std::size_t q = first; q < last; ++q) {
      QueryPoints points;
      for (std::size_t p = 0; p < 4; ++p)
        for (std::size_t k = 0; k < 3; ++k) {
          points[p][k] = from[12 * q + 3 * p + k];
          points[4 + p][k] = to[12 * q + 3 * p + k];
        }
      const auto contact_kind = static_cast<ContactKind>(kind);
      const QueryResult result = separation == 0 ? decide(contact_kind, points)
                                                 : decide_within(contact_kind, points, separation);
      hits[q] = result.hit;
      times[q] = result.toi;
    }
  });
}

}  // namespace

void bind_queries(nb::module_& module) {
  module.def("decide", &decide_all, "kind"_a, "start"_a, "end"_a, "separation"_a, "threads"_a,
             "hit"_a, "toi"_a);
}

}  // namespace lazyccd::python
