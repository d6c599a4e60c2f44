#include "lazyccd/bullet/report.h"

namespace lazyccd::bullet {
inline namespace LAZYCCD_BULLET_PRECISION {

StepStats& StepStats::operator+=(const StepStats& s) {
  for_each_member([&](const char*, auto member) { this->*member += s.*member; });
  return *this;
}

}  // namespace LAZYCCD_BULLET_PRECISION
}  // namespace lazyccd::bullet
