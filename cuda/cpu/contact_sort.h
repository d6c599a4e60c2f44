// Puts the workers' contacts into the order in which they are reported.
#pragma once

#include <cstdint>
#include <vector>

#include "core/contact_key.h"
#include "cpu/mesh.h"
#include "cpu/thread_pool.h"
#include "lazyccd/contact.h"

namespace lazyccd {

// Buffers persist between steps.
class ContactSort {
 public:
  explicit ContactSort(const Mesh& mesh);
  // Moves the contacts of all parts into `out`, sorted by operator< of Contact.
  void operator()(const std::vector<const std::vector<Contact>*>& parts, ThreadPool& pool,
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

}  // namespace lazyccd
