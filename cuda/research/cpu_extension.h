// What the research wing adds to the CPU backend.
#pragma once

#include "cpu/extension.h"

namespace lazyccd::research {

/// Valid for ever.
const CpuExtension& cpu_extension();

}  // namespace lazyccd::research
