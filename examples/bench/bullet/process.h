// Bullet's own detection in another process, so that both its precisions can be compared in one
// run: their symbols clash within one program.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "lazyccd/query.h"
#include "lazyccd/scene.h"
#include "lazyccd/span.h"

namespace lazyccd::bench {

enum class BulletPrecision { single_precision, double_precision };

class BulletProcess {
 public:
  explicit BulletProcess(BulletPrecision precision);
  ~BulletProcess();

  // The scene of pass() and contacts() below (bullet_ccd.h).
  void set_mesh(const Positions& start, const Positions& end, Span<const Face> faces);
  double pass();  // milliseconds
  std::vector<std::array<std::int32_t, 2>> contacts();

  // The elementary vertex-face test; returns its nanoseconds in all and sets hits[i] to 0 or 1.
  double queries(Span<const QueryPoints> queries, std::vector<std::uint8_t>& hits);

 private:
  struct Pipes;
  std::unique_ptr<Pipes> pipes_;
};

}  // namespace lazyccd::bench
