// The penalties of expected contacts on the speeds of their points, as a sparse matrix that several
// threads multiply.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "bodies/conjugate_residual.h"
#include "lazyccd/bullet/precision.h"
#include "util/parallel_for.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class ContactPenalties {
 public:
  /// With fewer contacts, several threads take longer than one.
  static constexpr std::size_t min_rows = 4096;

  struct Row {
    std::array<int, 4> nodes;  // index in the equation
    std::array<btScalar, 4> weights;
    int count;         // number of nodes
    btScalar penalty;  // kg
    btVector3 normal;  // unit vector

    /// Speed of the contact points along the normal, if the nodes move at x.
    btScalar speed_along(const VectorStack& x) const {
      btScalar speed = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
        speed += weights[k] * x[nodes[k]].dot(normal);
      return speed;
    }
    btVector3 penalty_impulse(const VectorStack& x) const {
      return penalty * speed_along(x) * normal;
    }
    /// Adds an impulse on the contact points to b.
    void add(const btVector3& impulse, VectorStack& b) const {
      for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
        b[nodes[k]] += weights[k] * impulse;
    }
  };

  void clear() {
    for (const int node : nodes_) place_of_node_[static_cast<std::size_t>(node)] = none;
    nodes_.clear();
    end_.clear();
    entries_.clear();
    rows_.clear();
  }
  void add(const Row& row) { rows_.push_back(row); }

  /// Adds the penalties times x to b. The result has the same bits on any number of threads: a node
  /// gets its impulses in the order of the rows.
  void multiply(const VectorStack& x, VectorStack& b, const ParallelFor& parallel_for) {
    bool is_done = false;
    impulses_.resize(rows_.size());
    for_ranges(parallel_for, rows_.size(), grain, [&](std::size_t first, std::size_t last) {
      if (first == 0 && last == rows_.size()) {  // one thread
        for (const Row& row : rows_) row.add(row.penalty_impulse(x), b);
        is_done = true;
        return;
      }
      for (std::size_t i = first; i < last; ++i) impulses_[i] = rows_[i].penalty_impulse(x);
    });
    if (is_done) return;
    if (nodes_.empty()) sort_by_node();
    for_ranges(parallel_for, nodes_.size(), grain, [&](std::size_t first, std::size_t last) {
      for (std::size_t place = first; place < last; ++place) {
        btVector3& sum = b[nodes_[place]];
        for (std::size_t i = place == 0 ? 0 : end_[place - 1]; i < end_[place]; ++i)
          sum += entries_[i].weight * impulses_[entries_[i].row];
      }
    });
  }

 private:
  static constexpr std::size_t grain = 512;  // nodes or rows in one range
  static constexpr int none = -1;
  // A node of a row.
  struct Entry {
    std::size_t row;
    btScalar weight;
  };

  // Calls visit(node, entry) for each node of each row.
  template <class Visit>
  void for_each_entry(const Visit& visit) const {
    for (std::size_t i = 0; i < rows_.size(); ++i)
      for (std::size_t k = 0; k < static_cast<std::size_t>(rows_[i].count); ++k)
        visit(rows_[i].nodes[k], Entry{i, rows_[i].weights[k]});
  }

  // A counting sort, which keeps the order of the rows.
  void sort_by_node() {
    for_each_entry([&](int node, const Entry&) { ++end_[place_of(node)]; });
    std::size_t sum = 0;
    for (std::size_t& end : end_) {
      const std::size_t count = end;
      end = sum;
      sum += count;
    }
    entries_.resize(sum);
    // end_ is where the entries of a node begin. Each entry moves it on, to their end.
    for_each_entry([&](int node, const Entry& entry) { entries_[end_[place_of(node)]++] = entry; });
  }

  // The place of a node in nodes_. Appends the node if it is new.
  std::size_t place_of(int node) {
    const auto index = static_cast<std::size_t>(node);
    if (index >= place_of_node_.size()) place_of_node_.resize(index + 1, none);
    int& place = place_of_node_[index];
    if (place == none) {
      place = static_cast<int>(nodes_.size());
      nodes_.push_back(node);
      end_.push_back(0);
    }
    return static_cast<std::size_t>(place);
  }

  std::vector<Row> rows_;
  std::vector<btVector3> impulses_;  // by row
  // Found when several threads first multiply.
  std::vector<int> nodes_;          // those of the rows
  std::vector<int> place_of_node_;  // by node: place in nodes_, or none
  std::vector<Entry> entries_;      // by place, then by row
  std::vector<std::size_t> end_;    // by place: the end of its entries
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
