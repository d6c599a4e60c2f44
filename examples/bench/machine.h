// The name of the machine and the median, for reports of measurements.
#pragma once

#include <string>
#include <vector>

namespace lazyccd::bench {

/// Returns the model of the processor and its number of hardware threads.
std::string machine();

/// Returns the median; 0 without values.
double median(std::vector<double> values);

}  // namespace lazyccd::bench
