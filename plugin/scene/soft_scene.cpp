#include "scene/soft_scene.h"

#include <BulletCollision/BroadphaseCollision/btOverlappingPairCache.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <tuple>

#include "exclusion/left_to_bullet.h"
#include "scene/collision_filters.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Collision margin, metres; 0 if it is not finite.
btScalar margin_of(const btSoftBody& body) {
  const btScalar margin = body.getCollisionShape()->getMargin();
  return std::isfinite(margin) ? margin : 0;
}

}  // namespace

bool SoftScene::Fingerprint::operator==(const Fingerprint& s) const {
  const auto tie = [](const Fingerprint& x) {
    return std::tie(x.body, x.nodes, x.ignored, x.node_count, x.face_count, x.link_count,
                    x.tetra_count, x.group, x.mask, x.collisions, x.self, x.responds, x.excluded,
                    x.marked_changed, x.margin, x.proxy_id);
  };
  return tie(*this) == tie(s);
}

SoftScene::Fingerprint SoftScene::fingerprint(btSoftBody* body) const {
  Fingerprint s;
  s.body = body;
  s.nodes = body->m_nodes.size() ? &body->m_nodes[0] : nullptr;
  s.ignored = hash_of_ignored(*body);
  s.node_count = body->m_nodes.size();
  s.face_count = body->m_faces.size();
  s.link_count = body->m_links.size();
  s.tetra_count = body->m_tetras.size();
  const btBroadphaseProxy* proxy = body->getBroadphaseHandle();
  s.group = proxy ? proxy->m_collisionFilterGroup : btBroadphaseProxy::DefaultFilter;
  s.mask = proxy ? proxy->m_collisionFilterMask : btBroadphaseProxy::AllFilter;
  s.collisions = body->m_cfg.collisions;
  s.self = body->useSelfCollision();
  s.responds = body->hasContactResponse();
  s.excluded = excluded_.contains(body);
  s.marked_changed = body->m_bUpdateRtCst;
  s.margin = margin_of(*body);
  s.proxy_id = bullet::proxy_id(*body);
  return s;
}

bool SoftScene::update(const Sleepers& sleepers, WarningLog& warnings) {
  const std::vector<Sleepers::Member>& members = sleepers.members();
  ScratchVector<Fingerprint> now;
  now.reserve(members.size());
  for (const Sleepers::Member& member : members) now.push_back(fingerprint(member.body));
  const auto has_index = [](int index, const Sleepers::Member& m) {
    return index == m.world_index;
  };
  if (valid_ && now == fingerprints_ &&
      std::equal(world_indices_.begin(), world_indices_.end(), members.begin(), members.end(),
                 has_index))
    return update_filters(members);
  find_changed(now);
  std::unordered_map<const btSoftBody*, Fingerprint> left_out;
  for (const btSoftBody* const body : sleepers.left_out()) {
    const auto known = left_out_.find(body);
    if (known != left_out_.end()) left_out.insert(*known);
  }
  for (const Fingerprint& last : fingerprints_) left_out.insert_or_assign(last.body, last);
  for (const Fingerprint& member : now) left_out.erase(member.body);
  left_out_ = std::move(left_out);
  fingerprints_ = std::move(now);
  rebuild(members, warnings);
  return true;
}

void SoftScene::find_changed(Span<const Fingerprint> members) {
  auto last = fingerprints_.begin();
  const auto is_known = [&](const Fingerprint& member) {
    const auto is_same_body = [&member](const Fingerprint& f) { return f.body == member.body; };
    auto found = std::find_if(last, fingerprints_.end(), is_same_body);
    if (found == fingerprints_.end()) {
      // Bullet moves the last body to the place of one that is removed.
      found = std::find_if(fingerprints_.begin(), last, is_same_body);
      if (found == last) found = fingerprints_.end();
    }
    if (found != fingerprints_.end()) {
      last = found + 1;
      return member == *found;
    }
    const auto left_out = left_out_.find(member.body);
    return left_out != left_out_.end() && member == left_out->second;
  };
  for (const Fingerprint& member : members)
    if (!valid_ || !is_known(member)) changed_.insert(member.body);
}

void SoftScene::invalidate(const btSoftBody& body) {
  const auto forget = [](Fingerprint& known) { known.node_count = -1; };
  for (Fingerprint& known : fingerprints_)
    if (known.body == &body) forget(known);
  const auto left_out = left_out_.find(&body);
  if (left_out != left_out_.end()) forget(left_out->second);
}

bool SoftScene::update_filters(const std::vector<Sleepers::Member>& members) {
  const auto has_application_filter = [](const Sleepers::Member& member) {
    return overlap_filter(*member.body) != nullptr;
  };
  if (!filtered_by_application_ && !refused_pairs_.is_changed() &&
      std::none_of(members.begin(), members.end(), has_application_filter))
    return false;
  const std::vector<Body> filters = topology_.bodies;
  const std::vector<BodyPair> disabled = topology_.disabled_pairs;
  find_filters();
  std::set<std::int32_t> changed;
  for (std::size_t i = 0; i < filters.size(); ++i)
    if (!are_equal_filters(filters[i], topology_.bodies[i]))
      changed.insert(static_cast<std::int32_t>(i));
  std::vector<BodyPair> differing;
  std::set_symmetric_difference(disabled.begin(), disabled.end(), topology_.disabled_pairs.begin(),
                                topology_.disabled_pairs.end(), std::back_inserter(differing));
  for (const BodyPair& pair : differing) changed.insert(pair.begin(), pair.end());
  for (const std::int32_t body : changed) changed_.insert(bodies_[body].body);
  return !changed.empty();
}

// Uses several threads, because Bullet's nodes lie far apart in memory: one thread would wait for
// memory most of the time.
void SoftScene::for_each_range(const Threads& threads, Visit visit) const {
  constexpr std::size_t grain = 2048;  // vertices: work that takes longer than waking a thread
  threads.parallel_for(
      static_cast<std::size_t>(vertex_count()), grain, [&](std::size_t begin, std::size_t end) {
        auto first = static_cast<std::int32_t>(begin);
        while (first < static_cast<std::int32_t>(end)) {
          const BodyRecord& record = bodies_[body_of(first)];
          const std::int32_t last =
              std::min(static_cast<std::int32_t>(end), record.first_vertex + record.vertex_count);
          visit(record, first, last);
          first = last;
        }
      });
}

int SoftScene::world_index_of(const btSoftBody& body) const {
  for (std::size_t i = 0; i < fingerprints_.size(); ++i)
    if (fingerprints_[i].body == &body) return world_indices_[i];
  return -1;
}

bool SoftScene::accepts(const btSoftBody* body) const {
  const bool has_primitives = body->m_faces.size() > 0 || body->m_links.size() > 0;
  return has_primitives && !body->m_reducedModel && !excluded_.contains(body);
}

std::int32_t SoftScene::vertex_of(const BodyRecord& record, int node) const {
  const auto first = node_of_vertex_.begin() + record.first_vertex;
  const auto last = first + record.vertex_count;
  const auto found = std::lower_bound(first, last, node);
  if (found == last || *found != node) return -1;
  return static_cast<std::int32_t>(found - node_of_vertex_.begin());
}

void SoftScene::rebuild(const std::vector<Sleepers::Member>& members, WarningLog& warnings) {
  valid_ = false;
  next_primitives_.clear();
  world_indices_.clear();
  bodies_.clear();
  topology_ = SceneTopology();
  node_of_vertex_.clear();
  face_of_face_.clear();
  for (const Sleepers::Member& member : members) {
    btSoftBody* const body = member.body;
    world_indices_.push_back(member.world_index);
    warn_of_what_is_left_to_bullet(*body, member.world_index, warnings);
    if (body->m_reducedModel) {
      const std::string index = std::to_string(member.world_index);
      warnings.warn_once("reduced " + index,
                         "soft body " + index +
                             " is a reduced deformable, which is not supported: collision "
                             "detection leaves it out");
    } else if (!excluded_.contains(body) &&
               (flags_.ask_for_any(*body) || body->useSelfCollision())) {
      add_body(body, member.world_index, warnings);
    }
  }
  primitives_ = std::move(next_primitives_);
  next_primitives_.clear();
  find_filters();
  valid_ = true;
}

const Primitives& SoftScene::primitives_of(const btSoftBody& body) {
  const auto known = primitives_.find(&body);
  const bool is_unchanged = known != primitives_.end() && !is_changed(body) && !body.m_bUpdateRtCst;
  return next_primitives_
      .emplace(&body, is_unchanged ? std::move(known->second) : read_primitives(body))
      .first->second;
}

void SoftScene::add_body(btSoftBody* body, int world_index, WarningLog& warnings) {
  const Primitives& own = primitives_of(*body);
  const int bad = own.foreign_faces + own.degenerate_faces + own.duplicate_faces;
  if (bad) {
    const std::string name = "soft body " + std::to_string(world_index);
    warnings.warn_once("faces " + std::to_string(world_index) + " " + std::to_string(bad),
                       name + ": left out " + std::to_string(own.degenerate_faces) +
                           " faces with a repeated node, " + std::to_string(own.duplicate_faces) +
                           " duplicate faces, " + std::to_string(own.foreign_faces) +
                           " faces with a node of another body");
  }
  if (own.faces.empty() && own.edges.empty()) return;

  std::vector<std::int32_t> vertex_of_node(body->m_nodes.size(), -1);
  for (const Face& face : own.faces) {
    for (const std::int32_t node : face) vertex_of_node[node] = 0;
  }
  for (const Edge& edge : own.edges) vertex_of_node[edge[0]] = vertex_of_node[edge[1]] = 0;

  if (std::count(vertex_of_node.begin(), vertex_of_node.end(), -1) > 0)
    warnings.warn_once("loose " + std::to_string(world_index),
                       "soft body " + std::to_string(world_index) +
                           ": nodes that belong to no face, link or tetrahedron do not collide");

  BodyRecord record;
  record.body = body;
  record.world_index = world_index;
  record.first_vertex = vertex_count();
  record.margin = margin_of(*body);
  if (record.margin != body->getCollisionShape()->getMargin())
    warnings.warn_once("margin " + std::to_string(world_index),
                       "soft body " + std::to_string(world_index) +
                           ": the collision margin is not finite; 0 is used");
  record.responds = body->hasContactResponse();
  record.meets_rigid = flags_.ask_for_rigid(*body);
  const std::int32_t index = static_cast<std::int32_t>(bodies_.size());
  for (std::size_t node = 0; node < vertex_of_node.size(); ++node) {
    if (vertex_of_node[node] < 0) continue;
    vertex_of_node[node] = vertex_count();
    node_of_vertex_.push_back(static_cast<int>(node));
    topology_.body_of_vertex.push_back(index);
    topology_.inverse_mass.push_back(
        static_cast<float>(body->m_nodes[static_cast<int>(node)].m_im));
  }
  record.vertex_count = vertex_count() - record.first_vertex;
  const auto size_of = [](const auto& list) { return static_cast<std::int32_t>(list.size()); };
  record.faces.first = size_of(topology_.faces);
  record.edges.first = size_of(topology_.edges);
  for (Face face : own.faces) {
    for (std::int32_t& corner : face) corner = vertex_of_node[corner];
    topology_.faces.push_back(face);
  }
  face_of_face_.insert(face_of_face_.end(), own.face_indices.begin(), own.face_indices.end());
  for (const Edge& edge : own.edges) {
    topology_.edges.push_back({vertex_of_node[edge[0]], vertex_of_node[edge[1]]});
  }
  record.faces.last = size_of(topology_.faces);
  record.edges.last = size_of(topology_.edges);
  bodies_.push_back(record);
}

void SoftScene::find_filters() {
  topology_.bodies.clear();
  topology_.disabled_pairs.clear();
  filtered_by_application_ = std::any_of(bodies_.begin(), bodies_.end(), [](const BodyRecord& b) {
    return overlap_filter(*b.body) != nullptr;
  });
  bool has_rules = filtered_by_application_ || !refused_pairs_.is_empty();
  for (const BodyRecord& record : bodies_) {
    Body filter;
    const btBroadphaseProxy* proxy = record.body->getBroadphaseHandle();
    if (proxy && !filtered_by_application_) {
      filter.group = static_cast<std::uint32_t>(proxy->m_collisionFilterGroup);
      filter.mask = static_cast<std::uint32_t>(proxy->m_collisionFilterMask);
    }
    filter.self_collision = record.body->useSelfCollision();
    flags_.layers_of(*record.body).set(filter);
    topology_.bodies.push_back(filter);
    has_rules = has_rules || has_pair_rules(*record.body);
  }
  if (!has_rules) return;
  for (std::size_t a = 0; a < bodies_.size(); ++a) {
    for (std::size_t b = a + 1; b < bodies_.size(); ++b) {
      if (!may_collide(*bodies_[a].body, *bodies_[b].body) ||
          refused_pairs_.contains(*bodies_[a].body, *bodies_[b].body)) {
        topology_.disabled_pairs.push_back(
            {static_cast<std::int32_t>(a), static_cast<std::int32_t>(b)});
      }
    }
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
