// Statistics of a step as text.
#pragma once

#include <lazyccd/bullet/report.h>

#include <string>

namespace lazyccd::text {

/// One line for each member: its name, a blank, its value.
std::string stats_text(const bullet::StepStats& stats);

}  // namespace lazyccd::text
