// Detection from positions on the host to contacts on the host.
#include <chrono>

#include "core/profile.h"
#include "gpu/device_detector.h"
#include "host/scene/positions.h"

namespace lazyccd::gpu {
namespace {

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
      .count();
}

}  // namespace

void DeviceDetector::build_from_host(const Positions& start, const Positions& end) {
  LAZYCCD_NVTX_RANGE("build");
  if (step_.needs_host_tree()) {
    step_.build_on_host(start, end, pool_, stream_);
  } else {
    step_.build(input(false, ExactStage::left_out), stream_);
  }
  count_build();
}

bool DeviceDetector::run_from_host(const Positions& start, const Positions& end, Stats& stats) {
  LAZYCCD_NVTX_RANGE("detect");
  check_counts(*mesh_, start, end);
  stats.backend = "cuda";
  stats.device = device_name_;
  settle();
  forget_result();
  if (mesh_->edge_count() == 0) return false;
  check_key();

  stream_ = own_stream_;
  given_ = {&start, &end};
  step_.retry_growth();
  const bool launches_exact = options_.separation == 0 && exact_policy_.launches_ahead();
  StepInput launched;
  for (;;) {
    uploaded_[0].record(stream_);
    positions_.upload(start, end, pool_, stream_);
    uploaded_[1].record(stream_);
    stats.rebuilt = !is_built_ || options_.algorithm.rebuild_every_step;
    if (stats.rebuilt) build_from_host(start, end);
    launched = input(step_.traversal().has_front() && front_policy_.reuse(),
                     launches_exact ? ExactStage::expected : ExactStage::left_out);
    step_.reserve_lists(stream_);
    step_.run(launched, stream_);
    if (positions_.confirm_start(start, pool_, stream_)) break;
    if (stats.rebuilt) is_built_ = false;
  }
  complete(launched, true, stats);
  return true;
}

Span<const Contact> DeviceDetector::detect(const Positions& start, const Positions& end,
                                           Stats& stats) {
  const auto begin = std::chrono::steady_clock::now();
  const DeviceScope scope(device_);
  step_.buffers().want_columns(0);
  if (!run_from_host(start, end, stats)) return {};
  const Span<const Contact> contacts = completion_.contacts(given_, stats);
  stats.ms_total = milliseconds_since(begin);
  return contacts;
}

std::array<Span<const Candidate>, 2> DeviceDetector::near_pairs() {
  if (mesh_->edge_count() == 0) return {};
  const DeviceScope scope(device_);
  return {completion_.near_pairs(ContactKind::vertex_face),
          completion_.near_pairs(ContactKind::edge_edge)};
}

Span<const double> DeviceDetector::near_distances() {
  if (mesh_->edge_count() == 0) return {};
  return step_.scene().near_distances();
}

ContactColumns DeviceDetector::detect_columns(const Positions& start, const Positions& end,
                                              std::uint32_t fields, Stats& stats) {
  const auto begin = std::chrono::steady_clock::now();
  const DeviceScope scope(device_);
  step_.buffers().want_columns(fields);
  if (!run_from_host(start, end, stats)) return {};
  const ContactColumns columns =
      completion_.is_on_device() && fields != 0
          ? step_.buffers().finish_columns(stream_)
          : columns_.split(completion_.contacts(given_, stats), fields, pool_);
  stats.ms_total = milliseconds_since(begin);
  return columns;
}

}  // namespace lazyccd::gpu
