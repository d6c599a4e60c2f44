// What Python reads: contacts and bodies as records.
#pragma once

#include <lazyccd/bullet/report.h>
#include <lazyccd/span.h>

#include <string>
#include <vector>

namespace lazyccd::pybullet {

/// The contacts as records of contact_dtype in lazyccd/pybullet.py, one after the other. Bodies and
/// links have PyBullet's numbers; -1: the base, or no node.
std::string contact_records(Span<const bullet::StepContact> contacts);

/// Three 32-bit integers for each body: its number in PyBullet, the node or -1, the reason.
std::string excluded_records(const std::vector<bullet::ExcludedBody>& bodies);

}  // namespace lazyccd::pybullet
