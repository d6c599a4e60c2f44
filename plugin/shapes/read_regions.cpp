#include "shapes/read_regions.h"

#include <algorithm>
#include <cstddef>

#include "settings.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {
namespace {

// Whether the box was once needed, and is not any more.
bool is_far_larger(const AxisBox& box, const AxisBox& needed) {
  const btVector3 size = box.upper - box.lower,
                  limit = settings::regions::largest_excess * (needed.upper - needed.lower);
  return size.x() > limit.x() || size.y() > limit.y() || size.z() > limit.z();
}

btScalar diagonal(const AxisBox& box) { return (box.upper - box.lower).length(); }

bool are_near(const AxisBox& a, const AxisBox& b) {
  AxisBox both = a;
  both.add(b);
  return diagonal(both) <= settings::regions::group_distance * (diagonal(a) + diagonal(b));
}

// What a region is needed for. `region`: empty if there is none yet.
struct Group {
  AxisBox needed, region;
};

// Adds a box, and unites it with all groups that are near.
void add(AxisBox box, std::vector<Group>& groups) {
  const auto is_near = [&box](const Group& group) { return are_near(group.needed, box); };
  for (auto near = std::find_if(groups.begin(), groups.end(), is_near); near != groups.end();
       near = std::find_if(groups.begin(), groups.end(), is_near)) {
    box.add(near->needed);
    groups.erase(near);
  }
  groups.push_back({box, AxisBox::empty()});
}

}  // namespace

AxisBox enlarged(const AxisBox& box) {
  if (box.is_empty()) return box;
  const btVector3 size = box.upper - box.lower;
  const btScalar spare = btScalar(0.25) * size[size.maxAxis()];
  return box.expanded(btScalar(0.25) * size + btVector3(spare, spare, spare));
}

AxisBox bounds_of_overlapping(Span<const AxisBox> boxes, const AxisBox& box) {
  AxisBox bounds = AxisBox::empty();
  for (const AxisBox& other : boxes)
    if (other.overlaps(box)) bounds.add(other);
  return bounds;
}

bool ReadRegions::suffice(Span<const AxisBox> needed) {
  needed_.assign(boxes_.size(), AxisBox::empty());
  bool all_inside = true;
  for (const AxisBox& box : needed) {
    const auto region = std::find_if(boxes_.begin(), boxes_.end(),
                                     [&box](const AxisBox& r) { return r.contains(box); });
    if (region == boxes_.end())
      all_inside = false;
    else
      needed_[static_cast<std::size_t>(region - boxes_.begin())].add(box);
  }
  for (std::size_t i = 0; i < boxes_.size(); ++i)
    if (needed_[i].is_empty() || is_far_larger(boxes_[i], enlarged(needed_[i]))) return false;
  return all_inside;
}

bool ReadRegions::update(Span<const AxisBox> needed) {
  if (suffice(needed)) return false;
  std::vector<Group> groups;
  bool any_too_large = false;
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    if (needed_[i].is_empty()) continue;
    const bool is_too_large = is_far_larger(boxes_[i], enlarged(needed_[i]));
    any_too_large = any_too_large || is_too_large;
    groups.push_back({needed_[i], is_too_large ? AxisBox::empty() : boxes_[i]});
  }
  for (const AxisBox& box : needed)
    if (!contain({&box, 1})) add(box, groups);
  boxes_.clear();
  for (const Group& group : groups)
    boxes_.push_back(group.region.is_empty() ? enlarged(group.needed) : group.region);
  return any_too_large;
}

bool ReadRegions::contain(Span<const AxisBox> needed) const {
  return std::all_of(needed.begin(), needed.end(), [this](const AxisBox& box) {
    return std::any_of(boxes_.begin(), boxes_.end(),
                       [&box](const AxisBox& region) { return region.contains(box); });
  });
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
