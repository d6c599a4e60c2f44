// Changes the end of a step until nothing passes through anything.
#pragma once

#include <functional>
#include <vector>

#include "contact_rows.h"
#include "lazyccd/bullet/options.h"
#include "lazyccd/bullet/report.h"
#include "motion.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

class Response {
 public:
  // The contacts of the motion from `start` to `end`, without those that nothing may be done about.
  using Detect = std::function<std::vector<Contact>(const Positions& start, const Positions& end)>;

  Response(const Options& options, ContactRows::Thickness thickness);

  // In turn, each until the step is clean: impulses; rigid impact zones; nodes held at the start of
  // the step, which is clean in the end because nothing moves any more. `contacts` are those of the
  // motion as it is.
  void run(std::vector<Contact> contacts, const Detect& detect_all, Motion& motion,
           StepStats& stats);

  // Every contact met in the last run(), sorted, each pair once.
  const std::vector<ContactRow>& rows() const { return rows_.rows(); }

 private:
  void hold_until_clean(std::vector<Contact> contacts, const Detect& detect, Motion& motion,
                        StepStats& stats) const;

  int max_iterations_, sweeps_, max_zones_;
  ContactRows rows_;
};

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
