// What the check programs print: a line for each check, and how many failed.
#pragma once

#include <cstdio>
#include <string>

namespace lazyccd {

inline int failures = 0;

inline void report(bool good, const std::string& what) {
  std::printf("%s  %s\n", good ? "PASS" : "FAIL", what.c_str());
  std::fflush(stdout);
  failures += !good;
}

}  // namespace lazyccd
