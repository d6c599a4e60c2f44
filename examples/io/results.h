// Result tables as CSV.
#pragma once

#include <filesystem>

#include "lazyccd/contact.h"
#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::io {

// kind,p0,p1,p2,p3,toi; kind vf: p0 the vertex, p1 p2 p3 the face's; ee: p0 p1 one edge, p2 p3 the
// other
void write_contacts_csv(const std::filesystem::path& path, Span<const Contact> contacts);

// query_index,hit,toi; toi is inf where there is no hit
void write_results_csv(const std::filesystem::path& path, Span<const QueryResult> results);

}  // namespace lazyccd::io
