// Links solved in groups give the same result as one after the other, with every instruction set.
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "links/link_batches.h"
#include "links/link_kernels.h"
#include "plugin/support/named_kernels.h"
#include "support/catch.h"

using namespace lazyccd::bullet;

namespace {

using Random = std::mt19937;

int below(int end, Random& random) {
  return static_cast<int>(random() % static_cast<unsigned>(end));
}

// Random links: between any nodes, between nearby nodes, or all from one node.
LinkEnds random_ends(int nodes, Random& random) {
  const int count = below(5 * nodes, random), kind = below(3, random);
  LinkEnds ends;
  for (int i = 0; i < count; ++i) {
    const int a = kind == 2 ? 0 : below(nodes, random);
    ends.push_back(
        {a, kind == 1 ? std::min(a + below(4, random), nodes - 1) : below(nodes, random)});
  }
  return ends;
}

// True if all numbers have the same bits; a NaN equals any NaN.
template <class Scalar>
bool same(const std::vector<LinkedNode<Scalar>>& a, const std::vector<LinkedNode<Scalar>>& b) {
  const auto same_place = [](const LinkedNode<Scalar>& p, const LinkedNode<Scalar>& q) {
    return std::equal(p.x, p.x + 3, q.x, [](Scalar x, Scalar y) {
      return (x == y && std::signbit(x) == std::signbit(y)) || (std::isnan(x) && std::isnan(y));
    });
  };
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), same_place);
}

template <class Scalar>
struct Net {
  struct Constants {
    Scalar c0, c1;
  };
  LinkEnds ends;
  std::vector<Constants> links;
  std::vector<Scalar> inverse_mass;
  std::vector<LinkedNode<Scalar>> nodes;

  Net(int node_count, Random& random) : ends(random_ends(node_count, random)) {
    std::uniform_real_distribution<Scalar> part(0, 1);
    const bool has_extremes = below(4, random) == 0;
    const Scalar extremes[] = {std::numeric_limits<Scalar>::infinity(),
                               std::numeric_limits<Scalar>::quiet_NaN(),
                               std::numeric_limits<Scalar>::max() / 4};
    for (int i = 0; i < node_count; ++i) {
      inverse_mass.push_back(below(4, random) ? 10 * part(random) : 0);
      const bool is_where_another_is = i > 0 && below(8, random) == 0;
      nodes.push_back(is_where_another_is
                          ? nodes.back()
                          : LinkedNode<Scalar>{{part(random), part(random), part(random), 0}});
      if (has_extremes && below(8, random) == 0)
        nodes.back().x[below(3, random)] = extremes[below(3, random)];
      if (below(8, random) == 0) nodes.back().x[below(3, random)] = -Scalar(0);
    }
    const Scalar stiffness = has_extremes ? 0 : Scalar(0.7);
    for (const auto& [a, b] : ends)
      links.push_back({(inverse_mass[a] + inverse_mass[b]) / (below(4, random) ? 1 : stiffness),
                       below(4, random) ? part(random) : 0});
  }

  bool is_left_out(std::size_t link) const { return !(links[link].c0 > 0); }

  // Solves links as btSoftBody::PSolve_Links() does (Bullet 3.24).
  void solve_one_by_one() {
    for (std::size_t i = 0; i < ends.size(); ++i) {
      if (is_left_out(i)) continue;
      const auto& [c0, c1] = links[i];
      Scalar* const a = nodes[ends[i][0]].x;
      Scalar* const b = nodes[ends[i][1]].x;
      const Scalar del[3] = {b[0] - a[0], b[1] - a[1], b[2] - a[2]};
      const Scalar length = del[0] * del[0] + del[1] * del[1] + del[2] * del[2];
      if (!(c1 + length > std::numeric_limits<Scalar>::epsilon())) continue;
      const Scalar k = (c1 - length) / (c0 * (c1 + length));
      const Scalar of_a = k * inverse_mass[ends[i][0]], of_b = k * inverse_mass[ends[i][1]];
      for (int j = 0; j < 3; ++j) a[j] -= del[j] * of_a;
      for (int j = 0; j < 3; ++j) b[j] += del[j] * of_b;
    }
  }

  void solve_in_groups(const LinkKernels& kernels, int passes) {
    LinkEnds planned = ends;
    for (std::size_t i = 0; i < ends.size(); ++i)
      if (is_left_out(i)) planned[i] = no_nodes;
    const LinkBatches plan =
        plan_links(planned, static_cast<int>(nodes.size()), LinkGroup<Scalar>::links);
    std::vector<LinkGroup<Scalar>> groups = make_groups<Scalar>(plan, planned);
    for (std::size_t i = 0; i < ends.size(); ++i) {
      const auto [group, lane] = plan.places[i];
      REQUIRE((group < 0) == is_left_out(i));
      if (group < 0) continue;
      groups[group].c0[lane] = links[i].c0;
      groups[group].c1[lane] = links[i].c1;
      for (int end = 0; end < 2; ++end)
        groups[group].inverse_mass[end][lane] = inverse_mass[ends[i][end]];
    }
    nodes.resize(static_cast<std::size_t>(plan.nodes), {});
    kernels.solve({groups.data(), static_cast<int>(groups.size()), plan.skew, passes, nodes.data(),
                   bytes_of_nodes<Scalar>(static_cast<std::int32_t>(inverse_mass.size()))});
    const auto spare = nodes.begin() + static_cast<std::ptrdiff_t>(inverse_mass.size());
    for (auto node = spare; node != nodes.end(); ++node)
      for (const Scalar x : node->x) CHECK(x == 0);
    nodes.erase(spare, nodes.end());
  }
};

template <class Scalar>
void compare(const LinkKernels& kernels) {
  Random random(3);
  for (int round = 0; round < 300; ++round) {
    const Net<Scalar> net(2 + below(60, random), random);
    const int passes = below(8, random);
    CAPTURE(kernels.name, round, passes, net.ends.size());
    Net<Scalar> one_by_one = net, in_groups = net;
    for (int i = 0; i < passes; ++i) one_by_one.solve_one_by_one();
    in_groups.solve_in_groups(kernels, passes);
    REQUIRE(same(in_groups.nodes, one_by_one.nodes));
  }
}

}  // namespace

TEST_CASE("links in groups and one after the other have bit-identical results") {
  for (const char* isa : {"plain", "baseline", "avx2"}) {
    if (const LinkKernels* const kernels = named_link_kernels(isa)) {
      compare<float>(*kernels);
      compare<double>(*kernels);
    }
  }
  CHECK(link_kernels("no such set") == nullptr);
}

TEST_CASE("a plan keeps the order of links that share a node and fills groups") {
  Random random(5);
  for (int round = 0; round < 300; ++round) {
    const int nodes = 2 + below(60, random), lanes = 1 + below(8, random);
    LinkEnds ends = random_ends(nodes, random);
    for (auto& link : ends)
      if (below(8, random) == 0) link = no_nodes;
    const LinkBatches plan = plan_links(ends, nodes, lanes);
    CAPTURE(round, nodes, lanes, ends.size());
    std::vector<int> first(static_cast<std::size_t>(nodes), -1), last = first;
    std::vector<int> sizes(plan.sizes.size());
    for (std::size_t i = 0; i < ends.size(); ++i) {
      const auto [group, lane] = plan.places[i];
      if (ends[i] == no_nodes) {
        REQUIRE(group < 0);
        continue;
      }
      REQUIRE(lane == sizes[group]++);
      int earliest = 0;
      for (const int node : ends[i]) earliest = std::max(earliest, last[node] + 1);
      REQUIRE(group >= earliest);
      // All earlier groups that the link could join are full.
      for (int g = earliest; g < group; ++g) REQUIRE(sizes[g] == lanes);
      for (const int node : ends[i]) {
        if (first[node] < 0) first[node] = group;
        last[node] = group;
      }
    }
    CHECK(sizes == plan.sizes);
    int skew = 1, with_room = 0;
    for (int node = 0; node < nodes; ++node)
      if (first[node] >= 0) skew = std::max(skew, last[node] - first[node] + 1);
    for (const int size : sizes) with_room += size < lanes;
    CHECK(plan.skew == skew);
    CHECK(plan.nodes == nodes + with_room);
  }
}
