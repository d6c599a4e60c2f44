#include "response/links/link_rounds.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "contact/node_pushes.h"
#include "settings.h"
#include "util/profile.h"
#include "util/scratch_vector.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

void LinkRounds::renumber(const Renumbering& numbers) {
  const std::vector<Load> last = std::exchange(loads_, {});
  for (std::size_t body = 0; body < std::min(last.size(), numbers.bodies.size()); ++body) {
    const std::int32_t now = numbers.bodies[body];
    if (now < 0) continue;
    if (loads_.size() <= static_cast<std::size_t>(now))
      loads_.resize(static_cast<std::size_t>(now) + 1);
    loads_[now] = last[body];
  }
}

void LinkRounds::forget() {
  for (Load& load : loads_) load.push = 0;  // a weight may be in the air
}

void LinkRounds::run(const LinkSolver& links, int sweeps, ContactConstraints& constraints,
                     Motion& motion) {
  LAZYCCD_BT_PROFILE("links and contacts in turn");
  using Again = LinkSolver::Again;
  const NodePushes pushes = find_node_pushes(constraints.active_rows(), motion);
  loads_.resize(motion.rigid_of_body().size());
  ScratchVector<BodyRounds> turns;
  bool any_weighed = false;
  for (std::int32_t body = 0; body < static_cast<std::int32_t>(loads_.size()); ++body) {
    if (motion.rigid_of_body()[body] >= 0) continue;
    Load& load = loads_[body];
    const double least = load.weighed_until > time_ ? settings::links::min_weighed_fraction_to_go_on
                                                    : settings::links::min_weighed_fraction;
    // Before the rounds, contacts push nodes only as far as the first solution of the links allows.
    if (pushes.weights_press[body] && std::max(pushes.by_weights[body], load.push) > least)
      load.weighed_until = time_ + settings::links::weighed_seconds;
    const Again again = links.again(body);
    if (again == Again::never) load.apart_until = time_ + settings::links::apart_seconds;
    if (again == Again::never || pushes.largest[body] == 0) continue;
    const bool is_weighed =
        pushes.by_weights[body] > 0 && load.weighed_until > time_ && load.apart_until <= time_;
    any_weighed = any_weighed || is_weighed;
    if (again == Again::in_contact) {
      const int rounds = std::max(settings::links::min_rounds_in_contact,
                                  settings::links::rounds_by_iteration * links.iterations(body));
      if (is_weighed) {
        turns.push_back({body, std::max(rounds, settings::links::max_rounds_under_weight)});
      } else if (pushes.by_weights[body] == 0 || pushes.weights_press[body]) {
        turns.push_back({body, rounds});
      }  // else jaws grip it: links that they leave no room would throw its nodes
    } else if (again == Again::under_weight && is_weighed) {
      turns.push_back({body, settings::links::max_rounds_under_weight});
    } else if (pushes.largest[body] > settings::links::min_pushed_fraction) {
      turns.push_back({body, settings::links::max_rounds_under_load});
    }
  }
  solve_in_turn(turns, links, sweeps, constraints, motion);
  const NodePushes after =
      any_weighed ? find_node_pushes(constraints.active_rows(), motion) : pushes;
  for (std::size_t body = 0; body < loads_.size(); ++body)
    loads_[body].push = after.by_weights[body];
}

void LinkRounds::solve_in_turn(Span<const BodyRounds> turns, const LinkSolver& links, int sweeps,
                               ContactConstraints& constraints, Motion& motion) {
  if (turns.empty()) return;
  RowIslands& islands = constraints.islands(motion);
  // Bodies of the same island follow each other. An island ends when links move nothing there.
  ScratchVector<BodyRounds> going_on(turns.begin(), turns.end());
  const auto place_of = [&islands](const BodyRounds& rounds) {
    return std::make_pair(islands.of_body(rounds.body), rounds.body);
  };
  std::sort(going_on.begin(), going_on.end(),
            [&](const BodyRounds& x, const BodyRounds& y) { return place_of(x) < place_of(y); });
  for (const BodyRounds& rounds : turns) bodies_.push_back(rounds.body);
  ScratchVector<std::int32_t> bodies, moved;  // moved: one of each island in which nodes moved
  for (int i = 1; !going_on.empty(); ++i) {
    islands.select_none();
    bool any_moved = false;
    ScratchVector<BodyRounds> next;
    for (auto first = going_on.begin(); first != going_on.end();) {
      const std::int32_t island = islands.of_body(first->body);
      const auto last = std::find_if(first, going_on.end(), [&](const BodyRounds& rounds) {
        return islands.of_body(rounds.body) != island;
      });
      bodies.clear();
      for (auto rounds = first; rounds != last; ++rounds) bodies.push_back(rounds->body);
      if (links.solve(bodies, settings::links::min_link_speed * motion.dt(), motion)) {
        any_moved = true;
        islands.select_body(bodies.front());
        if (i == 1) moved.push_back(bodies.front());
        std::copy_if(first, last, std::back_inserter(next),
                     [i](const BodyRounds& rounds) { return rounds.rounds > i; });
      }
      first = last;
    }
    going_on.swap(next);
    if (!any_moved) break;
    if (i == 1) {
      constraints.solve_impulses(motion, sweeps, ContactSolver::Manner::round);
    } else {
      constraints.solve_impulses_again(motion, sweeps);
    }
  }
  if (moved.empty()) return;
  for (const BodyRounds& rounds : turns) {
    const std::int32_t body = rounds.body;
    for (std::int32_t v = motion.first_vertex()[body]; v < motion.first_vertex()[body + 1]; ++v)
      motion.round_end(v);
  }
  islands.select_none();
  for (const std::int32_t body : moved) islands.select_body(body);
  constraints.solve_split_impulses(motion, sweeps);
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
