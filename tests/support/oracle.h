// The exact answer to a query, computed independently of the library. Polynomials have FLINT's
// integers as coefficients. A root is an algebraic number: its polynomial and a ball (Arb) that
// contains no other root. All signs are exact.
#pragma once

#include <memory>

#include "lazyccd/query.h"

namespace lazyccd::test {

class AlgebraicNumber;

/// The answer to one query.
class Truth {
 public:
  /// Values as in the truth files of the test data.
  enum class Regularity {
    regular = 0,
    coplanar = 1,  ///< the four points lie in one plane at all times
    singular = 2,  ///< the normal vanishes at one of the times that were examined
  };

  Truth(Regularity regularity, std::shared_ptr<const AlgebraicNumber> time)
      : regularity_(regularity), time_(std::move(time)) {}

  bool hit() const { return time_ != nullptr; }
  Regularity regularity() const { return regularity_; }

  // The first time of contact, t. Only if hit().
  double toi() const;              ///< t, rounded
  int compare(double toi) const;   ///< sign of t - toi, exact
  double minus(double toi) const;  ///< t - toi, rounded

 private:
  Regularity regularity_;
  std::shared_ptr<const AlgebraicNumber> time_;
};

/// Decides the query exactly. Takes milliseconds for some degenerate queries.
Truth find_truth(ContactKind kind, const QueryPoints& points);

}  // namespace lazyccd::test
