// The exact truth about a query, found independently of the library: every polynomial with FLINT's
// integers, every root as an algebraic number (its polynomial and a ball of real arithmetic that
// holds it alone), every sign exact.
#pragma once

#include <memory>

#include "lazyccd/query.h"

namespace lazyccd::test {

class AlgebraicNumber;

class Truth {
 public:
  // As in the truth files of the test data.
  enum class Regularity {
    regular = 0,
    coplanar = 1,  // the four points lie in one plane at all times
    singular = 2,  // the normal vanished at a time that was looked at
  };

  Truth(Regularity regularity, std::shared_ptr<const AlgebraicNumber> time)
      : regularity_(regularity), time_(std::move(time)) {}

  bool hit() const { return time_ != nullptr; }
  Regularity regularity() const { return regularity_; }

  // Of the first time of contact t, where there is one:
  double toi() const;              // t, rounded
  int compare(double toi) const;   // sign of t - toi, exact
  double minus(double toi) const;  // t - toi, rounded

 private:
  Regularity regularity_;
  std::shared_ptr<const AlgebraicNumber> time_;
};

Truth find_truth(ContactKind kind, const QueryPoints& points);

}  // namespace lazyccd::test
