#include "response/links/strain_limit.h"

#include <algorithm>

#include "settings.h"
#include "util/profile.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Bounds the length of a link. `along`: from its second vertex to its first one, metres.
LinkLimit limit_of(std::int32_t body, std::int32_t index, const LinkSolver::Link& link,
                   const Vector3d& along, double limit, const Motion& motion) {
  const auto [a, b] = link.vertices;
  LinkLimit made;
  made.body = body;
  made.link = index;
  made.vertices = link.vertices;
  made.direction = along.normalized();
  made.longest =
      std::max(limit * link.rest_length, (motion.start_of(a) - motion.start_of(b)).norm());
  made.impulse = 0;
  return made;
}

// By body: whether a contact may act on it.
ScratchVector<char> find_touched(const NearContacts& near, const Motion& motion) {
  ScratchVector<char> touched(motion.rigid_of_body().size(), 0);
  for (std::size_t i = 0; i < near.contacts.size(); ++i) {
    const Contact& contact = near.contacts[i];
    if (near.estimates[i].can_act) touched[contact.body_a] = touched[contact.body_b] = 1;
  }
  return touched;
}

}  // namespace

void StrainLimit::warm_start(const NearContacts& near, const LinkSolver& links,
                             ContactConstraints& constraints, const Motion& motion) {
  if (limit_ == 0 || !links || constraints.last_link_impulses().empty()) return;
  const ScratchVector<char> touched = find_touched(near, motion);
  ScratchVector<LinkLimit> limits;
  for (const LastLinkImpulse& last : constraints.last_link_impulses()) {
    if (!touched[last.body] || links.again(last.body) == LinkSolver::Again::never) continue;
    const Span<const LinkSolver::Link> of_body = links.links(last.body);
    if (static_cast<std::size_t>(last.link) >= of_body.size()) continue;
    const LinkSolver::Link& link = of_body[static_cast<std::size_t>(last.link)];
    const auto [a, b] = link.vertices;
    const Vector3d along = motion.start_of(a) - motion.start_of(b);
    if (link.vertices != last.vertices || along.isZero()) continue;
    limits.push_back(limit_of(last.body, last.link, link, along, limit_, motion));
    limits.back().impulse = std::max(0.0, limits.back().direction.dot(last.impulse));
  }
  constraints.add_links(limits, motion);
}

void StrainLimit::find_stretched(std::int32_t body, const LinkSolver& links, double tolerance,
                                 const Motion& motion, ScratchVector<LinkLimit>& stretched) const {
  const Span<const LinkSolver::Link> of_body = links.links(body);
  for (std::size_t i = 0; i < of_body.size(); ++i) {
    const auto [a, b] = of_body[i].vertices;
    if (!motion.is_free(a) && !motion.is_free(b)) continue;
    const Vector3d along = motion.solved[a] - motion.solved[b];
    const double least = settings::links::strain_tolerance * limit_ * of_body[i].rest_length;
    if (along.squaredNorm() <= least * least) continue;  // most links
    const LinkLimit limit =
        limit_of(body, static_cast<std::int32_t>(i), of_body[i], along, limit_, motion);
    if (along.norm() > tolerance * limit.longest + settings::solver::min_speed * motion.dt())
      stretched.push_back(limit);
  }
}

void StrainLimit::hold(Span<const std::int32_t> bodies, const LinkSolver& links, int sweeps,
                       ContactConstraints& constraints, Motion& motion) {
  if (limit_ == 0 || bodies.empty()) return;
  LAZYCCD_BT_PROFILE("strain limit");
  ScratchVector<std::int32_t> sorted(bodies.begin(), bodies.end());
  std::sort(sorted.begin(), sorted.end());
  ScratchVector<LinkLimit> first, stretched;  // of the first round, of the present one
  const auto select_islands_of = [&](const ScratchVector<LinkLimit>& limits) {
    RowIslands& islands = constraints.islands(motion);
    islands.select_none();
    for (const LinkLimit& limit : limits) islands.select_body(limit.body);
  };
  for (int round = 0; round < settings::links::strain_rounds; ++round) {
    // First every link that gets longer, or it would creep. Then only what the tolerance does not
    // allow: the rest is what sweeps leave, and there is always some.
    const double tolerance = round == 0 ? 1 : settings::links::strain_tolerance;
    stretched.clear();
    for (const std::int32_t body : sorted)
      if (links.again(body) != LinkSolver::Again::never)
        find_stretched(body, links, tolerance, motion, stretched);
    if (stretched.empty()) break;
    constraints.add_links(stretched, motion);
    select_islands_of(stretched);
    constraints.solve_impulses(motion, sweeps, ContactSolver::Manner::again);
    if (round == 0) first = stretched;
  }
  if (first.empty()) return;
  select_islands_of(first);  // which hold those of all rounds
  constraints.solve_split_impulses(motion, sweeps);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
