#include "bench/peers/method.h"

#include <memory>

#include "bench/bullet/process.h"
#include "bench/cpu_clock.h"
#include "bench/peers/lazyccd_settings.h"
#include "bench/peers/peer.h"

namespace lazyccd::peers {
namespace {

using Queries = Span<const QueryPoints>;
using Answers = Span<QueryResult>;

// Makes a method of a function that decides one query.
template <class Decide>
Method one_by_one(std::string name, std::string precision, bool gives_time, Decide decide_one) {
  return {std::move(name), std::move(precision), false, gives_time,
          [decide_one](ContactKind kind, Queries queries, Answers answers) {
            const double before = bench::thread_nanoseconds();
            for (std::size_t i = 0; i < queries.size(); ++i)
              answers[i] = decide_one(kind, queries[i]);
            return bench::thread_nanoseconds() - before;
          }};
}

// Makes the method that runs Bullet's own test in a child process.
Method bullet(bench::BulletPrecision precision, std::string name_of_precision) {
  auto process = std::make_shared<bench::BulletProcess>(precision);
  return {"Bullet", std::move(name_of_precision), true, false,
          [process](ContactKind, Queries queries, Answers answers) {
            std::vector<std::uint8_t> hits;
            const double nanoseconds = process->queries(queries, hits);
            for (std::size_t i = 0; i < queries.size(); ++i) answers[i] = {hits[i] != 0, 0};
            return nanoseconds;
          }};
}

}  // namespace

std::vector<Method> all_methods() {
  return {
      {"LazyCCD", "in lanes", false, true, decide_in_lanes},
      one_by_one("LazyCCD", "float first", true,
                 [](ContactKind kind, const QueryPoints& q) { return decide(kind, q); }),
      one_by_one("LazyCCD", "double only", true, decide_double_only),
      one_by_one("cubic, Newton-bisection", "float", true, cubic_newton<float>),
      one_by_one("cubic, Newton-bisection", "double", true, cubic_newton<double>),
      one_by_one("non-coplanar filter", "float", false, noncoplanar_filter<float>),
      one_by_one("non-coplanar filter", "double", false, noncoplanar_filter<double>),
      one_by_one("interval subdivision", "float", true, interval_subdivision<float>),
      one_by_one("interval subdivision", "double", true, interval_subdivision<double>),
      bullet(bench::BulletPrecision::single_precision, "float"),
      bullet(bench::BulletPrecision::double_precision, "double"),
  };
}

}  // namespace lazyccd::peers
