#include "host/scene/world_contacts.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/narrow/contact_key.h"
#include "core/narrow/contact_math.h"
#include "lazyccd/error.h"

namespace lazyccd {

void WorldContacts::set_mesh(const Mesh& mesh) {
  mesh_ = &mesh;
  first_vertex_.clear();
  set_contacts({});
}

void WorldContacts::set_contacts(Span<const Contact> contacts) {
  contacts_ = contacts;
  offsets_.clear();
}

const std::vector<std::size_t>& WorldContacts::offsets(ThreadPool& pool) {
  if (!offsets_.empty()) return offsets_;
  const std::int32_t worlds = mesh_->world_count();
  offsets_.assign(static_cast<std::size_t>(worlds) + 2, contacts_.size());
  offsets_[0] = 0;
  const std::int32_t* const world_of_body = mesh_->contact_order().world_of_body;
  const std::int32_t only = mesh_->body_count() == 0 ? -1 : mesh_->bodies()[0].world;
  pool.parallel_for(static_cast<std::size_t>(worlds), 64,
                    [&](std::size_t first, std::size_t last, int) {
                      for (std::size_t w = first; w < last; ++w) {
                        const auto world = static_cast<std::int32_t>(w);
                        if (world_of_body == nullptr) {
                          if (world <= only) offsets_[w + 1] = 0;
                          continue;
                        }
                        const auto is_before = [&](const Contact& c, std::int32_t limit) {
                          return world_of(c, world_of_body) < limit;
                        };
                        offsets_[w + 1] = static_cast<std::size_t>(
                            std::lower_bound(contacts_.begin(), contacts_.end(), world, is_before) -
                            contacts_.begin());
                      }
                    });
  return offsets_;
}

Span<const Contact> WorldContacts::of(std::int32_t world) const {
  if (world < -1 || world >= mesh_->world_count())
    throw Error(ErrorCode::index_out_of_range, "world " + std::to_string(world) +
                                                   " is outside [-1, " +
                                                   std::to_string(mesh_->world_count()) + ")");
  const std::int32_t* const world_of_body = mesh_->contact_order().world_of_body;
  if (world_of_body == nullptr) {
    const bool is_it = mesh_->body_count() != 0 && mesh_->bodies()[0].world == world;
    return is_it ? contacts_ : Span<const Contact>{};
  }
  const auto first = std::lower_bound(
      contacts_.begin(), contacts_.end(), world,
      [&](const Contact& c, std::int32_t w) { return world_of(c, world_of_body) < w; });
  const auto last = std::upper_bound(
      first, contacts_.end(), world,
      [&](std::int32_t w, const Contact& c) { return w < world_of(c, world_of_body); });
  return {first, static_cast<std::size_t>(last - first)};
}

void WorldContacts::number_vertices() {
  const Span<const std::int32_t> body_of_vertex = mesh_->body_of_vertex();
  const Span<const std::int32_t> of_body = mesh_->world_of_body();
  worlds_.assign(of_body.begin(), of_body.end());
  std::sort(worlds_.begin(), worlds_.end());
  worlds_.erase(std::unique(worlds_.begin(), worlds_.end()), worlds_.end());
  std::vector<std::size_t> place_of_body;
  for (const std::int32_t world : of_body)
    place_of_body.push_back(static_cast<std::size_t>(
        std::lower_bound(worlds_.begin(), worlds_.end(), world) - worlds_.begin()));
  std::vector<std::size_t> first(worlds_.size() + 1, 0);
  for (const std::int32_t body : body_of_vertex) ++first[place_of_body[body] + 1];
  for (std::size_t w = 1; w < first.size(); ++w) first[w] += first[w - 1];
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  vertices_.resize(body_of_vertex.size());
  for (std::size_t v = 0; v < body_of_vertex.size(); ++v)
    vertices_[next[place_of_body[body_of_vertex[v]]]++] = static_cast<std::int32_t>(v);
  first_vertex_ = std::move(first);
}

std::int32_t WorldContacts::local_index(std::int32_t vertex, std::int32_t world) const {
  const auto before = [&](std::int32_t w) {
    const auto found = std::lower_bound(worlds_.begin(), worlds_.end(), w);
    if (found == worlds_.end() || *found != w) return 0;  // no body is in it
    const std::size_t place = static_cast<std::size_t>(found - worlds_.begin());
    const auto first = vertices_.begin() + static_cast<std::ptrdiff_t>(first_vertex_[place]);
    const auto last = vertices_.begin() + static_cast<std::ptrdiff_t>(first_vertex_[place + 1]);
    return static_cast<std::int32_t>(std::lower_bound(first, last, vertex) - first);
  };
  return world < 0 ? before(-1) : before(-1) + before(world);
}

std::uint64_t WorldContacts::hash(std::int32_t world) {
  const bool is_numbered = mesh_->world_of_body().empty();
  if (!is_numbered && first_vertex_.empty()) number_vertices();
  std::uint64_t hash = 0;
  for (Contact contact : of(world)) {
    if (!is_numbered)
      for (std::int32_t& v : contact.vertices) v = local_index(v, world);
    hash += hash_share(contact);
  }
  return hash;
}

}  // namespace lazyccd
