#include "links/body_links.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "scene/soft_scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// True if PSolve_Links() skips the link, as it does between two immovable nodes.
bool is_skipped(const btSoftBody::Link& link) { return !(link.m_c0 > 0); }

LinkedNode<btScalar> linked(const btVector3& x) { return {{x.x(), x.y(), x.z(), 0}}; }

void move(btVector3& x, const LinkedNode<btScalar>& to) {
  x.setX(to.x[0]);
  x.setY(to.x[1]);
  x.setZ(to.x[2]);
}

// Counts the links that share a node with one of the three links before them. The processor has not
// finished those links yet when it begins this one, so it has to wait.
std::int64_t count_dependent(const LinkEnds& ends) {
  constexpr std::ptrdiff_t window = 3;
  std::int64_t dependent = 0;
  for (auto link = ends.begin(); link != ends.end(); ++link) {
    if (*link == no_nodes) continue;
    const auto first = link - std::min(window, link - ends.begin());
    dependent += std::any_of(first, link, [&](const auto& earlier) {
      return (*link)[0] == earlier[0] || (*link)[0] == earlier[1] || (*link)[1] == earlier[0] ||
             (*link)[1] == earlier[1];
    });
  }
  return dependent;
}

}  // namespace

bool BodyLinks::prepare(Span<btSoftBody* const> bodies, std::int64_t passes) {
  if (!kernels_) return false;
  if (!is_planned(bodies)) plan(bodies);
  if (!is_faster(passes)) return false;
  if (load_links()) return true;
  plan(bodies);
  return is_faster(passes) && load_links();
}

bool BodyLinks::is_planned(Span<btSoftBody* const> bodies) const {
  return std::equal(members_.begin(), members_.end(), bodies.begin(), bodies.end(),
                    [](const Member& member, const btSoftBody* body) {
                      return member.body == body && member.node_count == body->m_nodes.size() &&
                             member.link_count == body->m_links.size();
                    });
}

void BodyLinks::plan(Span<btSoftBody* const> bodies) {
  constexpr std::int64_t max_nodes = 1 << 26;  // a link stores node offsets as 32-bit byte counts
  members_.clear();                            // there is no plan if this throws
  groups_.clear();
  std::vector<Member> members;
  ends_.clear();
  std::int64_t nodes = 0;
  for (const btSoftBody* body : bodies) nodes += body->m_nodes.size();
  bool all_nodes_own = nodes <= max_nodes;
  node_count_ = 0;
  for (btSoftBody* const body : bodies) {
    for (int i = 0; i < body->m_links.size() && all_nodes_own; ++i) {
      const btSoftBody::Link& link = body->m_links[i];
      const int a = index_of(*body, link.m_n[0]), b = index_of(*body, link.m_n[1]);
      all_nodes_own = a >= 0 && b >= 0;
      ends_.push_back(is_skipped(link) ? no_nodes
                                       : LinkEnds::value_type{node_count_ + a, node_count_ + b});
    }
    members.push_back({body, body->m_nodes.size(), body->m_links.size(), node_count_});
    if (all_nodes_own) node_count_ += body->m_nodes.size();
  }
  if (all_nodes_own) {
    plan_ = plan_links(ends_, node_count_, LinkGroup<btScalar>::links);
    nodes_.assign(static_cast<std::size_t>(plan_.nodes), {});
    dependent_links_ = count_dependent(ends_);
    groups_ = make_groups<btScalar>(plan_, ends_);
  }
  members_ = std::move(members);
}

// Compares the costs in nanoseconds (AMD EPYC). Bullet takes 4.5 to solve a link, and 8.5 more for
// a dependent one. A group takes 12; reading and writing the data takes 5 per link and call.
bool BodyLinks::is_faster(std::int64_t passes) const {
  const auto links = static_cast<double>(ends_.size()),
             groups = static_cast<double>(groups_.size());
  const double grouped_ns = static_cast<double>(passes) * 12 * groups + 5 * links;
  return passes > 0 && groups > 0 &&
         grouped_ns < static_cast<double>(passes) *
                          (4.5 * links + 8.5 * static_cast<double>(dependent_links_));
}

// Returns false if the links no longer match the plan.
bool BodyLinks::load_links() {
  inverse_mass_.resize(static_cast<std::size_t>(node_count_));
  std::size_t next = 0;  // in ends_
  for (const Member& member : members_) {
    if (member.link_count == 0) continue;
    const btSoftBody::Node* const nodes = &member.body->m_nodes[0];
    for (int i = 0; i < member.node_count; ++i)
      inverse_mass_[static_cast<std::size_t>(member.first_node + i)] = nodes[i].m_im;
    for (int i = 0; i < member.link_count; ++i, ++next) {
      const btSoftBody::Link& link = member.body->m_links[i];
      const auto [index, lane] = plan_.places[next];
      if (is_skipped(link) != (index < 0)) return false;
      if (index < 0) continue;
      const auto [a, b] = ends_[next];
      if (link.m_n[0] != nodes + (a - member.first_node) ||
          link.m_n[1] != nodes + (b - member.first_node))
        return false;
      LinkGroup<btScalar>& group = groups_[index];
      group.c0[lane] = link.m_c0;
      group.c1[lane] = link.m_c1;
      group.inverse_mass[0][lane] = inverse_mass_[static_cast<std::size_t>(a)];
      group.inverse_mass[1][lane] = inverse_mass_[static_cast<std::size_t>(b)];
    }
  }
  return true;
}

void BodyLinks::read() {
  for (const Member& member : members_)
    for (int i = 0; i < member.node_count; ++i)
      nodes_[member.first_node + i] = linked(member.body->m_nodes[i].m_x);
}

void BodyLinks::read(int node) { nodes_[node] = linked(members_[0].body->m_nodes[node].m_x); }

void BodyLinks::write() const {
  for (const Member& member : members_)
    for (int i = 0; i < member.node_count; ++i)
      move(member.body->m_nodes[i].m_x, nodes_[member.first_node + i]);
}

void BodyLinks::write(int node) const { move(members_[0].body->m_nodes[node].m_x, nodes_[node]); }

void BodyLinks::solve(int passes) {
  kernels_->solve({groups_.data(), static_cast<int>(groups_.size()), plan_.skew, passes,
                   nodes_.data(), bytes_of_nodes<btScalar>(node_count_)});
}

void BodyLinks::solve(int passes, Span<btVector3> positions) {
  for (std::size_t i = 0; i < positions.size(); ++i) nodes_[i] = linked(positions[i]);
  solve(passes);
  for (std::size_t i = 0; i < positions.size(); ++i) move(positions[i], nodes_[i]);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
