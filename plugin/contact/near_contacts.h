// The near contacts of a step: all pairs that the first detection finds, each with an estimate of
// its row.
#pragma once

#include "contact/contact_row.h"
#include "lazyccd/bullet/precision.h"
#include "lazyccd/span.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

/// Near contacts, sorted. Deselected pairs (NearContactSelector, Untangling) are among them, with
/// RowEstimate::can_act = false.
struct NearContacts {
  Span<const Contact> contacts;
  Span<RowEstimate> estimates;  ///< same indices as `contacts`
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
