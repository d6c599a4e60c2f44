// What a measurement ran on, and the median that is reported of it.
#pragma once

#include <string>
#include <vector>

namespace lazyccd::bench {

// Model of the processor and how many of its threads there are.
std::string machine();

double median(std::vector<double> values);

}  // namespace lazyccd::bench
