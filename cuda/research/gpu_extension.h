// What the research wing adds to the GPU backend. This header is plain C++.
#pragma once

namespace lazyccd::gpu {

struct Extension;  // gpu/traversal/extension.h

namespace research {

/// Valid for ever.
const Extension& gpu_extension();

}  // namespace research
}  // namespace lazyccd::gpu
