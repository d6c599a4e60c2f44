#include <string>

#include "lazyccd/detector.h"
#include "lazyccd/error.h"

namespace lazyccd {

const char* name(Strategy strategy) {
  switch (strategy) {
    case Strategy::lazy_stealing:
      return "lazy_stealing";
    case Strategy::lazy_stealing_greedy:
      return "lazy_stealing_greedy";
    case Strategy::static_list:
      return "static_list";
    case Strategy::task_stealing:
      return "task_stealing";
    case Strategy::guided:
      return "guided";
    case Strategy::thread_per_query:
      return "thread_per_query";
  }
  return "";
}

Strategy parse_strategy(const std::string& text) {
  std::string names;
  for (const Strategy strategy : kStrategies) {
    if (text == name(strategy)) return strategy;
    names += (names.empty() ? "" : ", ") + std::string(name(strategy));
  }
  throw Error(ErrorCode::invalid_argument,
              "no strategy is called '" + text + "'; there are " + names);
}

}  // namespace lazyccd
