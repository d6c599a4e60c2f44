#include "bench/accuracy/generated_sets.h"

#include <string_view>

#include "support/generators.h"
#include "support/oracle.h"

namespace lazyccd::bench {

std::vector<QuerySet> generated_query_sets(int count, std::uint64_t seed) {
  std::vector<QuerySet> sets;
  for (const bool degenerate : {false, true}) {
    // Without "any_bits": arbitrary bits are not like a scene, and their exponents are so far apart
    // that the oracle takes minutes for a query.
    std::vector<const test::Generator*> generators;
    for (const test::Generator& g : test::generators())
      if (g.is_degenerate == degenerate && g.name != std::string_view("any_bits"))
        generators.push_back(&g);
    for (const auto kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      QuerySet set{degenerate ? "generated, degenerate" : "generated", kind, {}, {}, {}};
      for (int i = 0; i < count; ++i) {
        const auto& generator = *generators[std::size_t(i) % generators.size()];
        set.queries.push_back(test::generate(generator, kind, seed, std::uint64_t(i)));
        const test::Truth truth = test::find_truth(kind, set.queries.back());
        set.hit.push_back(truth.hit());
        set.toi.push_back(truth.hit() ? truth.toi() : 0);
      }
      sets.push_back(std::move(set));
    }
  }
  return sets;
}

}  // namespace lazyccd::bench
