// The methods to decide queries that the chart compares, including LazyCCD's.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::peers {

/// One method in one precision.
struct Method {
  std::string name, precision;
  bool vertex_face_only;
  bool gives_time;  // the answers have a time of impact
  /// Writes one answer a query. Returns the processor time of the decisions, nanoseconds.
  std::function<double(ContactKind, Span<const QueryPoints>, Span<QueryResult>)> solve;
};

std::vector<Method> all_methods();

}  // namespace lazyccd::peers
