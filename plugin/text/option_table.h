// The options of the solvers by name, as text.
#pragma once

#include <lazyccd/bullet/options.h>

#include <string>

namespace lazyccd::text {

/// Sets the option `name`, a member of SolverOptions, or `backend` or `threads` of its detector.
/// Numbers have a point in every locale. Throws std::invalid_argument if there is no such option,
/// or if the value is not of its type or out of its range.
void set_option(bullet::SolverOptions& options, const std::string& name, const std::string& value);

/// One line for each option: its name, a blank, its value.
std::string options_text(const bullet::SolverOptions& options);

}  // namespace lazyccd::text
