// Every way to decide queries that the chart compares, LazyCCD's among them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "lazyccd/contact.h"
#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::peers {

struct Method {
  std::string name, precision;
  bool vertex_face_only;
  bool gives_time;  // its answers have a time of impact
  // Fills one answer a query and returns the processor time that the decisions took, nanoseconds.
  std::function<double(ContactKind, Span<const QueryPoints>, Span<QueryResult>)> solve;
};

std::vector<Method> all_methods();

}  // namespace lazyccd::peers
