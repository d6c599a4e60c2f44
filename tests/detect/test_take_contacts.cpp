// Contacts that the caller takes over from the detector.
#include <algorithm>
#include <memory>
#include <vector>

#include "lazyccd/detector.h"
#include "models/model.h"
#include "support/catch.h"

using namespace lazyccd;

namespace {

bool same(Span<const Contact> a, Span<const Contact> b) {
  return a.size() == b.size() && contact_hash(a) == contact_hash(b) &&
         std::is_sorted(b.begin(), b.end());
}

}  // namespace

TEST_CASE("taken contacts are those of the detection, and later detections do not change them") {
  const std::unique_ptr<models::Model> model = models::make_model("funnel");
  DetectorOptions options;
  options.backend = Backend::cpu;
  Detector taking(options), reference(options);
  for (Detector* detector : {&taking, &reference}) detector->set_topology(model->topology());

  std::vector<Contact> taken, before;
  std::uint64_t hash_before = 0;
  std::size_t all = 0;
  for (int frame = 40; frame < 46; ++frame) {
    const std::vector<float> start = model->frame(frame), end = model->frame(frame + 1);
    const Positions from(start.data(), model->vertex_count()),
        to(end.data(), model->vertex_count());
    const Span<const Contact> expected = reference.detect(from, to);
    taking.detect(from, to);
    taken = taking.take_contacts(std::move(taken));
    CHECK(same(expected, taken));
    CHECK(taking.take_contacts().empty());
    CHECK(contact_hash(before) == hash_before);
    all += taken.size();
    before.swap(taken);
    hash_before = contact_hash(before);
  }
  CHECK(all > 0);
}
