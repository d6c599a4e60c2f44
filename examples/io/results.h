// Writers of results as CSV files. They throw Error(file) if writing fails.
#pragma once

#include <filesystem>

#include "lazyccd/contact.h"
#include "lazyccd/query.h"
#include "lazyccd/span.h"

namespace lazyccd::io {

/// Writes the columns kind,p0,p1,p2,p3,toi. Kind vf: vertex p0, face p1 p2 p3. Kind ee: edge p0 p1,
/// edge p2 p3.
void write_contacts_csv(const std::filesystem::path& path, Span<const Contact> contacts);

/// Writes the columns query_index,hit,toi. toi is inf if there is no hit.
void write_results_csv(const std::filesystem::path& path, Span<const QueryResult> results);

}  // namespace lazyccd::io
