// What Python reads: contacts as records, statistics as lines.
#pragma once

#include <lazyccd/bullet/report.h>
#include <lazyccd/span.h>

#include <string>

namespace lazyccd::pybullet {

/// The contacts as records of contact_dtype in lazyccd/pybullet.py, one after the other. Bodies and
/// links have PyBullet's numbers; -1: the base, or no node.
std::string contact_records(Span<const bullet::StepContact> contacts);

/// One line for each member: its name, a blank, its value.
std::string stats_text(const bullet::StepStats& stats);

}  // namespace lazyccd::pybullet
