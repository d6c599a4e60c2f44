// The contacts of each world of a detection.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/scene/mesh.h"
#include "host/threads/thread_pool.h"
#include "lazyccd/contact.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// Parts of the sorted contacts of all worlds. Everything is found when it is first asked for.
class WorldContacts {
 public:
  /// Both must stay valid until the next call.
  void set_mesh(const Mesh& mesh);
  void set_contacts(Span<const Contact> contacts);

  /// Takes memory for every world up to the largest. Contacts of world w are [offsets[w + 1],
  /// offsets[w + 2]); w = -1: of bodies in every world.
  const std::vector<std::size_t>& offsets(ThreadPool& pool);
  /// The contacts of a world. Throws Error(index_out_of_range).
  Span<const Contact> of(std::int32_t world) const;
  /// The hash of these contacts with the vertices numbered as if the bodies of all other worlds
  /// were left out. So it does not depend on other worlds.
  std::uint64_t hash(std::int32_t world);

 private:
  void number_vertices();
  // Index of a vertex if only this world's and every world's vertices are counted.
  std::int32_t local_index(std::int32_t vertex, std::int32_t world) const;

  const Mesh* mesh_ = nullptr;
  Span<const Contact> contacts_;
  std::vector<std::size_t> offsets_;  // empty: not found yet
  std::vector<std::int32_t> worlds_;  // those that have bodies, ascending
  std::vector<std::size_t>
      first_vertex_;                    // by place in worlds_: part of vertices_; empty: as above
  std::vector<std::int32_t> vertices_;  // ascending within each world
};

}  // namespace lazyccd
