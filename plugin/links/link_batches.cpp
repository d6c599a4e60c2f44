#include "links/link_batches.h"

#include <algorithm>
#include <utility>

#include "lazyccd/debug/assert.h"

namespace lazyccd::bullet {
namespace {

// Finds groups that are not full, and adds groups as needed.
class OpenGroups {
 public:
  explicit OpenGroups(std::int32_t lanes) : lanes_(lanes) {}

  // Returns the first group from `group` on that is not full. `group` is at most one past the last
  // one.
  std::int32_t find(std::int32_t group) {
    std::int32_t found = group;
    while (found < count() && sizes[found] == lanes_) found = next_[found];
    while (group < found) group = std::exchange(next_[group], found);
    if (found == count()) {
      sizes.push_back(0);
      next_.push_back(count());
    }
    return found;
  }

  std::vector<std::int32_t> sizes;

 private:
  std::int32_t count() const { return static_cast<std::int32_t>(sizes.size()); }

  std::int32_t lanes_;
  std::vector<std::int32_t> next_;  // by group: a later group; all groups between the two are full
};

}  // namespace

LinkBatches plan_links(const LinkEnds& ends, std::int32_t nodes, std::int32_t lanes) {
  constexpr std::int32_t none = -1;
  LinkBatches plan;
  plan.places.reserve(ends.size());
  std::vector<std::int32_t> first(static_cast<std::size_t>(nodes), none), last = first;
  OpenGroups open_groups(lanes);
  for (const std::array<std::int32_t, 2>& link : ends) {
    if (link == no_nodes) {
      plan.places.push_back({none, none});
      continue;
    }
    const auto [a, b] = link;
    LAZYCCD_ASSERT(std::min(a, b) >= 0 && std::max(a, b) < nodes, "links end at nodes of the body");
    const std::int32_t group = open_groups.find(std::max(last[a], last[b]) + 1);
    plan.places.push_back({group, open_groups.sizes[group]++});
    for (const std::int32_t node : {a, b}) {
      if (first[node] == none) first[node] = group;
      last[node] = group;
      plan.skew = std::max(plan.skew, group - first[node] + 1);
    }
  }
  plan.sizes = std::move(open_groups.sizes);
  plan.nodes = nodes;
  for (const std::int32_t size : plan.sizes) plan.nodes += size < lanes;
  return plan;
}

template <class Scalar>
std::vector<LinkGroup<Scalar>> make_groups(const LinkBatches& plan, const LinkEnds& ends) {
  LAZYCCD_ASSERT(plan.places.size() == ends.size(), "each link has a place in the plan");
  std::vector<LinkGroup<Scalar>> groups(plan.sizes.size());
  std::int32_t dummy_node = plan.nodes;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    LinkGroup<Scalar>& group = groups[i];
    dummy_node -= plan.sizes[i] < group.links;
    for (std::int32_t lane = 0; lane < group.links; ++lane) {
      group.c0[lane] = group.c1[lane] = 1;
      group.inverse_mass[0][lane] = group.inverse_mass[1][lane] = 0;
      group.node[0][lane] = group.node[1][lane] = bytes_of_nodes<Scalar>(dummy_node);
    }
  }
  for (std::size_t i = 0; i < ends.size(); ++i) {
    const auto [group, lane] = plan.places[i];
    if (group < 0) continue;
    for (int end = 0; end < 2; ++end)
      groups[group].node[end][lane] = bytes_of_nodes<Scalar>(ends[i][end]);
  }
  return groups;
}

template std::vector<LinkGroup<float>> make_groups(const LinkBatches& plan, const LinkEnds& ends);
template std::vector<LinkGroup<double>> make_groups(const LinkBatches& plan, const LinkEnds& ends);

}  // namespace lazyccd::bullet
