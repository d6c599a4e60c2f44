#include "gpu/gpu_detector.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <cub/device/device_radix_sort.cuh>
#include <limits>
#include <map>
#include <tuple>

#include "core/front_policy.h"
#include "cpu/decide_exactly.h"
#include "cpu/groups.h"
#include "cpu/positions.h"
#include "cpu/thread_pool.h"
#include "cpu/tree.h"
#include "gpu/device_buffer.h"
#include "gpu/leaf.cuh"
#include "gpu/narrow.cuh"
#include "gpu/pinned_buffer.h"
#include "gpu/traversal.h"

namespace lazyccd {
namespace {

using gpu::DoubleRecord;
using gpu::FloatRecord;
using gpu::HardQuery;
using gpu::SceneView;
using gpu::StepCounters;
using gpu::Survivor;

double milliseconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

class Stream {
 public:
  Stream() { LAZYCCD_CUDA_CHECK(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking)); }
  ~Stream() { static_cast<void>(cudaStreamDestroy(stream_)); }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  operator cudaStream_t() const { return stream_; }

 private:
  cudaStream_t stream_ = nullptr;
};

class Event {
 public:
  Event() { LAZYCCD_CUDA_CHECK(cudaEventCreate(&event_)); }
  ~Event() { static_cast<void>(cudaEventDestroy(event_)); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  void record(cudaStream_t stream) { LAZYCCD_CUDA_CHECK(cudaEventRecord(event_, stream)); }
  double since(const Event& start) const {
    float ms = 0;
    LAZYCCD_CUDA_CHECK(cudaEventElapsedTime(&ms, start.event_, event_));
    return ms;
  }

 private:
  cudaEvent_t event_ = nullptr;
};

template <class T>
void upload(DeviceBuffer<T>& buffer, const void* items, std::size_t count) {
  buffer.reserve(std::max<std::size_t>(count, 1));
  if (count)
    LAZYCCD_CUDA_CHECK(cudaMemcpy(buffer.data(), items, count * sizeof(T), cudaMemcpyHostToDevice));
}

int bits_for(std::size_t count) {
  int bits = 0;
  while (bits < 63 && (std::size_t{1} << bits) < count) ++bits;
  return bits;
}

std::uint32_t blocks_for(std::size_t threads, std::uint32_t block) {
  return static_cast<std::uint32_t>(std::max<std::size_t>((threads + block - 1) / block, 1));
}

// Room for one list that a step fills; grows to what a step would have needed.
struct Capacity {
  std::uint32_t value;
  bool holds(std::uint32_t count) const { return count <= value; }
  void grow_to(std::uint32_t count) { value = count + count / 4; }
};

class GpuDetector : public BackendDetector {
 public:
  explicit GpuDetector(const Options& options);
  ~GpuDetector() override;

  void set_mesh(const Mesh& mesh) override;
  Span<const Contact> detect(const Positions& start, const Positions& end, Stats& stats) override;

 private:
  // The points of time between the stages of a step.
  enum Mark { kStart, kRefitted, kTraversed, kFiltered, kDecided, kSorted, kMarks };

  void upload_mesh();
  void stage_positions(const Positions& start, const Positions& end);
  template <class Scalar>
  bool stage(const Positions& start, const Positions& end, PinnedBuffer<Scalar>& from,
             PinnedBuffer<Scalar>& to);
  void build(const Positions& start, const Positions& end);
  void upload_groups();
  void reserve_lists();
  SceneView scene_view();
  void enqueue(bool from_front, bool marks);
  template <class Scalar, class Record>
  void enqueue_stages(const Scalar* start, const Scalar* end, bool from_front, bool marks);
  void run_step(bool from_front);
  bool grow_lists(Stats& stats);
  std::size_t decide_residue(const Positions& start, const Positions& end, std::size_t certain,
                             Stats& stats);
  bool sorts_by_rank() const { return contact_capacity_.value <= 4096; }
  void drop_graphs();
  std::int64_t bytes() const;

  Options options_;
  Stream stream_;
  Event marks_[kMarks];
  Event uploaded_[2];
  std::uint32_t multiprocessors_ = 0;
  std::string device_name_;
  ThreadPool pool_;

  const Mesh* mesh_ = nullptr;
  bool mesh_uploaded_ = false, built_ = false;
  float built_area_ = 0;
  Groups groups_;
  Tree tree_;
  FrontPolicy front_policy_;
  Traversal traversal_;

  // Topology.
  DeviceBuffer<Face> faces_;
  DeviceBuffer<Edge> edges_;
  DeviceBuffer<std::int32_t> body_of_vertex_;
  DeviceBuffer<unsigned char> pinned_;
  DeviceBuffer<Body> bodies_;
  DeviceBuffer<std::uint64_t> disabled_;
  DeviceBuffer<gpu::DeviceGroup> device_groups_;
  DeviceBuffer<gpu::PrimitiveBlock> blocks_;
  DeviceBuffer<gpu::GroupBounds> bounds_;
  DeviceBuffer<std::int32_t> leaf_order_;
  DeviceBuffer<int2> node_ranges_;

  // Positions: in float where float holds all of them exactly. `to` of one step is `from` of the next
  // in a simulation, and then stays on the device.
  bool is_double_ = false, resident_ = false;
  PinnedBuffer<float> from_float_, to_float_;
  PinnedBuffer<double> from_double_, to_double_;
  DeviceBuffer<double> raw_start_, raw_end_;
  DeviceBuffer<DoubleRecord> records_;

  // The step's own.
  DeviceBuffer<gpu::SweptBox> runs_;
  DeviceBuffer<TreeNode> nodes_;
  DeviceBuffer<StepCounters> counters_;
  Capacity filtered_capacity_[2] = {{1 << 16}, {1 << 18}};
  Capacity hit_capacity_[2] = {{1 << 14}, {1 << 16}}, undecided_capacity_[2] = {{1 << 13}, {1 << 15}},
           hard_capacity_{1 << 12},
           residue_capacity_{1 << 10}, contact_capacity_{1 << 11};
  DeviceBuffer<Candidate> filtered_[2];
  DeviceBuffer<Survivor> hits_[2];
  DeviceBuffer<Candidate> undecided_[2];
  DeviceBuffer<HardQuery> hard_, residue_;
  DeviceBuffer<Contact> contacts_, sorted_;
  DeviceBuffer<std::uint64_t> keys_, sorted_keys_;
  DeviceBuffer<std::uint32_t> order_, sorted_order_;
  DeviceBuffer<char> sort_space_;
  PinnedBuffer<StepCounters> host_counters_;
  PinnedBuffer<Contact> host_contacts_;
  PinnedBuffer<HardQuery> host_residue_;
  std::uint32_t expected_contacts_ = 1024;

  // Graphs of the step by (from the front, which of the front's buffers, precision).
  std::map<std::tuple<bool, int, bool>, cudaGraphExec_t> graphs_;
};

// A front spares the device the way down the tree, level by level.
Options with_front(Options options) {
  if (options.front == FrontUse::automatic) options.front = FrontUse::on;
  return options;
}

GpuDetector::GpuDetector(const Options& options)
    : options_(with_front(options)),
      pool_(options.threads),
      front_policy_(options.front_period, options.front_ratio),
      traversal_(options_) {
  int device = 0;
  LAZYCCD_CUDA_CHECK(cudaGetDevice(&device));
  int multiprocessors = 0;
  LAZYCCD_CUDA_CHECK(
      cudaDeviceGetAttribute(&multiprocessors, cudaDevAttrMultiProcessorCount, device));
  multiprocessors_ = static_cast<std::uint32_t>(multiprocessors);
  cudaDeviceProp properties;
  int driver = 0;
  LAZYCCD_CUDA_CHECK(cudaGetDeviceProperties(&properties, device));
  LAZYCCD_CUDA_CHECK(cudaDriverGetVersion(&driver));
  device_name_ = std::string(properties.name) + ", driver for CUDA " + std::to_string(driver / 1000) +
                 "." + std::to_string(driver % 1000 / 10);
  if (options.tuning.capacity_hint) {
    for (Capacity* c : {&filtered_capacity_[0], &filtered_capacity_[1], &hit_capacity_[0],
                        &hit_capacity_[1], &undecided_capacity_[0], &undecided_capacity_[1], &hard_capacity_,
                        &residue_capacity_, &contact_capacity_})
      c->value = options.tuning.capacity_hint;
  }
  counters_.reserve(1);
  host_counters_.reserve(1);
}

GpuDetector::~GpuDetector() { drop_graphs(); }

void GpuDetector::drop_graphs() {
  for (const auto& entry : graphs_) static_cast<void>(cudaGraphExecDestroy(entry.second));
  graphs_.clear();
}

void GpuDetector::set_mesh(const Mesh& mesh) {
  mesh_ = &mesh;
  mesh_uploaded_ = built_ = resident_ = is_double_ = false;
}

void GpuDetector::upload_mesh() {
  upload(faces_, mesh_->faces().data(), mesh_->faces().size());
  upload(edges_, mesh_->edges().data(), mesh_->edges().size());
  upload(body_of_vertex_, mesh_->body_of_vertex().data(), mesh_->vertex_count());
  upload(bodies_, mesh_->bodies().data(), mesh_->body_count());
  std::vector<unsigned char> pinned(mesh_->any_pinned() ? mesh_->vertex_count() : 0);
  for (std::size_t v = 0; v < pinned.size(); ++v) pinned[v] = mesh_->pinned(static_cast<int>(v));
  upload(pinned_, pinned.data(), pinned.size());
  std::vector<std::uint64_t> disabled(mesh_->disabled_pairs().begin(), mesh_->disabled_pairs().end());
  std::sort(disabled.begin(), disabled.end());
  upload(disabled_, disabled.data(), disabled.size());
  mesh_uploaded_ = true;
  drop_graphs();
}

// Calls body(value) for every coordinate in order, as it is stored, until it returns false.
template <class Body>
void for_each_coordinate(const Positions& positions, Body&& body) {
  const auto walk = [&](auto scalar) {
    const char* at = static_cast<const char*>(positions.data());
    for (std::size_t v = 0; v < positions.count(); ++v, at += positions.stride()) {
      const auto* x = reinterpret_cast<const decltype(scalar)*>(at);
      if (!body(x[0]) || !body(x[1]) || !body(x[2])) return;
    }
  };
  if (positions.is_double()) {
    walk(double{});
  } else {
    walk(float{});
  }
}

// Copies positions packed and in Scalar; false where Scalar does not hold one exactly. The start is
// left alone where it is the end of the last step, bit by bit.
template <class Scalar>
bool GpuDetector::stage(const Positions& start, const Positions& end, PinnedBuffer<Scalar>& from,
                        PinnedBuffer<Scalar>& to) {
  const std::size_t count = 3 * mesh_->vertex_count();
  from.reserve(count);
  to.reserve(count);
  // NaN is not equal to itself: it counts as inexact here and is found on the device.
  const auto copy = [](const Positions& positions, Scalar* out) {
    bool exact = true;
    for_each_coordinate(positions, [&](auto x) {
      *out = static_cast<Scalar>(x);
      exact &= static_cast<decltype(x)>(*out++) == x;
      return true;
    });
    return exact;
  };
  const auto same = [](const Positions& positions, const Scalar* other) {
    bool equal = true;
    for_each_coordinate(positions, [&](auto x) {
      return equal = static_cast<decltype(x)>(*other++) == x;
    });
    return equal;
  };
  resident_ = resident_ && same(start, to.data());
  const bool exact_start = resident_ || copy(start, from.data());
  return copy(end, to.data()) && exact_start;
}

void GpuDetector::stage_positions(const Positions& start, const Positions& end) {
  if (!is_double_ && !stage(start, end, from_float_, to_float_)) {
    is_double_ = true;
    resident_ = false;
  }
  if (is_double_) stage(start, end, from_double_, to_double_);
  const std::size_t values = 3 * mesh_->vertex_count();
  const std::size_t size = values * (is_double_ ? sizeof(double) : sizeof(float));
  raw_start_.reserve(std::max<std::size_t>(values, 1));
  raw_end_.reserve(std::max<std::size_t>(values, 1));
  if (resident_) {
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(raw_start_.data(), raw_end_.data(), size,
                                       cudaMemcpyDeviceToDevice, stream_));
  } else {
    const void* from = is_double_ ? static_cast<const void*>(from_double_.data()) : from_float_.data();
    LAZYCCD_CUDA_CHECK(
        cudaMemcpyAsync(raw_start_.data(), from, size, cudaMemcpyHostToDevice, stream_));
  }
  const void* to = is_double_ ? static_cast<const void*>(to_double_.data()) : to_float_.data();
  LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(raw_end_.data(), to, size, cudaMemcpyHostToDevice, stream_));
  resident_ = true;
}

// Groups and tree are made on the host, once for many steps; their boxes are refitted on the device.
void GpuDetector::build(const Positions& start, const Positions& end) {
  std::vector<VertexRecord> records;
  load_records(*mesh_, start, end, pool_, records);
  groups_.build(*mesh_, records, pool_);
  tree_.build(groups_.boxes());
  upload_groups();
  upload(nodes_, tree_.nodes().data(), tree_.nodes().size());
  upload(leaf_order_, tree_.order().data(), tree_.order().size());
  static_assert(sizeof(Tree::Range) == sizeof(int2));
  upload(node_ranges_, tree_.ranges().data(), tree_.ranges().size());
  bounds_.reserve(std::max<std::size_t>(groups_.groups().size(), 1));
  runs_.reserve(groups_.groups().size() / gpu::kRun + 1);
  records_.reserve(std::max<std::size_t>(mesh_->vertex_count(), 1));
  built_ = true;
  built_area_ = 0;
  traversal_.reset(static_cast<std::uint32_t>(tree_.nodes().size()), stream_);
  front_policy_.forget();
  drop_graphs();
}

void GpuDetector::upload_groups() {
  std::vector<gpu::DeviceGroup> groups;
  std::vector<gpu::PrimitiveBlock> blocks;
  for (const Group& g : groups_.groups()) {
    gpu::DeviceGroup group{g.body, static_cast<std::int32_t>(blocks.size()), {}, g.pinned != 0};
    int place = 0;
    for (int kind = 0; kind < 3; ++kind) {
      group.count[kind] = static_cast<std::uint8_t>(g.count[kind]);
      for (int i = 0; i < g.count[kind]; ++i, ++place) {
        const Block& block = groups_.blocks()[g.first[kind] + i / kBlockLanes];
        const int lane = i % kBlockLanes;
        if (place % kBlockLanes == 0) blocks.emplace_back();
        blocks.back().names[place % kBlockLanes] = {
            block.id[lane], {block.vertex[0][lane], block.vertex[1][lane], block.vertex[2][lane]}};
      }
    }
    groups.push_back(group);
  }
  blocks.resize(blocks.size() + 4);  // what the leaf kernel's last rounds may read beyond a group
  upload(device_groups_, groups.data(), groups.size());
  upload(blocks_, blocks.data(), blocks.size());
}

void GpuDetector::reserve_lists() {
  for (int kind = 0; kind < 2; ++kind) {
    filtered_[kind].reserve(filtered_capacity_[kind].value);
    hits_[kind].reserve(hit_capacity_[kind].value);
    undecided_[kind].reserve(undecided_capacity_[kind].value);
  }
  hard_.reserve(hard_capacity_.value);
  residue_.reserve(residue_capacity_.value);
  host_residue_.reserve(residue_capacity_.value);
  host_contacts_.reserve(std::size_t{contact_capacity_.value} + residue_capacity_.value);
  const std::uint32_t contacts = contact_capacity_.value;
  if (contacts > contacts_.size() || sort_space_.size() == 0) {
    contacts_.reserve(contacts);
    sorted_.reserve(contacts);
    // The download takes what the last step makes likely, and may take places that nothing wrote.
    LAZYCCD_CUDA_CHECK(cudaMemsetAsync(sorted_.data(), 0, sorted_.bytes(), stream_));
    keys_.reserve(contacts);
    sorted_keys_.reserve(contacts);
    order_.reserve(contacts);
    sorted_order_.reserve(contacts);
    gpu::fill_order<<<blocks_for(contacts, 256), 256, 0, stream_>>>(order_.data(), contacts);
    LAZYCCD_CUDA_CHECK(cudaGetLastError());
    std::size_t space = 0;
    LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(
        nullptr, space, keys_.data(), sorted_keys_.data(), order_.data(), sorted_order_.data(),
        static_cast<int>(contacts), 0, 64, stream_));
    sort_space_.reserve(std::max<std::size_t>(space, 1));
  }
}

SceneView GpuDetector::scene_view() {
  SceneView s{};
  s.vertex_count = static_cast<std::uint32_t>(mesh_->vertex_count());
  s.group_count = static_cast<std::uint32_t>(groups_.groups().size());
  s.node_count = static_cast<std::uint32_t>(tree_.nodes().size());
  s.mesh = {reinterpret_cast<const std::int32_t(*)[3]>(faces_.data()),
            reinterpret_cast<const std::int32_t(*)[2]>(edges_.data()), body_of_vertex_.data()};
  s.pinned = mesh_->any_pinned() ? pinned_.data() : nullptr;
  s.groups = {device_groups_.data(), blocks_.data(), bounds_.data(), bodies_.data(), disabled_.data(),
              static_cast<std::uint32_t>(mesh_->disabled_pairs().size())};
  s.leaf_order = leaf_order_.data();
  s.node_ranges = node_ranges_.data();
  s.body_bits = bits_for(mesh_->body_count());
  s.a_bits = bits_for(std::max(mesh_->vertex_count(), mesh_->edges().size()));
  s.b_bits = bits_for(std::max(mesh_->faces().size(), mesh_->edges().size()));
  s.records = records_.data();
  s.runs = runs_.data();
  s.nodes = nodes_.data();
  return s;
}

template <class Scalar, class Record>
void GpuDetector::enqueue_stages(const Scalar* start, const Scalar* end, bool from_front, bool marks) {
  const SceneView scene = scene_view();
  StepCounters* counters = counters_.data();
  const auto mark = [&](Mark m) {
    if (marks) marks_[m].record(stream_);
  };
  const auto warps = [](std::size_t count) { return blocks_for(count * gpu::kWarp, 128); };
  const auto launch = [&](auto kernel, std::uint32_t blocks, std::uint32_t threads,
                          const auto&... arguments) {
    gpu::launch_behind(kernel, blocks, threads, 0, stream_, arguments...);
  };
  const std::uint32_t capacity = contact_capacity_.value;

  mark(kStart);
  LAZYCCD_CUDA_CHECK(cudaMemsetAsync(counters, 0, sizeof(StepCounters), stream_));
  if (!sorts_by_rank())
    LAZYCCD_CUDA_CHECK(
        cudaMemsetAsync(keys_.data(), 0xff, capacity * sizeof(std::uint64_t), stream_));
  gpu::load_positions<Scalar, Record>
      <<<blocks_for(scene.vertex_count, 128), 128, 0, stream_>>>(scene, start, end, counters);
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  launch(gpu::refit_groups<Record>, warps(scene.group_count), 128, scene);
  launch(gpu::refit_runs, warps(scene.group_count / gpu::kRun + 1), 128, scene, counters);
  launch(gpu::refit_nodes, warps(scene.node_count), 128, scene);
  mark(kRefitted);

  traversal_.launch(nodes_.data(), scene.groups, from_front, stream_);
  mark(kTraversed);

  const auto filtered = [&](int kind) {
    return gpu::Output<Candidate>{filtered_[kind].data(), filtered_capacity_[kind].value,
                                  &counters->filtered[kind]};
  };
  gpu::Survivors survivors{};
  for (int kind = 0; kind < 2; ++kind) {
    survivors.hits[kind] = {hits_[kind].data(), hit_capacity_[kind].value, &counters->hits[kind]};
    survivors.undecided[kind] = {undecided_[kind].data(), undecided_capacity_[kind].value,
                                 &counters->undecided[kind]};
  }
  const gpu::LeafArguments leaf{traversal_.leaf_pairs(),
                                traversal_.leaf_pair_count(),
                                traversal_.leaf_pair_capacity(),
                                {filtered(0), filtered(1)},
                                counters,
                                options_.vertex_face,
                                options_.edge_edge};
  launch(gpu::leaf_pairs<Record>, gpu::kLeafBlocks * multiprocessors_, gpu::kLeafWarps * gpu::kWarp, scene, leaf);
  mark(kFiltered);

  const gpu::ContactOutput out{{contacts_.data(), capacity, &counters->contacts},
                               keys_.data(),
                               {residue_.data(), residue_capacity_.value, &counters->residue},
                               counters};
  const gpu::Output<HardQuery> hard{hard_.data(), hard_capacity_.value, &counters->hard};
  launch(gpu::filter_at_roots<Record>, 4 * multiprocessors_, 128, scene, filtered(0), filtered(1),
         survivors);
  launch(gpu::decide<Record>, gpu::kDecideBlocks * multiprocessors_, gpu::kDecideThreads, scene, survivors,
         hard, out);
  mark(kDecided);

  if (sorts_by_rank()) {
    launch(gpu::place_by_rank, 4 * multiprocessors_, 128, out, sorted_.data());
    mark(kSorted);
    return;
  }
  // Unused places hold keys of ones and come behind all others, being behind them from the start. The
  // sort takes 8 bits a pass: what is left over below is for place_contacts, where it is little.
  std::size_t space = sort_space_.size();
  const int key_bits = std::min(2 * scene.body_bits + 1 + scene.a_bits + scene.b_bits, 64);
  const int left_over = (key_bits - scene.b_bits) % 8;
  const int first_bit = scene.b_bits + (left_over <= 1 && key_bits - scene.b_bits > 8 ? left_over : 0);
  LAZYCCD_CUDA_CHECK(cub::DeviceRadixSort::SortPairs(
      sort_space_.data(), space, keys_.data(), sorted_keys_.data(), order_.data(),
      sorted_order_.data(), static_cast<int>(capacity), first_bit, key_bits, stream_));
  launch(gpu::place_contacts, 4 * multiprocessors_, 128, out, sorted_keys_.data(), sorted_order_.data(),
         first_bit, sorted_.data());
  LAZYCCD_CUDA_CHECK(cudaGetLastError());
  mark(kSorted);
}

void GpuDetector::enqueue(bool from_front, bool marks) {
  if (is_double_) {
    enqueue_stages<double, DoubleRecord>(raw_start_.data(), raw_end_.data(), from_front, marks);
  } else {
    enqueue_stages<float, FloatRecord>(reinterpret_cast<const float*>(raw_start_.data()),
                                       reinterpret_cast<const float*>(raw_end_.data()), from_front,
                                       marks);
  }
}

// A graph saves the launches of a step; it holds addresses and capacities, so it lives until one of
// them changes.
void GpuDetector::run_step(bool from_front) {
  if (!options_.tuning.graph) {
    enqueue(from_front, true);
    return;
  }
  const auto key = std::make_tuple(from_front, traversal_.parity(), is_double_);
  auto found = graphs_.find(key);
  if (found == graphs_.end()) {
    cudaGraph_t graph = nullptr;
    LAZYCCD_CUDA_CHECK(cudaStreamBeginCapture(stream_, cudaStreamCaptureModeThreadLocal));
    enqueue(from_front, false);
    LAZYCCD_CUDA_CHECK(cudaStreamEndCapture(stream_, &graph));
    cudaGraphExec_t executable = nullptr;
    LAZYCCD_CUDA_CHECK(cudaGraphInstantiate(&executable, graph, 0));
    static_cast<void>(cudaGraphDestroy(graph));
    found = graphs_.emplace(key, executable).first;
  }
  marks_[kStart].record(stream_);
  LAZYCCD_CUDA_CHECK(cudaGraphLaunch(found->second, stream_));
  marks_[kSorted].record(stream_);
}

// Whether a list was too short for this step; then it is longer for the next try.
bool GpuDetector::grow_lists(Stats& stats) {
  const StepCounters& c = *host_counters_.data();
  bool grown = traversal_.grow(stream_);
  if (grown) ++stats.overflows;
  const std::pair<Capacity*, std::uint32_t> lists[] = {{&filtered_capacity_[0], c.filtered[0]},
                                                       {&filtered_capacity_[1], c.filtered[1]},
                                                       {&hit_capacity_[0], c.hits[0]},
                                                       {&hit_capacity_[1], c.hits[1]},
                                                       {&undecided_capacity_[0], c.undecided[0]},
                                                       {&undecided_capacity_[1], c.undecided[1]},
                                                       {&hard_capacity_, c.hard},
                                                       {&residue_capacity_, c.residue},
                                                       {&contact_capacity_, c.contacts}};
  for (const auto& [capacity, count] : lists) {
    if (capacity->holds(count)) continue;
    capacity->grow_to(count);
    ++stats.overflows;
    grown = true;
  }
  return grown;
}

// What double could not tell is decided here and merged into the contacts; returns how many there are
// now.
std::size_t GpuDetector::decide_residue(const Positions& start, const Positions& end,
                                        std::size_t certain, Stats& stats) {
  const std::uint32_t count = host_counters_.data()->residue;
  if (count == 0) return certain;
  LAZYCCD_CUDA_CHECK(cudaMemcpy(host_residue_.data(), residue_.data(), count * sizeof(HardQuery),
                                cudaMemcpyDeviceToHost));
  std::vector<Contact> found;
  for (std::uint32_t i = 0; i < count; ++i) {
    const HardQuery& query = host_residue_.data()[i];
    Contact contact;
    if (!decide_exactly(static_cast<ContactKind>(query.kind), mesh_->view(), query.pair, start, end,
                        contact))
      continue;
    found.push_back(contact);
    stats.hash += hash_share(contact);
    ++(contact.kind == ContactKind::vertex_face ? stats.contacts_vf : stats.contacts_ee);
  }
  std::sort(found.begin(), found.end());
  // From the back, so that each contact moves once, straight to its place.
  Contact* const contacts = host_contacts_.data();
  std::size_t from = certain, to = certain + found.size();
  for (std::size_t i = found.size(); i-- > 0;) {
    const Contact* place = std::lower_bound(contacts, contacts + from, found[i]);
    const std::size_t behind = static_cast<std::size_t>(contacts + from - place);
    std::memmove(contacts + (to - behind), place, behind * sizeof(Contact));
    from -= behind;
    to -= behind + 1;
    contacts[to] = found[i];
  }
  return certain + found.size();
}

Span<const Contact> GpuDetector::detect(const Positions& start, const Positions& end, Stats& stats) {
  const auto begin = std::chrono::steady_clock::now();
  check_counts(*mesh_, start, end);
  stats.backend = "cuda";
  stats.device = device_name_;
  if (mesh_->edges().empty()) return {};

  if (!mesh_uploaded_) upload_mesh();
  uploaded_[0].record(stream_);
  stage_positions(start, end);
  uploaded_[1].record(stream_);
  stats.rebuilt = !built_ || options_.rebuild_every_step;
  if (stats.rebuilt) build(start, end);
  stats.front_reused = traversal_.has_front() && front_policy_.reuse();

  for (;;) {
    reserve_lists();
    run_step(stats.front_reused);
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(host_counters_.data(), counters_.data(), sizeof(StepCounters),
                                       cudaMemcpyDeviceToHost, stream_));
    traversal_.read_counters(stream_);
    const std::uint32_t expected = std::min(expected_contacts_, contact_capacity_.value);
    LAZYCCD_CUDA_CHECK(cudaMemcpyAsync(host_contacts_.data(), sorted_.data(),
                                       expected * sizeof(Contact), cudaMemcpyDeviceToHost, stream_));
    LAZYCCD_CUDA_CHECK(cudaStreamSynchronize(stream_));
    const StepCounters& c = *host_counters_.data();
    if (c.bad_positions & 1) check_finite(*mesh_, start, end);
    if (c.bad_positions & 2)
      throw Error(ErrorCode::device, "positions beyond 2^100 are for the CPU backend");
    if (grow_lists(stats)) {
      drop_graphs();
      continue;
    }
    if (c.contacts > expected)
      LAZYCCD_CUDA_CHECK(cudaMemcpy(host_contacts_.data() + expected, sorted_.data() + expected,
                                    (c.contacts - expected) * sizeof(Contact),
                                    cudaMemcpyDeviceToHost));
    break;
  }
  traversal_.accept();
  const StepCounters& c = *host_counters_.data();
  expected_contacts_ = std::max<std::uint32_t>(c.contacts + c.contacts / 4, 1024);

  const TraversalCounters& t = traversal_.counters();
  front_policy_.saved(t.front_nodes, stats.front_reused);
  stats.groups = static_cast<std::int64_t>(groups_.groups().size());
  stats.tree_tests = static_cast<std::int64_t>(t.tree_tests);
  stats.front_nodes = static_cast<std::int64_t>(t.front_nodes);
  stats.idle_share = traversal_.idle_share();
  stats.steals = static_cast<std::int64_t>(t.steals);
  stats.overflows += static_cast<std::int64_t>(t.overflows);
  stats.group_pairs = t.leaf_pairs;
  stats.candidates_vf = c.candidates[0];
  stats.candidates_ee = c.candidates[1];
  stats.survivors_vf = c.hits[0] + c.undecided[0];
  stats.survivors_ee = c.hits[1] + c.undecided[1];
  stats.refined = c.refined;
  stats.exact = c.residue;
  stats.hash = c.hash;
  stats.contacts_vf = c.contacts_vf;
  stats.contacts_ee = c.contacts - c.contacts_vf;
  const std::size_t count = decide_residue(start, end, c.contacts, stats);

  // Surface against that of the first step after the build: beyond the ratio, the next step builds.
  if (built_area_ == 0) built_area_ = c.leaf_area;
  if (c.leaf_area > options_.rebuild_ratio * built_area_) built_ = false;

  stats.ms_upload = uploaded_[1].since(uploaded_[0]);
  stats.ms_device = marks_[kSorted].since(marks_[kStart]);
  if (!options_.tuning.graph) {
    stats.ms_refit = marks_[kRefitted].since(marks_[kStart]);
    stats.ms_traverse = marks_[kTraversed].since(marks_[kRefitted]);
    stats.ms_leaf = marks_[kFiltered].since(marks_[kTraversed]);
    stats.ms_narrow = marks_[kDecided].since(marks_[kFiltered]);
    stats.ms_sort = marks_[kSorted].since(marks_[kDecided]);
  }
  stats.ms_total = milliseconds_since(begin);
  stats.peak_bytes = bytes();
  return {host_contacts_.data(), count};
}

std::int64_t GpuDetector::bytes() const {
  std::size_t sum = traversal_.bytes() + faces_.bytes() + edges_.bytes() + body_of_vertex_.bytes() +
                    pinned_.bytes() + bodies_.bytes() + disabled_.bytes() + device_groups_.bytes() +
                    leaf_order_.bytes() + node_ranges_.bytes() + raw_start_.bytes() +
                    raw_end_.bytes() + records_.bytes() + blocks_.bytes() + bounds_.bytes() +
                    runs_.bytes() + nodes_.bytes() + hard_.bytes() + residue_.bytes() +
                    contacts_.bytes() + sorted_.bytes() + keys_.bytes() + sorted_keys_.bytes() +
                    order_.bytes() + sorted_order_.bytes() + sort_space_.bytes();
  for (int kind = 0; kind < 2; ++kind) sum += filtered_[kind].bytes() + hits_[kind].bytes() + undecided_[kind].bytes();
  return static_cast<std::int64_t>(sum);
}

}  // namespace

std::unique_ptr<BackendDetector> make_gpu_detector(const Options& options) {
  int devices = 0;
  const cudaError_t result = cudaGetDeviceCount(&devices);
  if (result != cudaSuccess || devices == 0) {
    static_cast<void>(cudaGetLastError());
    throw Error(ErrorCode::unavailable,
                std::string("no CUDA device answers (") + cudaGetErrorString(result) + ")");
  }
  return std::make_unique<GpuDetector>(options);
}

}  // namespace lazyccd
