// Puts the workers' contacts into the order in which they are reported.
#pragma once

#include <cstdint>
#include <vector>

#include "core/narrow/contact_key.h"
#include "cpu/scene/mesh.h"
#include "cpu/threads/thread_pool.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// The contacts that one worker found, with their sort keys.
struct ContactPart {
  Span<const Contact> contacts;
  Span<const std::uint64_t> keys;  // of the contacts
};

/// Sorts contacts by operator< of Contact. Keeps its buffers between steps.
class ContactSort {
 public:
  explicit ContactSort(const Mesh& mesh) : key_(mesh.contact_key()) {}
  /// Copies the contacts of all parts into `out`, sorted, and returns their hash.
  std::uint64_t operator()(const std::vector<ContactPart>& parts, ThreadPool& pool,
                           std::vector<Contact>& out);
  std::size_t bytes() const { return (items_.capacity() + other_.capacity()) * sizeof(Item); }

 private:
  struct Item {
    std::uint64_t key;
    const Contact* contact;
  };
  void radix_sort();

  ContactKey key_;
  std::vector<Item> items_, other_;
};

/// Inserts the contacts `more` into `sorted`. Both must be sorted; the result is.
void merge(Span<const Contact> more, std::vector<Contact>& sorted);

}  // namespace lazyccd
