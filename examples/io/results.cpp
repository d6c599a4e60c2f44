#include "io/results.h"

#include <cstdio>
#include <string>

#include "io/file.h"

namespace lazyccd::io {

namespace {

// Appends a double with 17 significant digits, which read back as the same double.
void append(std::string& text, double value) {
  char digits[32];
  std::snprintf(digits, sizeof(digits), "%.17g", value);
  text += digits;
}

}  // namespace

void write_contacts_csv(const std::filesystem::path& path, Span<const Contact> contacts) {
  std::string text = "kind,p0,p1,p2,p3,toi\n";
  for (const Contact& contact : contacts) {
    text += contact.kind == ContactKind::vertex_face ? "vf" : "ee";
    for (const std::int32_t vertex : contact.vertices) text += ',' + std::to_string(vertex);
    text += ',';
    append(text, contact.toi);
    text += '\n';
  }
  write_file(path, text);
}

void write_results_csv(const std::filesystem::path& path, Span<const QueryResult> results) {
  std::string text = "query_index,hit,toi\n";
  for (std::size_t i = 0; i < results.size(); ++i) {
    text += std::to_string(i) + (results[i].hit ? ",1," : ",0,");
    if (results[i].hit) {
      append(text, results[i].toi);
    } else {
      text += "inf";
    }
    text += '\n';
  }
  write_file(path, text);
}

}  // namespace lazyccd::io
