// The traversal on the device: the choice of the strategy, the buffers, and their growth.
#include "gpu/traversal/traversal.h"

#include <algorithm>
#include <string>
#include <utility>

#include "gpu/device/check.h"
#include "gpu/traversal/extension.h"
#include "host/extension.h"
#include "lazyccd/error.h"

namespace lazyccd {
namespace {

std::unique_ptr<gpu::TraversalStrategy> make_strategy(const DetectorOptions& options) {
  const AlgorithmOptions& algorithm = options.algorithm;
  const bool culls = culls_nodes(options);
  if (algorithm.strategy == Strategy::lazy_stealing && !culls)
    return gpu::make_lazy_stealing(algorithm.tuning);
  return find_extension(algorithm)->gpu->make_strategy(algorithm, culls);
}

// Returns the new size of an output that needs room for `needed` pairs: with headroom, and at least
// half more than before. An output that grows slowly should not cost a second run in every step.
std::size_t grown_size(const DeviceBuffer<NodePair>& buffer, std::uint32_t needed) {
  const std::size_t size =
      std::max(buffer.size() + buffer.size() / 2, needed + std::size_t{needed} / 4);
  return std::min<std::size_t>(size, 0xffffffffu);
}

// Enlarges a buffer and keeps its contents.
void reserve_and_keep(DeviceBuffer<NodePair>& buffer, std::size_t size, cudaStream_t stream) {
  DeviceBuffer<NodePair> larger(size);
  if (buffer.size() != 0)
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(larger.data(), buffer.data(), buffer.bytes(),
                                       cudaMemcpyDeviceToDevice, stream));
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
  buffer = std::move(larger);
}

}  // namespace

Traversal::Traversal(const DetectorOptions& options)
    : tuning_(options.algorithm.tuning),
      strategy_(make_strategy(options)),
      keep_front_(options.algorithm.front == FrontUse::on && strategy_->has_front()) {
  root_.reserve(1);
  counters_.reserve(2);
  host_counters_.reserve(1);
  *host_counters_.data() = {};
}

void Traversal::reset(std::uint32_t node_count, cudaStream_t stream) {
  node_count_ = node_count;
  has_front_ = false;
  // Cloth of 5 765 groups has 15 leaf pairs and 24 ended pairs per node.
  const std::size_t hint = tuning_.capacity_hint;
  // Large trees start with less: there, what is not needed would be much.
  const bool large = node_count > 1u << 18;
  const auto room = [&](std::size_t per_node) {
    return hint != 0 ? hint : per_node * node_count + 1024;
  };
  leaf_pairs_.reserve(room(large ? 8 : 24));
  if (keep_front_)
    for (auto& front : fronts_) front.reserve(room(large ? 12 : 32));
  LAZYCCD_CUDA_CHECK(cudaMemsetAsync(root_.data(), 0, root_.bytes(), stream));
  strategy_->reset(node_count, stream);
}

gpu::TraversalJob Traversal::job(bool from_front) {
  const auto size = [](const DeviceBuffer<NodePair>& b) {
    return static_cast<std::uint32_t>(b.size());
  };
  gpu::TraversalJob job{};
  job.node_count = node_count_;
  job.initial = root_.data();
  if (from_front) {
    job.initial = fronts_[1 - parity_].data();
    job.initial_capacity = size(fronts_[1 - parity_]);
    job.initial_counters = counters_.data() + (1 - parity_);
  }
  job.leaf_pairs = leaf_pairs_.data();
  job.leaf_pair_capacity = size(leaf_pairs_);
  if (keep_front_) {
    job.front = fronts_[parity_].data();
    job.front_capacity = size(fronts_[parity_]);
  }
  job.counters = counters_.data() + parity_;
  job.delay_ns = static_cast<std::uint32_t>(std::max(tuning_.delay_ns, 0));
  return job;
}

void Traversal::start(bool from_front, cudaStream_t stream) {
  if (from_front && !has_front_)
    throw Error(ErrorCode::invalid_argument, "the traversal has no front to start from");
  strategy_->start(job(from_front), stream);
}

void Traversal::launch(const TreeNode* nodes, const gpu::GroupView& groups,
                       const gpu::NodeCulling* culling, bool from_front, cudaStream_t stream) {
  gpu::TraversalJob job = this->job(from_front);
  job.nodes = nodes;
  job.groups = groups;
  strategy_->launch(job, culling, stream);
}

void Traversal::read_counters(cudaStream_t stream) {
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(host_counters_.data(), counters_.data() + parity_,
                                     sizeof(TraversalCounters), cudaMemcpyDeviceToHost, stream));
}

double Traversal::idle_share() const {
  const TraversalCounters& c = counters();
  return c.cycles == 0 ? 0 : static_cast<double>(c.idle_cycles) / static_cast<double>(c.cycles);
}

bool Traversal::grow(cudaStream_t stream) {
  const TraversalCounters& c = counters();
  // The two output counters have 32 bits. Neither has wrapped as long as there are fewer tests in
  // total.
  if (c.tree_tests >> 32 != 0)
    throw Error(ErrorCode::device, "a traversal of " + std::to_string(c.tree_tests) +
                                       " pairs is too large for the device");
  bool grown = false;
  if (c.leaf_pairs > leaf_pairs_.size()) {
    leaf_pairs_.reserve(grown_size(leaf_pairs_, c.leaf_pairs));
    grown = true;
  }
  if (keep_front_ && c.front_nodes > fronts_[parity_].size()) {
    const std::size_t size = grown_size(fronts_[parity_], c.front_nodes);
    fronts_[parity_].reserve(size);
    reserve_and_keep(fronts_[1 - parity_], size, stream);
    grown = true;
  }
  if (c.lost != 0) {
    strategy_->grow(c, stream);
    grown = true;
  }
  return grown;
}

void Traversal::accept() {
  if (!keep_front_) return;
  has_front_ = true;
  parity_ = 1 - parity_;
}

void Traversal::take_back(bool had_front) {
  if (!keep_front_) return;
  has_front_ = had_front;
  parity_ = 1 - parity_;
}

bool Traversal::drop_fronts() {
  if (!keep_front_) return false;
  keep_front_ = has_front_ = false;
  for (auto& front : fronts_) front.free();
  return true;
}

std::size_t Traversal::bytes() const {
  return leaf_pairs_.bytes() + fronts_[0].bytes() + fronts_[1].bytes() + root_.bytes() +
         counters_.bytes() + strategy_->bytes();
}

}  // namespace lazyccd
