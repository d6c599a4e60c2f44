// Registers LazyCCD::research before the tests of a program begin.
#include "lazyccd/algorithm.h"

namespace {

[[maybe_unused]] const bool registered = (lazyccd::register_research(), true);

}  // namespace
