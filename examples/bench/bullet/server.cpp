// The programs bullet_ccd_float and bullet_ccd_double: answer requests (protocol.h) until the input
// ends.
#include <cstdio>
#include <memory>
#include <vector>

#include "bench/bullet/ccd.h"
#include "bench/bullet/protocol.h"
#include "bench/bullet/query.h"

namespace {

using namespace lazyccd;
using namespace lazyccd::bench;

template <class T>
bool read(T* data, std::size_t count) {
  return count == 0 || std::fread(data, sizeof(T), count, stdin) == count;
}

template <class T>
void write(const T* data, std::size_t count) {
  if (count != 0) std::fwrite(data, sizeof(T), count, stdout);
}

std::unique_ptr<BulletCcd> read_mesh() {
  std::int32_t counts[2];
  if (!read(counts, 2)) return nullptr;
  const auto vertices = std::size_t(counts[0]);
  std::vector<double> start(3 * vertices), end(3 * vertices);
  std::vector<Face> faces(static_cast<std::size_t>(counts[1]));
  if (!read(start.data(), start.size()) || !read(end.data(), end.size()) ||
      !read(faces.data(), faces.size()))
    return nullptr;
  return std::make_unique<BulletCcd>(Positions(start.data(), vertices),
                                     Positions(end.data(), vertices), faces);
}

}  // namespace

int main() {
  std::unique_ptr<BulletCcd> mesh;
  Request request;
  while (read(&request, 1)) {
    if (request == Request::mesh) {
      mesh = read_mesh();
    } else if (request == Request::pass && mesh) {
      const double milliseconds = mesh->pass();
      write(&milliseconds, 1);
    } else if (request == Request::contacts && mesh) {
      const auto contacts = mesh->contacts();
      const auto count = std::int32_t(contacts.size());
      write(&count, 1);
      write(contacts.data(), contacts.size());
    } else if (request == Request::queries) {
      std::int32_t count;
      if (!read(&count, 1)) return 1;
      std::vector<QueryPoints> queries(static_cast<std::size_t>(count));
      if (!read(queries.data(), queries.size())) return 1;
      const BulletAnswers answers = bullet_queries(queries);
      write(&answers.nanoseconds, 1);
      write(answers.hits.data(), answers.hits.size());
    } else {
      return 1;
    }
    std::fflush(stdout);
  }
}
