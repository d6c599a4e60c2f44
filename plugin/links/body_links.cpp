#include "links/body_links.h"

#include <algorithm>
#include <cstddef>

#include "scene/soft_scene.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// True if PSolve_Links() skips the link, as it does between two immovable nodes.
bool is_skipped(const btSoftBody::Link& link) { return !(link.m_c0 > 0); }

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

bool BodyLinks::prepare(const btSoftBody& body, std::int64_t passes) {
  if (!kernels_) return false;
  if (!is_planned(body)) plan(body);
  if (!is_faster(passes)) return false;
  if (load_links(body)) return true;
  plan(body);
  return is_faster(passes) && load_links(body);
}

bool BodyLinks::is_planned(const btSoftBody& body) const {
  return body_ == &body && node_count_ == body.m_nodes.size() && link_count_ == body.m_links.size();
}

void BodyLinks::plan(const btSoftBody& body) {
  constexpr int max_nodes = 1 << 26;  // a link stores node offsets as 32-bit byte counts
  body_ = nullptr;
  groups_.clear();
  ends_.clear();
  bool all_nodes_own = body.m_nodes.size() <= max_nodes;
  for (int i = 0; i < body.m_links.size() && all_nodes_own; ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    const int a = index_of(body, link.m_n[0]), b = index_of(body, link.m_n[1]);
    all_nodes_own = a >= 0 && b >= 0;
    ends_.push_back(is_skipped(link) ? no_nodes : LinkEnds::value_type{a, b});
  }
  if (all_nodes_own) {
    plan_ = plan_links(ends_, body.m_nodes.size(), LinkGroup<btScalar>::links);
    nodes_.assign(static_cast<std::size_t>(plan_.nodes), {});
    dependent_links_ = count_dependent(ends_);
    groups_ = make_groups<btScalar>(plan_, ends_);
  }
  body_ = &body;
  node_count_ = body.m_nodes.size();
  link_count_ = body.m_links.size();
}

// Compares the costs in nanoseconds (AMD EPYC). Bullet takes 4.5 to solve a link, and 8.5 more for
// a dependent one. A group takes 12; reading and writing the data takes 5 per link and call.
bool BodyLinks::is_faster(std::int64_t passes) const {
  const auto links = static_cast<double>(link_count_), groups = static_cast<double>(groups_.size());
  const double grouped_ns = static_cast<double>(passes) * 12 * groups + 5 * links;
  return passes > 0 && groups > 0 &&
         grouped_ns < static_cast<double>(passes) *
                          (4.5 * links + 8.5 * static_cast<double>(dependent_links_));
}

// Returns false if the links no longer match the plan.
bool BodyLinks::load_links(const btSoftBody& body) {
  const btSoftBody::Node* const nodes = &body.m_nodes[0];
  inverse_mass_.resize(static_cast<std::size_t>(node_count_));
  for (int i = 0; i < node_count_; ++i) inverse_mass_[static_cast<std::size_t>(i)] = nodes[i].m_im;
  for (int i = 0; i < link_count_; ++i) {
    const btSoftBody::Link& link = body.m_links[i];
    const auto [index, lane] = plan_.places[i];
    if (is_skipped(link) != (index < 0)) return false;
    if (index < 0) continue;
    const auto [a, b] = ends_[i];
    if (link.m_n[0] != nodes + a || link.m_n[1] != nodes + b) return false;
    LinkGroup<btScalar>& group = groups_[index];
    group.c0[lane] = link.m_c0;
    group.c1[lane] = link.m_c1;
    group.inverse_mass[0][lane] = inverse_mass_[static_cast<std::size_t>(a)];
    group.inverse_mass[1][lane] = inverse_mass_[static_cast<std::size_t>(b)];
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
