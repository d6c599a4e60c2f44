// Contacts that bind the same points. Where a vertex lies above a vertex, every face and edge of
// the one is near every face and edge of the other, and all these pairs say what one of them says.
#pragma once

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Keeps the nearest, and of equally near ones the first, of those whose weights are on the same
// vertices, alike to 1/16, and whose normals are alike to 1/4. `gaps`, by contact: metres, between
// its points where the step begins. The order stays.
void keep_distinct(std::vector<Contact>& contacts, const std::vector<double>& gaps);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
