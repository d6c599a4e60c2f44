// Fields of contacts in arrays of their own, copied on the host.
#pragma once

#include <cstdint>
#include <vector>

#include "core/narrow/column_layout.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/contact_columns.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// Owns the arrays.
class ColumnCopy {
 public:
  /// `fields`: bits of ContactField. Valid until the next call.
  ContactColumns split(Span<const Contact> contacts, std::uint32_t fields, ThreadPool& pool) {
    constexpr std::size_t grain = 1 << 13;
    const ColumnLayout layout = ColumnLayout::of(fields, contacts.size());
    block_.resize(layout.bytes() / sizeof(double) + 1);
    char* const block = reinterpret_cast<char*>(block_.data());
    pool.parallel_for(contacts.size(), grain, [&](std::size_t first, std::size_t last, int) {
      for (std::size_t i = first; i < last; ++i) layout.put(contacts[i], i, block);
    });
    return layout.columns(block, contacts.size());
  }

 private:
  std::vector<double> block_;
};

}  // namespace lazyccd
