// Batches of candidates of about equal size. Any worker may test a batch, no matter who found it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "cpu/verlet/verlet_list.h"
#include "host/kernels/leaf_kernels.h"

namespace lazyccd {

/// At most CandidateQueue::capacity candidates: either from a queue (`queued`) or from the Verlet
/// list (`listed` and `part`). The other pointers are null.
struct CandidateBatch {
  ContactKind kind;
  std::size_t count;
  Candidate* queued;
  const ListedCandidate* listed;
  const ListedPairs* part;  // that `listed` points into
};

/// Splits lists of candidates into batches. The lists must outlive the batches.
class CandidateBatches {
 public:
  /// Chooses the size of the batches for `total` candidates and this number of workers.
  CandidateBatches(std::size_t total, int workers)
      : batch_size_(
            std::clamp(total / (4 * static_cast<std::size_t>(workers)), min_batch, max_batch)),
        is_small_(total < 2 * min_batch) {
    batches_.reserve(total / batch_size_ + 8 * static_cast<std::size_t>(workers));
  }

  void add(ContactKind kind, Candidate* queued, std::size_t count) {
    for (std::size_t i = 0; i < count; i += batch_size_)
      batches_.push_back({kind, std::min(batch_size_, count - i), queued + i, nullptr, nullptr});
  }
  void add(ContactKind kind, std::vector<Candidate>& pairs) {
    add(kind, pairs.data(), pairs.size());
  }
  void add(ContactKind kind, const ListedPairs& part) {
    const std::vector<ListedCandidate>& list = part.of[static_cast<int>(kind)];
    for (std::size_t i = 0; i < list.size(); i += batch_size_)
      batches_.push_back(
          {kind, std::min(batch_size_, list.size() - i), nullptr, list.data() + i, &part});
  }

  std::size_t size() const { return batches_.size(); }
  const CandidateBatch& operator[](std::size_t i) const { return batches_[i]; }
  /// Number of batches that a worker takes at once. All of them if there is so little work that it
  /// is done before another thread could join.
  std::size_t grain() const { return is_small_ ? size() : 1; }

 private:
  static constexpr std::size_t min_batch = 128, max_batch = CandidateQueue::capacity / 2;

  std::size_t batch_size_;
  bool is_small_;
  std::vector<CandidateBatch> batches_;
};

}  // namespace lazyccd
