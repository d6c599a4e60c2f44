// Names of the enumerations in lazyccd/algorithm.h, and their parsing.
#include <cstddef>
#include <string>

#include "lazyccd/algorithm.h"
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

const char* name(Volume volume) {
  switch (volume) {
    case Volume::box:
      return "box";
    case Volume::dop18:
      return "dop18";
    case Volume::oriented_box:
      return "oriented_box";
  }
  return "";
}

namespace {

template <class Choice, std::size_t N>
Choice parse(const char* what, const std::string& text, const Choice (&choices)[N]) {
  std::string names;
  for (const Choice choice : choices) {
    if (text == name(choice)) return choice;
    names += (names.empty() ? "" : ", ") + std::string(name(choice));
  }
  throw Error(ErrorCode::invalid_argument,
              std::string("no ") + what + " is called '" + text + "'; there are " + names);
}

}  // namespace

Strategy parse_strategy(const std::string& text) { return parse("strategy", text, kStrategies); }
Volume parse_volume(const std::string& text) { return parse("volume", text, kVolumes); }

}  // namespace lazyccd
