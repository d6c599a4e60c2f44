// The last stage of the narrow phase: any query decided exactly, at any cost.
#pragma once

#include "lazyccd/query.h"

namespace lazyccd {

// Decides the query in exact integer arithmetic. Never gives up. Finite input only.
QueryResult decide_exact(ContactKind kind, const QueryPoints& points);

// floor(2^32 t) / 2^32 where t in [0, 1] is the first time of contact: the definition of Contact::toi.

}  // namespace lazyccd
