// Bullet's own detection in a child process. So one run can compare both precisions of Bullet,
// whose symbols would clash within one program.
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

/// A child process that runs Bullet. Its methods throw std::runtime_error if the child ends early.
class BulletProcess {
 public:
  explicit BulletProcess(BulletPrecision precision);
  ~BulletProcess();

  /// Sets the scene of pass() and contacts(). Both work as in BulletCcd (ccd.h).
  void set_mesh(const Positions& start, const Positions& end, Span<const Face> faces);
  double pass();  // milliseconds
  std::vector<std::array<std::int32_t, 2>> contacts();

  /// Decides vertex-face queries. Sets hits[i] to 0 or 1; returns the nanoseconds of all queries.
  double queries(Span<const QueryPoints> queries, std::vector<std::uint8_t>& hits);

 private:
  struct Pipes;
  std::unique_ptr<Pipes> pipes_;
};

}  // namespace lazyccd::bench
