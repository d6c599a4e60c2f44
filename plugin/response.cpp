#include "response.h"

#include <algorithm>

#include "impact_zones.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// After this many detections that held only the nodes in contact, whole bodies are held.
constexpr int node_wise_holds = 16;

bool starts_touching(const Contact& contact) { return contact.toi == 0; }

}  // namespace

Response::Response(const Options& options, ContactRows::Thickness thickness)
    : max_iterations_(options.max_iterations),
      sweeps_(options.sweeps),
      max_zones_(options.max_zones),
      rows_(std::move(thickness), options.recovery) {}

void Response::run(std::vector<Contact> contacts, const Detect& detect_all, Motion& motion,
                   StepStats& stats) {
  rows_.clear();
  motion.begin_response();

  // Pairs that touch before anything moves (bodies placed so, the lips of a cut) cannot be cleaned
  // by moving less, and have no side yet. Between bodies the motion tells it: they came from where
  // they do not go, and get one answer. Within a body they part freely.
  std::vector<Contact> touching;
  if (std::any_of(contacts.begin(), contacts.end(), starts_touching)) {
    touching = detect_all(motion.starts(), motion.starts());
  }
  const auto touches = [&touching](const Contact& contact) {
    return starts_touching(contact) &&
           std::binary_search(touching.begin(), touching.end(), contact);
  };
  const Detect detect = [&](const Positions& start, const Positions& end) {
    std::vector<Contact> found = detect_all(start, end);
    found.erase(std::remove_if(found.begin(), found.end(), touches), found.end());
    return found;
  };
  stats.touching += std::count_if(contacts.begin(), contacts.end(), touches);
  const auto parts_freely = [&](const Contact& contact) {
    return contact.body_a == contact.body_b && touches(contact);
  };
  contacts.erase(std::remove_if(contacts.begin(), contacts.end(), parts_freely), contacts.end());

  for (int i = 0; i < max_iterations_ && !contacts.empty(); ++i) {
    rows_.merge(contacts, motion);
    rows_.relax(motion, sweeps_);
    contacts = detect(motion.starts(), motion.ends());
  }
  contacts.erase(std::remove_if(contacts.begin(), contacts.end(), touches), contacts.end());
  if (contacts.empty()) return;

  rows_.merge(contacts, motion);
  ImpactZones zones(motion);
  for (int i = 0; i < max_zones_ && !contacts.empty(); ++i) {
    zones.absorb(contacts, motion);
    contacts = detect(motion.starts(), motion.ends());
  }
  stats.zone_nodes += zones.node_count();
  if (!contacts.empty()) hold_until_clean(std::move(contacts), detect, motion, stats);
}

void Response::hold_until_clean(std::vector<Contact> contacts, const Detect& detect, Motion& motion,
                                StepStats& stats) const {
  std::vector<char> held(motion.size(), 0);
  for (int i = 0; !contacts.empty(); ++i) {
    bool more = false;
    const auto hold = [&](std::int32_t v) {
      if (held[v] || motion.inverse_mass[v] == 0) return;
      held[v] = more = true;
      motion.hold(v);
    };
    for (const Contact& contact : contacts) {
      for (const std::int32_t v : contact.vertices) hold(v);
    }
    // Each round holds a node more, so this ends; holding whole bodies makes it end soon.
    if (i >= node_wise_holds) {
      for (const Contact& contact : contacts) {
        for (const std::int32_t body : {contact.body_a, contact.body_b}) {
          const std::int32_t end = motion.first_vertex[body + 1];
          for (std::int32_t v = motion.first_vertex[body]; v < end; ++v) hold(v);
        }
      }
    }
    if (!more) break;
    contacts = detect(motion.starts(), motion.ends());
  }
  for (std::size_t v = 0; v < motion.size(); ++v) {
    const auto i = static_cast<std::int32_t>(v);
    if (held[v] && motion.predicted[v] != motion.start_of(i)) ++stats.last_resorts;
  }
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
