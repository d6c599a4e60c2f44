#include <lazyccd/detector.h>

#include <cstdio>

// Constructs a detector with an option that is only in LazyCCD::research.
int main() {
  lazyccd::register_research();
  lazyccd::DetectorOptions options;
  options.algorithm.strategy = lazyccd::Strategy::guided;
  options.algorithm.volume = lazyccd::Volume::oriented_box;
  const lazyccd::Detector detector(options);
  std::printf("%s\n", detector.status().c_str());
  return 0;
}
