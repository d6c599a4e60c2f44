// LazyCCD's decision in the settings that the library chooses among, for the chart; decide() of
// lazyccd/query.h is the third. The answers are the same, bit by bit.
#pragma once

#include "lazyccd/contact.h"
#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::peers {

// Arithmetic::double_only: double precision from the start, exact arithmetic for the rest.
QueryResult decide_double_only(ContactKind kind, const QueryPoints& points);

// Arithmetic::single_first as the detector runs it: the filter over many queries side by side, the
// rest one by one. Returns the processor time without that of laying the points out, which a
// detector does once a step for all pairs; nanoseconds.
double decide_in_lanes(ContactKind kind, Span<const QueryPoints> queries,
                       Span<QueryResult> answers);

}  // namespace lazyccd::peers
