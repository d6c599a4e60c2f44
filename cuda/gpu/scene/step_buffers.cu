// Allocation and download of the lists of a step.
#include "gpu/scene/step_buffers.h"

#include <algorithm>

#include "core/narrow/column_layout.h"
#include "gpu/device/check.h"

namespace lazyccd::gpu {

template <class Body>
void StepBuffers::for_each_list(Body&& body) {
  for (int kind = 0; kind < 2; ++kind) {
    body(filtered_[kind]);
    body(hits_[kind]);
    body(undecided_in_single_[kind]);
    if (lists_near_) body(near_[kind]);
  }
  body(hard_);
  body(undecided_in_double_);
  body(too_wide_);
  body(contacts_);
}

StepBuffers::StepBuffers(std::uint32_t capacity_hint, bool lists_near) : lists_near_(lists_near) {
  counters_.reserve(1);
  host_counters_.reserve(1);
  *host_counters_.data() = {};
  if (capacity_hint != 0) for_each_list([&](auto& list) { list.set_capacity(capacity_hint); });
}

bool StepBuffers::shrink() {
  constexpr std::uint32_t least = 64;
  bool shrunk = false;
  for_each_list([&](auto& list) { shrunk = list.shrink(least) || shrunk; });
  // The buffers of the sort are allocated again, for the new number of contacts.
  sorted_.free();
  for (auto* keys : {&keys_, &upper_keys_, &sorted_keys_}) keys->free();
  for (auto* order : {&order_, &sorted_order_, &final_order_, &bins_, &bin_starts_, &ranks_})
    order->free();
  sort_space_.free();
  return shrunk;
}

void StepBuffers::reserve(const ContactKey& key, cudaStream_t stream) {
  for_each_list([](auto& list) { list.reserve(); });
  const std::uint32_t contacts = contacts_.capacity();
  host_too_wide_.reserve(too_wide_.capacity());
  host_contacts_.reserve(std::size_t{contacts} + too_wide_.capacity());
  const std::uint32_t bins = sort_bins(key, contacts);
  const bool two_words = !key.is_one_word();
  if (contacts <= sorted_.size() && contacts <= sorted_order_.size() && bins == bin_count_ &&
      two_words == two_words_)
    return;
  bin_count_ = bins;
  two_words_ = two_words;
  bins_.reserve(bins);
  bin_starts_.reserve(bins);
  sort_space_.reserve(sort_space_bytes(bins, contacts));
  sorted_.reserve(contacts);
  // The download copies as many contacts as the last step makes likely, so it may copy places that
  // were never written.
  LAZYCCD_CUDA_CHECK(cudaMemsetAsync(sorted_.data(), 0, sorted_.bytes(), stream));
  keys_.reserve(contacts);
  if (two_words) {
    upper_keys_.reserve(contacts);
    final_order_.reserve(contacts);
  }
  sorted_keys_.reserve(contacts);
  ranks_.reserve(contacts);
  order_.reserve(contacts);
  sorted_order_.reserve(contacts);
  fill_order(order_.data(), contacts, stream);
}

StepLists StepBuffers::lists() {
  StepCounters* c = counters_.data();
  StepLists lists{};
  for (int kind = 0; kind < 2; ++kind) {
    lists.filtered[kind] = filtered_[kind].output(&c->filtered[kind]);
    lists.hits[kind] = hits_[kind].output(&c->hits[kind]);
    lists.undecided_in_single[kind] =
        undecided_in_single_[kind].output(&c->undecided_in_single[kind]);
    if (lists_near_) lists.near[kind] = near_[kind].output(&c->near[kind]);
  }
  lists.hard = hard_.output(&c->hard);
  lists.undecided_in_double = undecided_in_double_.output(&c->undecided_in_double);
  lists.too_wide = too_wide_.output(&c->too_wide);
  lists.contacts = contacts_.output(&c->contacts);
  lists.keys = keys_.data();
  lists.upper_keys = two_words_ ? upper_keys_.data() : nullptr;
  lists.bins = bin_count_ != 0 ? bins_.data() : nullptr;
  lists.ranks = ranks_.data();
  lists.counters = c;
  return lists;
}

SortBuffers StepBuffers::sort_buffers() {
  return {sorted_keys_.data(), order_.data(),      sorted_order_.data(), final_order_.data(),
          bin_starts_.data(),  sort_space_.data(), sort_space_.bytes(),  sorted_.data()};
}

void StepBuffers::download_counters(cudaStream_t stream) {
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(host_counters_.data(), counters_.data(), sizeof(StepCounters),
                                     cudaMemcpyDeviceToHost, stream));
  downloaded_ = downloaded_columns_ = 0;
}

void StepBuffers::download(cudaStream_t stream) {
  download_counters(stream);
  const std::uint32_t likely = std::min(expected_contacts_, contacts_.capacity());
  if (column_fields_ != 0) {
    download_columns(likely, stream);
    return;
  }
  downloaded_ = likely;
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(host_contacts_.data(), sorted_.data(),
                                     downloaded_ * sizeof(Contact), cudaMemcpyDeviceToHost,
                                     stream));
}

int StepBuffers::grow(bool grows) {
  const StepCounters& c = counters();
  int too_short = 0;
  for (int kind = 0; kind < 2; ++kind) {
    too_short += filtered_[kind].outgrown(c.filtered[kind], grows);
    too_short += hits_[kind].outgrown(c.hits[kind], grows);
    too_short += undecided_in_single_[kind].outgrown(c.undecided_in_single[kind], grows);
    if (lists_near_) too_short += near_[kind].outgrown(c.near[kind], grows);
  }
  too_short += hard_.outgrown(c.hard, grows);
  too_short += undecided_in_double_.outgrown(c.undecided_in_double, grows);
  too_short += too_wide_.outgrown(c.too_wide, grows);
  too_short += contacts_.outgrown(c.contacts, grows);
  return too_short;
}

Contact* StepBuffers::finish_contacts() {
  const std::uint32_t count = counters().contacts;
  if (count > downloaded_)
    LAZYCCD_CUDA_CHECK(cudaMemcpy(host_contacts_.data() + downloaded_, sorted_.data() + downloaded_,
                                  (count - downloaded_) * sizeof(Contact), cudaMemcpyDeviceToHost));
  expect_contacts();
  return host_contacts_.data();
}

void StepBuffers::expect_contacts() {
  const std::uint32_t count = counters().contacts;
  expected_contacts_ = std::max<std::uint32_t>(count + count / 8, 1024);
}

void StepBuffers::download_columns(std::uint32_t count, cudaStream_t stream) {
  const ColumnLayout layout = ColumnLayout::of(column_fields_, count);
  columns_.reserve(layout.bytes());
  host_columns_.reserve(layout.bytes());
  enqueue_columns(sorted_.data(), static_cast<std::uint32_t>(sorted_.size()),
                  &counters_.data()->contacts, layout, columns_.data(), stream);
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(host_columns_.data(), columns_.data(), layout.bytes(),
                                     cudaMemcpyDeviceToHost, stream));
  downloaded_columns_ = count;
}

ContactColumns StepBuffers::finish_columns(cudaStream_t stream) {
  const std::uint32_t count = counters().contacts;
  if (count > downloaded_columns_) {
    download_columns(count, stream);
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream));
  }
  expect_contacts();
  return ColumnLayout::of(column_fields_, downloaded_columns_).columns(host_columns_.data(), count);
}

Span<const Candidate> StepBuffers::download_near(ContactKind kind) {
  const int k = static_cast<int>(kind);
  const std::uint32_t count = counters().near[k];
  if (count == 0) return {};
  host_near_[k].reserve(count);
  LAZYCCD_CUDA_CHECK(cudaMemcpy(host_near_[k].data(), near_[k].data(), count * sizeof(Candidate),
                                cudaMemcpyDeviceToHost));
  return {host_near_[k].data(), count};
}

const HardQuery* StepBuffers::download_too_wide() {
  LAZYCCD_CUDA_CHECK(cudaMemcpy(host_too_wide_.data(), too_wide_.data(),
                                counters().too_wide * sizeof(HardQuery), cudaMemcpyDeviceToHost));
  return host_too_wide_.data();
}

std::size_t StepBuffers::bytes() const {
  std::size_t sum = counters_.bytes() + hard_.bytes() + undecided_in_double_.bytes() +
                    too_wide_.bytes() + contacts_.bytes() + sorted_.bytes() + keys_.bytes() +
                    upper_keys_.bytes() + sorted_keys_.bytes() + order_.bytes() +
                    sorted_order_.bytes() + final_order_.bytes() + bins_.bytes() +
                    bin_starts_.bytes() + ranks_.bytes() + sort_space_.bytes() + columns_.bytes();
  for (int kind = 0; kind < 2; ++kind)
    sum += filtered_[kind].bytes() + hits_[kind].bytes() + undecided_in_single_[kind].bytes() +
           near_[kind].bytes();
  return sum;
}

}  // namespace lazyccd::gpu
