// Detection from device memory to device memory.
#include <algorithm>

#include "core/profile.h"
#include "gpu/device_detector.h"
#include "lazyccd/error.h"

namespace lazyccd::gpu {

void DeviceDetector::read_probe() {
  if (!probe_.under_way || !probe_.done.has_passed()) return;
  probe_.under_way = false;
  const TraversalCounters& t = step_.traversal().counters();
  front_policy_.saved(t.front_nodes, probe_.front_reused);
  if (probe_.build == builds_) learn(step_.buffers().counters());
  if (step_.grow_traversal(stream_) != 0) step_.traversal().forget_front();
  step_.grow_lists();
}

DeviceContacts DeviceDetector::detect_async(const DevicePositions& start,
                                            const DevicePositions& end, CudaStream stream,
                                            const std::uint8_t* world_mask) {
  LAZYCCD_NVTX_RANGE("detect");
  const DeviceScope scope(device_);
  const auto refuse = [](ErrorCode code, const char* what) { throw Error(code, what); };
  if (start.count() != mesh_->vertex_count() || end.count() != mesh_->vertex_count())
    refuse(ErrorCode::size_mismatch, "detect_async() needs a position for each vertex");
  if (start.is_double() != end.is_double())
    refuse(ErrorCode::invalid_argument, "start and end have different precisions");
  if (options_.separation > 0)
    refuse(ErrorCode::invalid_argument, "with a separation only detect() works");
  if (step_.needs_host_tree())
    refuse(ErrorCode::invalid_argument, "with normal cones only detect() works");
  follow(stream);
  forget_result();
  if (mesh_->edge_count() == 0) {
    publish({}, 0);
    return result_;
  }
  check_key();
  step_.retry_growth();
  read_probe();
  given_ = {};
  positions_.gather(start, end, stream);
  if (!is_built_ || options_.algorithm.rebuild_every_step) {
    step_.build(input(false, ExactStage::left_out), stream);
    count_build();
  }
  step_.reserve_lists(stream);

  had_front_ = step_.traversal().has_front();
  last_input_ =
      input(had_front_ && front_policy_.reuse(),
            exact_policy_.launches_ahead() ? ExactStage::expected : ExactStage::unexpected);
  last_input_.status = status_.data();
  if (world_mask != nullptr) last_input_.active = active_.update(*mesh_, world_mask, stream);
  step_.run(last_input_, stream);
  if (!probe_.under_way) {
    step_.download_counters(stream);
    probe_.done.record(stream);
    probe_.under_way = true;
    probe_.front_reused = last_input_.from_front;
    probe_.build = builds_;
  }
  step_.traversal().accept();
  last_done_.record(stream);
  has_step_ = has_work_ = true;
  result_ = result_on_device();
  return result_;
}

DeviceContacts DeviceDetector::synchronize(Stats& stats) {
  LAZYCCD_NVTX_RANGE("wait");
  const DeviceScope scope(device_);
  stats.backend = "cuda";
  stats.device = device_name_;
  settle();
  step_.buffers().want_columns(0);
  if (!has_step_) return result_;
  has_step_ = false;
  step_.traversal().take_back(had_front_);
  complete(last_input_, true, stats);
  if (completion_.is_on_device()) {
    result_ = result_on_device();
  } else {
    gathered_ = completion_.contacts(given_, stats);
    publish(gathered_, stats.hash);
  }
  has_result_ = true;
  return result_;
}

DeviceContacts DeviceDetector::result_on_device() {
  return {step_.buffers().sorted(), status_.data(), step_.buffers().contact_capacity(), device_};
}

void DeviceDetector::publish(Span<const Contact> contacts, std::uint64_t hash) {
  published_.reserve(std::max<std::size_t>(contacts.size(), 1));
  const DeviceStatus status{hash, static_cast<std::uint32_t>(contacts.size()), 0};
  // Ordinary host memory: each copy has been read when the call returns.
  LAZYCCD_CUDA_CHECK(
      cudaMemcpyAsync(status_.data(), &status, sizeof(status), cudaMemcpyHostToDevice, stream_));
  if (!contacts.empty())
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(published_.data(), contacts.data(),
                                       contacts.size() * sizeof(Contact), cudaMemcpyHostToDevice,
                                       stream_));
  LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream_));
  result_ = {published_.data(), status_.data(), published_.size(), device_};
}

Span<const Contact> DeviceDetector::download() {
  LAZYCCD_NVTX_RANGE("download");
  const DeviceScope scope(device_);
  if (!has_result_) return {};
  if (gathered_.data() != nullptr) return gathered_;
  return {step_.buffers().finish_contacts(), completion_.counters().contacts};
}

}  // namespace lazyccd::gpu
