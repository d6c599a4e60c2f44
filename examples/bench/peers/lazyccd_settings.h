// LazyCCD's elementary test in two of its settings, for the chart. decide() of lazyccd/query.h is
// the third setting. All three give the same answers, bit by bit.
#pragma once

#include "lazyccd/contact.h"
#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::peers {

/// Decides a query as with Arithmetic::double_only: in double precision first, the rest exactly.
QueryResult decide_double_only(ContactKind kind, const QueryPoints& points);

/// Decides queries as the detector does with Arithmetic::single_first: the filter takes many
/// queries at once in lanes; the rest are decided one by one. Returns the processor time in
/// nanoseconds, without the time to lay out the points, which a detector spends once a step for all
/// pairs.
double decide_in_lanes(ContactKind kind, Span<const QueryPoints> queries,
                       Span<QueryResult> answers);

}  // namespace lazyccd::peers
