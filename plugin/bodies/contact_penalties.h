// The penalties of expected contacts on the speeds of their points, as a sparse matrix.
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
  struct Row {
    std::array<int, 4> nodes;  // index in the equation
    std::array<btScalar, 4> weights;
    int count;         // number of nodes
    btScalar penalty;  // kg
    btVector3 normal;

    btVector3 impulse(const VectorStack& x) const {
      btScalar speed = 0;
      for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k)
        speed += weights[k] * x[nodes[k]].dot(normal);
      return penalty * speed * normal;
    }
  };

  void clear() {
    rows_.clear();
    entries_.clear();
  }
  void add(const Row& row) { rows_.push_back(row); }

  /// Adds the penalties times x to b. The result has the same bits on any number of threads: a node
  /// gets its impulses in the order of the rows.
  void multiply(const VectorStack& x, VectorStack& b, const ParallelFor& parallel_for) {
    bool is_done = false;
    impulses_.resize(rows_.size());
    for_ranges(parallel_for, rows_.size(), grain, [&](std::size_t first, std::size_t last) {
      if (first == 0 && last == rows_.size()) {
        for (const Row& row : rows_) {
          const btVector3 impulse = row.impulse(x);
          for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k)
            b[row.nodes[k]] += row.weights[k] * impulse;
        }
        is_done = true;
        return;
      }
      for (std::size_t i = first; i < last; ++i) impulses_[i] = rows_[i].impulse(x);
    });
    if (is_done || rows_.empty()) return;
    if (entries_.empty()) sort_by_node();
    for_ranges(parallel_for, end_.size(), grain, [&](std::size_t first, std::size_t last) {
      for (std::size_t node = first; node < last; ++node)
        for (std::size_t i = node == 0 ? 0 : end_[node - 1]; i < end_[node]; ++i)
          b[static_cast<int>(node)] += entries_[i].weight * impulses_[entries_[i].row];
    });
  }

 private:
  // Nodes or rows in one range.
  static constexpr std::size_t grain = 512;
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
        visit(static_cast<std::size_t>(rows_[i].nodes[k]), Entry{i, rows_[i].weights[k]});
  }

  // A counting sort, which keeps the order of the rows.
  void sort_by_node() {
    end_.clear();
    std::size_t count = 0;
    for_each_entry([&](std::size_t node, const Entry&) {
      if (node + 2 > end_.size()) end_.resize(node + 2, 0);
      ++end_[node + 1];
      ++count;
    });
    for (std::size_t i = 1; i < end_.size(); ++i) end_[i] += end_[i - 1];
    entries_.resize(count);
    // end_[node] is where the entries of the node begin. Each entry moves it on, to their end.
    for_each_entry([&](std::size_t node, const Entry& entry) { entries_[end_[node]++] = entry; });
    end_.pop_back();
  }

  std::vector<Row> rows_;
  std::vector<btVector3> impulses_;  // by row
  std::vector<Entry> entries_;       // sorted by node, then by row; empty until it is needed
  std::vector<std::size_t> end_;     // by node: the end of its entries
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
