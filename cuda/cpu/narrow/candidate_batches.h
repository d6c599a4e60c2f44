// Candidates in even pieces for all workers, whoever found them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "cpu/narrow/leaf_kernels.h"
#include "cpu/verlet/verlet_list.h"

namespace lazyccd {

// At most CandidateQueue::capacity candidates; of the two pointers, one is null.
struct CandidateBatch {
  ContactKind kind;
  std::size_t count;
  Candidate* queued;              // or
  const ListedCandidate* listed;  // with
  const ListedPairs* part;
};

class CandidateBatches {
 public:
  // Of `total` candidates, for so many workers.
  CandidateBatches(std::size_t total, int workers)
      : size_(std::clamp(total / (4 * static_cast<std::size_t>(workers)), least, most)),
        few_(total < 2 * least) {
    pieces_.reserve(total / size_ + 8 * static_cast<std::size_t>(workers));
  }

  void add(ContactKind kind, Candidate* queued, std::size_t count) {
    for (std::size_t i = 0; i < count; i += size_)
      pieces_.push_back({kind, std::min(size_, count - i), queued + i, nullptr, nullptr});
  }
  void add(ContactKind kind, std::vector<Candidate>& pairs) {
    add(kind, pairs.data(), pairs.size());
  }
  void add(ContactKind kind, const ListedPairs& part) {
    const std::vector<ListedCandidate>& list = part.of[static_cast<int>(kind)];
    for (std::size_t i = 0; i < list.size(); i += size_)
      pieces_.push_back({kind, std::min(size_, list.size() - i), nullptr, list.data() + i, &part});
  }

  std::size_t size() const { return pieces_.size(); }
  const CandidateBatch& operator[](std::size_t i) const { return pieces_[i]; }
  // How many a worker takes at once: what is done sooner than another thread would come, all.
  std::size_t grain() const { return few_ ? size() : 1; }

 private:
  static constexpr std::size_t least = 128, most = CandidateQueue::capacity / 2;

  std::size_t size_;
  bool few_;
  std::vector<CandidateBatch> pieces_;
};

}  // namespace lazyccd
