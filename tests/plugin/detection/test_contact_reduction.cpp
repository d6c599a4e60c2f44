// ContactReduction keeps one of several near pairs with the same closest points.
#include "detection/contact_reduction.h"

#include <algorithm>
#include <random>
#include <vector>

#include "plugin/support/contacts.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;
using lazyccd::test::contact;

namespace {

std::vector<Contact> kept(const std::vector<Contact>& contacts, const std::vector<double>& gaps) {
  std::vector<ReductionEntry> entries(contacts.size());
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    make_constraint_key(contacts[i], entries[i].key);
    entries[i].gap = gaps[i];
  }
  std::vector<Contact> kept;
  ContactReduction().reduce(entries, Threads(1));
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (entries[i].key.kind != ConstraintKey::none) kept.push_back(contacts[i]);
  return kept;
}

}  // namespace

TEST_CASE("the nearest of several pairs with nearly the same points is kept") {
  constexpr ContactKind vf = ContactKind::vertex_face, ee = ContactKind::edge_edge;
  const Contact corner = contact(vf, {7, 1, 2, 3}, 0, 0);      // 7 above 1
  const Contact other_face = contact(vf, {7, 4, 1, 3}, 1, 0);  // the same points, with another face
  Contact ends = contact(ee, {1, 2, 8, 7}, 0, 1);              // the same, as two edges, reversed
  ends.normal = {0, -1, 0};
  const Contact inside = contact(vf, {7, 1, 2, 3}, 0.25f, 0.25f);  // another point of the face
  const Contact edges = contact(ee, {1, 2, 8, 7}, 0.5f, 1);        // 7 above the middle of an edge
  const Contact beside = contact(vf, {7, 1, 2, 3}, 0.01f, 0.01f);  // nearly above 1
  Contact aslant = corner;
  aslant.normal = {0.8f, 0.6f, 0};

  const std::vector<Contact> all = {corner, other_face, ends, inside, edges, beside, aslant};
  const std::vector<Contact> first = kept(all, {1, 1, 1, 1, 1, 1, 1});
  REQUIRE(first.size() == 4);
  CHECK(first[0].vertices == corner.vertices);
  CHECK(first[1].u == inside.u);
  CHECK(first[2].kind == ee);
  CHECK(first[3].normal == aslant.normal);

  const std::vector<Contact> last = kept(all, {1, 1, 1, 1, 1, 0.9, 1});
  REQUIRE(last.size() == 4);
  CHECK(last[0].u == inside.u);
  CHECK(last[2].u == beside.u);

  const std::vector<Contact> nearer = kept(all, {0.9, 0.8, 0.7, 1, 1, 0.9, 1});
  REQUIRE(nearer.size() == 4);
  CHECK(nearer[0].kind == ee);

  CHECK(kept({}, {}).empty());
}

TEST_CASE("contacts are reduced alike on any number of threads") {
  std::mt19937 random(5);
  const auto any = [&random](int count) { return static_cast<std::int32_t>(random() % count); };
  std::vector<ReductionEntry> entries(20000);
  for (ReductionEntry& entry : entries) {
    const std::int32_t v = 10 * any(300);
    make_constraint_key(contact(ContactKind::vertex_face, {v, v + 1, v + 2, v + 3}, any(2), 0),
                        entry.key);
    entry.gap = any(4);
  }
  std::vector<std::vector<bool>> kept;
  for (const int threads : {1, 4, 4}) {
    std::vector<ReductionEntry> left = entries;
    ContactReduction().reduce(left, Threads(threads));
    kept.emplace_back();
    for (const ReductionEntry& entry : left)
      kept.back().push_back(entry.key.kind != ConstraintKey::none);
  }
  CHECK(std::count(kept[0].begin(), kept[0].end(), true) == 600);
  CHECK(kept[1] == kept[0]);
  CHECK(kept[2] == kept[0]);
}
