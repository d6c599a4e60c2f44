// Contacts that bind the same points. Where a vertex lies above a vertex, every face and edge of
// the one is near every face and edge of the other, and all these pairs say what one of them says.
#pragma once

#include <vector>

#include "lazyccd/bullet/precision.h"
#include "lazyccd/contact.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

// Keeps the first of those whose weights are on the same vertices, alike to 1/256, and whose time
// and thickness, by contact, are the same.
void keep_distinct(std::vector<Contact>& contacts, const std::vector<double>& thickness);

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
