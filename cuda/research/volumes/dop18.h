// The six diagonal slabs that turn an axis-aligned box into an 18-DOP (Klosowski et al. 1998).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "research/volumes/node_volume.h"

namespace lazyccd::research {

/// Diagonal slabs of every node, over the whole step.
class DiagonalSlabs : public NodeVolume {
 public:
  explicit DiagonalSlabs(double margin) : margin_(margin) {}

  void refit(const Groups& groups, const Tree& tree, const std::vector<VertexRecord>& vertices,
             ThreadPool& pool) override;
  bool apart(std::uint32_t a, std::uint32_t b) const override;
  std::size_t bytes() const override;

 private:
  // Intervals along x + y, x - y, x + z, x - z, y + z, y - z. Two more lanes are unused; they never
  // separate two nodes.
  static constexpr int kSlabs = 6;
  struct alignas(64) Slabs {
    float lo[8], hi[8];

    void clear();
    void add(const Slabs& other);
  };

  static Slabs slabs_of(const VertexRecord& vertex, double margin);

  double margin_;
  std::vector<Slabs> vertices_;
  std::vector<Slabs> nodes_;
};

}  // namespace lazyccd::research
