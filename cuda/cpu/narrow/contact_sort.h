// Puts the workers' contacts into the order in which they are reported.
#pragma once

#include <cstdint>
#include <vector>

#include "core/narrow/contact_key.h"
#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// The contacts that one worker found, with their sort keys.
struct ContactPart {
  Span<const Contact> contacts;
  Span<const std::uint64_t> keys;  // of the contacts
};

/// Sorts contacts by world, then by operator< of Contact. Keeps its buffers between steps.
class ContactSort {
 public:
  explicit ContactSort(const Mesh& mesh) : key_(mesh.contact_key()), order_(mesh.contact_order()) {}
  /// Copies the contacts of all parts into `out`, sorted, and returns their hash.
  std::uint64_t operator()(Span<const ContactPart> parts, ThreadPool& pool,
                           std::vector<Contact>& out);
  std::size_t bytes() const { return (items_.capacity() + other_.capacity()) * sizeof(Item); }

 private:
  struct Item {
    std::uint64_t key;
    const Contact* contact;
  };
  // Sorts the items by the lowest `bits` of their keys; equal keys keep their order.
  void radix_sort(int bits);

  ContactKey key_;
  ContactOrder order_;
  std::vector<Item> items_, other_;
};

/// Inserts the contacts `more` into `sorted`. Both must be in order; the result is.
void merge(Span<const Contact> more, const ContactOrder& order, std::vector<Contact>& sorted);

}  // namespace lazyccd
