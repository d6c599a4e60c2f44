#include "gpu/completion.h"

#include <algorithm>

#include "gpu/narrow/undecided.h"
#include "host/backend.h"
#include "host/scene/positions.h"

namespace lazyccd::gpu {
namespace {

// Adds the counters of one part of a step's pairs to those of the parts before.
void add_part(StepCounters& sum, const StepCounters& c) {
  for (int kind = 0; kind < 2; ++kind) {
    sum.candidates[kind] += c.candidates[kind];
    sum.filtered[kind] += c.filtered[kind];
    sum.hits[kind] += c.hits[kind];
    sum.undecided_in_single[kind] += c.undecided_in_single[kind];
    sum.near[kind] += c.near[kind];
  }
  sum.double_precision_tests += c.double_precision_tests;
  sum.undecided_in_double += c.undecided_in_double;
  sum.contacts += c.contacts;
  sum.contacts_vf += c.contacts_vf;
  sum.hash += c.hash;
}

// Whether a counter of 32 bits may have wrapped, as filtered[] may.
bool has_wrapped(const StepCounters& c) { return (c.candidates[0] | c.candidates[1]) >> 32 != 0; }

}  // namespace

void Completion::run(StepInput input, bool has_run, const HostPositions& given, cudaStream_t stream,
                     Stats& stats) {
  in_parts_ = run_whole(input, has_run, given, stream, stats);
  if (!in_parts_) return;
  if (options_.separation == 0) input.exact = ExactStage::expected;
  run_in_parts(input, stream, stats);
}

// What did not fit runs again from the stage on where it did not.
bool Completion::run_whole(StepInput& input, bool has_run, const HostPositions& given,
                           cudaStream_t stream, Stats& stats) {
  enum { nothing, pairs, all } next = has_run ? nothing : all;
  for (;;) {
    if (next != nothing) step_.reserve_lists(stream);
    if (next == all) step_.run(input, stream);
    if (next == pairs) step_.run_pairs(input, {0, 0xffffffffu}, stream);
    step_.download(stream);
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
    const StepCounters& c = step_.buffers().counters();
    check_positions(c, given);
    const int grown_traversal = step_.grow_traversal(stream);
    const int grown_lists = step_.grow_lists();
    stats.overflows += grown_traversal + grown_lists;
    if (grown_traversal != 0) {
      next = all;
    } else if (has_wrapped(c) || (grown_lists != 0 && step_.lists_are_limited())) {
      return true;
    } else if (grown_lists != 0) {
      next = pairs;
    } else if (c.undecided_in_double != 0 && input.exact == ExactStage::left_out &&
               options_.separation == 0) {
      input.exact = ExactStage::expected;
      step_.run_exact(input, stream);
      next = nothing;
    } else {
      counters_ = c;
      return false;
    }
  }
}

// Takes the pairs of the traversal in parts that the lists have room for.
void Completion::run_in_parts(const StepInput& input, cudaStream_t stream, Stats& stats) {
  StepBuffers& buffers = step_.buffers();
  const std::uint32_t pairs = step_.traversal().counters().leaf_pairs;
  StepCounters sum{};
  part_contacts_.clear();
  part_queries_.clear();
  for (std::vector<Candidate>& of_kind : part_near_) of_kind.clear();
  std::uint32_t size = std::max(pairs / 2, 1u);
  stats.parts = 0;
  for (std::uint32_t first = 0; first < pairs || stats.parts == 0;) {
    const std::uint32_t last = first + std::min(size, pairs - first);
    step_.reserve_lists(stream);
    step_.run_pairs(input, {first, last}, stream);
    step_.download(stream);
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
    const StepCounters& c = buffers.counters();
    if (buffers.grow(false) != 0 || has_wrapped(c)) {
      if (last - first <= 1)
        throw OutOfDeviceMemory("the candidates of two groups do not fit into the device's memory");
      size = std::max((last - first) / 4, 1u);
      continue;
    }
    const Contact* const contacts = buffers.finish_contacts();
    part_contacts_.insert(part_contacts_.end(), contacts, contacts + c.contacts);
    if (c.too_wide != 0) {
      const HardQuery* const queries = buffers.download_too_wide();
      part_queries_.insert(part_queries_.end(), queries, queries + c.too_wide);
    }
    for (const ContactKind kind : {ContactKind::vertex_face, ContactKind::edge_edge}) {
      const Span<const Candidate> near = buffers.download_near(kind);
      std::vector<Candidate>& of_kind = part_near_[static_cast<int>(kind)];
      of_kind.insert(of_kind.end(), near.begin(), near.end());
    }
    add_part(sum, c);
    sum.leaf_area = c.leaf_area;
    ++stats.parts;
    first = last;
  }
  counters_ = sum;
  std::sort(part_contacts_.begin(), part_contacts_.end(), mesh_->contact_order());
}

void Completion::check_positions(const StepCounters& c, const HostPositions& given) {
  if (c.bad_positions == 0) return;
  if (c.bad_positions & 1) {
    const auto [start, end] = host_positions(given);
    check_finite(*mesh_, start, end);
  }
  throw NeedsCpu("positions beyond 2^100 need the CPU backend");
}

std::pair<Positions, Positions> Completion::host_positions(const HostPositions& given) {
  if (given.start != nullptr) return {*given.start, *given.end};
  return positions_.download(mesh_->vertex_count());
}

Span<const Candidate> Completion::near_pairs(ContactKind kind) {
  const int k = static_cast<int>(kind);
  if (in_parts_) return part_near_[k];
  return step_.buffers().download_near(kind);
}

Span<const Contact> Completion::contacts(const HostPositions& given, Stats& stats) {
  StepBuffers& buffers = step_.buffers();
  const std::size_t wide = in_parts_ ? part_queries_.size() : counters_.too_wide;
  std::size_t count = counters_.contacts;
  if (in_parts_) part_contacts_.resize(count + wide);
  Contact* const contacts = in_parts_ ? part_contacts_.data() : buffers.finish_contacts();
  if (wide != 0) {
    const HardQuery* const queries = in_parts_ ? part_queries_.data() : buffers.download_too_wide();
    const auto [start, end] = host_positions(given);
    mesh_->complete(pool_);
    count = merge_undecided(*mesh_, start, end, queries, wide, pool_, contacts, count, stats);
  }
  return {contacts, count};
}

}  // namespace lazyccd::gpu
