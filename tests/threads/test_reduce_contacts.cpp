// Near contacts of a device are reduced on several threads.
#include <memory>
#include <vector>

#include "cpu/cpu_detector.h"
#include "host/scene/mesh.h"
#include "lazyccd/detector.h"
#include "models/model.h"
#include "support/catch.h"

using namespace lazyccd;

TEST_CASE("near contacts of a device are reduced alike with any number of threads") {
  const std::unique_ptr<models::Model> model = models::make_model("funnel");
  const std::vector<float> start = model->frame(40), end = model->frame(41);
  const Positions from(start.data(), model->vertex_count()), to(end.data(), model->vertex_count());
  DetectorOptions options;
  options.backend = Backend::cpu;
  options.separation = 0.02;
  Detector everything(options);
  everything.set_topology(model->topology());
  const Span<const Contact> found = everything.detect(from, to);
  const std::vector<Contact> contacts(found.begin(), found.end());
  REQUIRE(contacts.size() > 2000);  // several ranges

  options.reduce_contacts = true;
  const Mesh mesh(model->topology());
  std::vector<std::uint64_t> hashes;
  for (const int threads : {1, 2, 4}) {
    options.threads = threads;
    CpuDetector reducer(options, Threads(threads));
    reducer.set_mesh(mesh);
    Stats stats;
    for (int i = 0; i < 3; ++i) {
      const Span<const Contact> kept = reducer.reduce_contacts(contacts, from, to, stats);
      CHECK(kept.size() < contacts.size());
      CHECK(!kept.empty());
      hashes.push_back(contact_hash(kept));
    }
  }
  for (const std::uint64_t hash : hashes) CHECK(hash == hashes.front());
}
