// Contacts that bind the same points. Where a vertex lies above a vertex, every face and edge of
// the one is near every face and edge of the other, and all these pairs say what one of them says.
#pragma once

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

struct Nearness {
  double thickness;  // metres, of the pair
  double gap;        // metres, where the step begins, between the points of the contact
};

// Keeps the nearest, and of equally near ones the first, of those whose weights are on the same
// vertices, alike to 1/16, whose normals are alike to 1/4, and whose thickness is the same. `near`
// is by contact; the order stays.
void keep_distinct(std::vector<Contact>& contacts, const std::vector<Nearness>& near);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
