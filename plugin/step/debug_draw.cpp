#include "step/debug_draw.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "shapes/axis_box.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

btVector3 rgb(double red, double green, double blue) {
  return btVector3(static_cast<btScalar>(red), static_cast<btScalar>(green),
                   static_cast<btScalar>(blue));
}

// A pale colour for each island. Hues a golden section of the circle apart never repeat.
btVector3 island_colour(std::size_t island) {
  const double hue = 6 * std::fmod(0.55 + 0.6180339887 * static_cast<double>(island), 1.0);
  const auto channel = [hue](double at) {  // 1 within a sixth of `at`, 0.4 opposite to it
    const double distance = std::min(std::abs(hue - at), 6 - std::abs(hue - at));
    return 0.4 + 0.6 * std::clamp(2 - distance, 0.0, 1.0);
  };
  return rgb(channel(0), channel(2), channel(4));
}

void add(std::int32_t first, std::int32_t last, const Motion& motion, AxisBox& box) {
  for (std::int32_t v = first; v < last; ++v) box.add(to_bullet(motion.end_of(v)));
}

void add(const RigidMotion& body, const Motion& motion, AxisBox& box) {
  add(body.first_vertex, body.first_vertex + body.vertex_count, motion, box);
}

void draw_box(const AxisBox& box, const btVector3& colour, btIDebugDraw& drawer) {
  if (!box.is_empty()) drawer.drawAabb(box.lower, box.upper, colour);
}

// By contact; -1: in none.
std::vector<std::int32_t> islands_of(const std::vector<StepContact>& contacts,
                                     const StepTopology& topology, const RowIslands* islands) {
  std::vector<std::int32_t> result(contacts.size(), -1);
  if (!islands) return result;
  std::unordered_map<const btCollisionObject*, std::int32_t> island_of;
  for (const StepTopology::BodyRecord& body : topology.bodies())
    island_of[body.object] = islands->of_body(topology.index_of(body));
  for (std::size_t i = 0; i < contacts.size(); ++i)
    result[i] = std::max(island_of[contacts[i].body_a], island_of[contacts[i].body_b]);
  return result;
}

class Drawing {
 public:
  Drawing(const Motion& motion, const DebugDrawOptions& options, btIDebugDraw& drawer)
      : motion_(motion), options_(options), drawer_(drawer) {}

  // `island_of`: by contact, or -1.
  void draw_contacts(const std::vector<StepContact>& contacts,
                     const std::vector<std::int32_t>& island_of) {
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const std::int32_t island = island_of[i];
      draw(contacts[i].point, static_cast<btScalar>(options_.normal_length) * contacts[i].normal,
           island < 0 ? rgb(0.5, 0.5, 0.5) : island_colour(static_cast<std::size_t>(island)));
    }
  }

  void draw_impulses(const std::vector<StepContact>& contacts,
                     const std::vector<std::int32_t>& island_of) {
    const auto impulse_of = [](const StepContact& contact) {
      return static_cast<btScalar>(contact.impulse) * contact.normal + contact.friction_impulse;
    };
    std::unordered_map<std::int32_t, btScalar> largest;  // by island
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      btScalar& length = largest[island_of[i]];
      length = std::max(length, impulse_of(contacts[i]).length());
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const btVector3 impulse = impulse_of(contacts[i]);
      if (impulse.isZero()) continue;
      const btScalar scale = static_cast<btScalar>(options_.impulse_length) / largest[island_of[i]];
      draw(contacts[i].point, scale * impulse, rgb(1, 1, 1));
    }
  }

  void draw_islands(const RowIslands& islands) {
    std::vector<AxisBox> boxes(islands.count(), AxisBox::empty());
    for (std::size_t body = 0; body < motion_.rigid_of_body().size(); ++body) {
      const std::int32_t island = islands.of_body(static_cast<std::int32_t>(body));
      if (island >= 0)
        add(motion_.first_vertex()[body], motion_.first_vertex()[body + 1], motion_, boxes[island]);
    }
    for (std::size_t i = 0; i < boxes.size(); ++i) draw_box(boxes[i], island_colour(i), drawer_);
  }

  void draw_zones(ImpactZones& impact_zones) {
    const btVector3 orange = rgb(1, 0.55, 0), red = rgb(1, 0, 0);
    std::vector<char> is_held(static_cast<std::size_t>(motion_.soft_count()));
    for (std::int32_t v = 0; v < motion_.soft_count(); ++v) is_held[v] = impact_zones.is_held(v);
    for (const ImpactZone& zone : impact_zones.list(motion_)) {
      AxisBox box = AxisBox::empty();
      for (const std::int32_t v : zone.nodes) {
        box.add(to_bullet(motion_.end_of(v)));
        if (zone.held) is_held[v] = 1;
        if (options_.zones && !zone.held) draw_cross(v, orange);
      }
      for (const int body : zone.bodies) add(motion_.rigid()[body], motion_, box);
      if (options_.zones) draw_box(box, orange, drawer_);
    }
    if (!options_.holds) return;
    for (std::int32_t v = 0; v < motion_.soft_count(); ++v)
      if (is_held[v]) draw_cross(v, red);
    for (std::size_t body = 0; body < motion_.rigid().size(); ++body) {
      if (!impact_zones.is_held(motion_.soft_count() + static_cast<std::int32_t>(body))) continue;
      AxisBox box = AxisBox::empty();
      add(motion_.rigid()[body], motion_, box);
      draw_box(box, red, drawer_);
    }
  }

 private:
  void draw(const btVector3& from, const btVector3& along, const btVector3& colour) {
    drawer_.drawLine(from, from + along, colour);
  }
  void draw_cross(std::int32_t vertex, const btVector3& colour) {
    const btVector3 at = to_bullet(motion_.end_of(vertex));
    for (int k = 0; k < 3; ++k) {
      btVector3 along(0, 0, 0);
      along[k] = static_cast<btScalar>(options_.cross_size);
      draw(at - btScalar(0.5) * along, along, colour);
    }
  }

  const Motion& motion_;
  const DebugDrawOptions& options_;
  btIDebugDraw& drawer_;
};

}  // namespace

void debug_draw(const std::vector<StepContact>& contacts, const StepTopology& topology,
                const Motion& motion, Response* response, const DebugDrawOptions& options,
                btIDebugDraw& drawer) {
  const RowIslands* const islands = response ? &response->islands(motion) : nullptr;
  ImpactZones* const zones = response ? response->zones() : nullptr;
  Drawing drawing(motion, options, drawer);
  const std::vector<std::int32_t> island_of = islands_of(contacts, topology, islands);
  if (options.contacts) drawing.draw_contacts(contacts, island_of);
  if (options.impulses) drawing.draw_impulses(contacts, island_of);
  if (options.islands && islands) drawing.draw_islands(*islands);
  if (zones) drawing.draw_zones(*zones);
  drawer.flushLines();
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
