#include "gpu/scene/active_bodies.h"

#include <vector>

#include "gpu/device/kernel_chain.cuh"
#include "gpu/device/upload.h"

namespace lazyccd::gpu {
namespace {

__global__ void find_active(const std::int32_t* worlds, const std::uint8_t* mask,
                            std::uint32_t bodies, unsigned char* flags) {
  const std::uint32_t b = blockIdx.x * blockDim.x + threadIdx.x;
  if (b < bodies) flags[b] = worlds[b] < 0 || mask[worlds[b]] != 0;
}

}  // namespace

const unsigned char* ActiveBodies::update(const Mesh& mesh, const std::uint8_t* world_mask,
                                          cudaStream_t stream) {
  const std::size_t bodies = mesh.body_count();
  if (!has_worlds_) {
    std::vector<std::int32_t> worlds;
    for (const Body& body : mesh.bodies()) worlds.push_back(body.world);
    upload(worlds_, worlds.data(), bodies);
    flags_.reserve(bodies);
    // The upload goes through another stream than the kernel, which does not wait for it.
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(cudaStreamLegacy));
    has_worlds_ = true;
  }
  find_active<<<blocks_for(bodies, 256), 256, 0, stream>>>(
      worlds_.data(), world_mask, static_cast<std::uint32_t>(bodies), flags_.data());
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  return flags_.data();
}

}  // namespace lazyccd::gpu
