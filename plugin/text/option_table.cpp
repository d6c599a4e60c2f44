#include "text/option_table.h"

#include <cmath>
#include <locale>
#include <sstream>
#include <stdexcept>
#include <variant>

#include "step/checked_options.h"
#include "text/number_text.h"

namespace lazyccd::text {

using bullet::SolverOptions;

namespace {

using Member = std::variant<double SolverOptions::*, bool SolverOptions::*, int SolverOptions::*>;

struct Entry {
  const char* name;
  Member member;
};

const Entry entries[] = {
    {"thickness", &SolverOptions::thickness},
    {"position_correction", &SolverOptions::position_correction},
    {"restitution", &SolverOptions::restitution},
    {"restitution_threshold", &SolverOptions::restitution_threshold},
    {"friction", &SolverOptions::friction},
    {"coulomb_friction", &SolverOptions::coulomb_friction},
    {"collide_rigid", &SolverOptions::collide_rigid},
    {"obey_collision_flags", &SolverOptions::obey_collision_flags},
    {"replace_rigid_contacts", &SolverOptions::replace_rigid_contacts},
    {"contact_cache", &SolverOptions::contact_cache},
    {"fill_contact_lists", &SolverOptions::fill_contact_lists},
    {"rest_speed", &SolverOptions::rest_speed},
    {"rest_damping", &SolverOptions::rest_damping},
    {"strain_limit", &SolverOptions::strain_limit},
    {"untangling_speed", &SolverOptions::untangling_speed},
    {"measure_energy", &SolverOptions::measure_energy},
    {"max_impulse_rounds", &SolverOptions::max_impulse_rounds},
    {"solver_iterations", &SolverOptions::solver_iterations},
    {"max_zone_rounds", &SolverOptions::max_zone_rounds},
    {"jump_speed", &SolverOptions::jump_speed},
};

constexpr const char* backend_names[] = {"auto", "cpu", "cuda"};

double number(const std::string& name, const std::string& value) {
  std::istringstream digits(value);
  digits.imbue(std::locale::classic());
  double result = 0;
  if (!(digits >> result) || !digits.eof() || !std::isfinite(result))
    throw std::invalid_argument(name + ": '" + value + "' is not a number");
  return result;
}

int whole(const std::string& name, const std::string& value) {
  const double result = number(name, value);
  if (result != std::floor(result) || std::fabs(result) > 1e9)
    throw std::invalid_argument(name + ": '" + value + "' is not a whole number");
  return static_cast<int>(result);
}

bool truth(const std::string& name, const std::string& value) {
  const double result = number(name, value);
  if (result != 0 && result != 1)
    throw std::invalid_argument(name + ": '" + value + "' is neither 0 nor 1");
  return result == 1;
}

}  // namespace

void set_option(SolverOptions& options, const std::string& name, const std::string& value) {
  if (name == "threads") {
    options.detector.threads = whole(name, value);
    if (options.detector.threads < 0) throw std::invalid_argument("threads is negative");
    return;
  }
  if (name == "backend") {
    for (int i = 0; i < 3; ++i)
      if (value == backend_names[i]) {
        options.detector.backend = static_cast<Backend>(i);
        return;
      }
    throw std::invalid_argument("backend: there are auto, cpu, cuda, not '" + value + "'");
  }
  for (const Entry& entry : entries) {
    if (name != entry.name) continue;
    const SolverOptions before = options;
    if (const auto* real = std::get_if<double SolverOptions::*>(&entry.member))
      options.** real = number(name, value);
    else if (const auto* count = std::get_if<int SolverOptions::*>(&entry.member))
      options.** count = whole(name, value);
    else
      options.*std::get<bool SolverOptions::*>(entry.member) = truth(name, value);
    if (!bullet::check(options).lines.empty()) {
      options = before;
      throw std::invalid_argument(name + ": " + value + " is out of range");
    }
    return;
  }
  std::string names = "threads, backend";
  for (const Entry& entry : entries) names += std::string(", ") + entry.name;
  throw std::invalid_argument("there is no option '" + name + "'; there are " + names);
}

std::string options_text(const SolverOptions& options) {
  std::string lines = "threads " + std::to_string(options.detector.threads) + "\nbackend " +
                      backend_names[static_cast<int>(options.detector.backend)] + "\n";
  for (const Entry& entry : entries) {
    lines += std::string(entry.name) + " ";
    std::visit(
        [&](auto member) {
          using Value = std::decay_t<decltype(options.*member)>;
          if constexpr (std::is_same_v<Value, bool>)
            lines += options.*member ? "True" : "False";
          else if constexpr (std::is_same_v<Value, int>)
            lines += std::to_string(options.*member);
          else
            lines += number_text(options.*member);
        },
        entry.member);
    lines += "\n";
  }
  return lines;
}

}  // namespace lazyccd::text
