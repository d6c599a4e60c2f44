#include "links/body_links.h"

#include <algorithm>
#include <cstddef>

#include "scene/soft_scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Whether PSolve_Links() leaves it out, as between nodes that nothing moves.
bool is_left_out(const btSoftBody::Link& link) { return !(link.m_c0 > 0); }

// Links that share a node with one of the few before them, which are not done yet when they begin.
std::int64_t count_waiting(const LinkEnds& ends) {
  constexpr std::ptrdiff_t window = 3;
  std::int64_t waiting = 0;
  for (auto link = ends.begin(); link != ends.end(); ++link) {
    if (*link == no_nodes) continue;
    const auto first = link - std::min(window, link - ends.begin());
    waiting += std::any_of(first, link, [&](const auto& before) {
      return (*link)[0] == before[0] || (*link)[0] == before[1] || (*link)[1] == before[0] ||
             (*link)[1] == before[1];
    });
  }
  return waiting;
}

}  // namespace

bool BodyLinks::take(const btSoftBody& body, std::int64_t passes) {
  if (!kernels_) return false;
  if (!is_planned(body)) plan(body);
  if (!pays(passes)) return false;
  if (take_links(body)) return true;
  plan(body);
  return pays(passes) && take_links(body);
}

bool BodyLinks::is_planned(const btSoftBody& body) const {
  return body_ == &body && node_count_ == body.m_nodes.size() && link_count_ == body.m_links.size();
}

void BodyLinks::plan(const btSoftBody& body) {
  constexpr int most_nodes = 1 << 26;  // a link knows them by 32 bits of bytes
  body_ = nullptr;
  groups_.clear();
  ends_.clear();
  bool all_own = body.m_nodes.size() <= most_nodes;
  for (int i = 0; i < body.m_links.size() && all_own; ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    const int a = index_of(body, link.m_n[0]), b = index_of(body, link.m_n[1]);
    all_own = a >= 0 && b >= 0;
    ends_.push_back(is_left_out(link) ? no_nodes : LinkEnds::value_type{a, b});
  }
  if (all_own) {
    plan_ = plan_links(ends_, body.m_nodes.size(), LinkGroup<btScalar>::links);
    nodes_.assign(static_cast<std::size_t>(plan_.nodes), {});
    waiting_ = count_waiting(ends_);
    groups_ = make_groups<btScalar>(plan_, ends_);
  }
  body_ = &body;
  node_count_ = body.m_nodes.size();
  link_count_ = body.m_links.size();
}

// In nanoseconds (AMD EPYC): to solve a link takes Bullet 4.5, and one that waits 8.5 more; a group
// takes 12, and what is read and written besides 5 a link.
bool BodyLinks::pays(std::int64_t passes) const {
  const auto links = static_cast<double>(link_count_), groups = static_cast<double>(groups_.size());
  const double here = static_cast<double>(passes) * 12 * groups + 5 * links;
  return passes > 0 && groups > 0 &&
         here < static_cast<double>(passes) * (4.5 * links + 8.5 * static_cast<double>(waiting_));
}

// False where they are not those of the plan.
bool BodyLinks::take_links(const btSoftBody& body) {
  for (int i = 0; i < link_count_; ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    const auto [index, lane] = plan_.places[i];
    if (is_left_out(link) != (index < 0)) return false;
    if (index < 0) continue;
    const btSoftBody::Node& a = body.m_nodes[ends_[i][0]];
    const btSoftBody::Node& b = body.m_nodes[ends_[i][1]];
    if (link.m_n[0] != &a || link.m_n[1] != &b) return false;
    LinkGroup<btScalar>& group = groups_[index];
    group.c0[lane] = link.m_c0;
    group.c1[lane] = link.m_c1;
    group.inverse_mass[0][lane] = a.m_im;
    group.inverse_mass[1][lane] = b.m_im;
  }
  return true;
}

void BodyLinks::read(const btSoftBody& body) {
  for (int i = 0; i < body.m_nodes.size(); ++i) read(body, i);
}

void BodyLinks::read(const btSoftBody& body, int node) {
  const btVector3& x = body.m_nodes[node].m_x;
  nodes_[node] = {{x.x(), x.y(), x.z(), 0}};
}

void BodyLinks::write(btSoftBody& body) const {
  for (int i = 0; i < body.m_nodes.size(); ++i) write(body, i);
}

void BodyLinks::write(btSoftBody& body, int node) const {
  const btScalar* const from = nodes_[node].x;
  btVector3& x = body.m_nodes[node].m_x;
  x.setX(from[0]);
  x.setY(from[1]);
  x.setZ(from[2]);
}

void BodyLinks::solve(int passes) {
  kernels_->solve({groups_.data(), static_cast<int>(groups_.size()), plan_.skew, passes,
                   nodes_.data(), bytes_of_nodes<btScalar>(node_count_)});
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
