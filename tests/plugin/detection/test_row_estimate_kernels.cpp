// The kernels of row estimates give the same results as rows of the same contacts.
#include "detection/row_estimate_kernels.h"

#include <algorithm>
#include <cstring>
#include <random>
#include <vector>

#include "contact/contact_row.h"
#include "plugin/support/named_kernels.h"
#include "support/catch.h"

using namespace lazyccd;
using namespace lazyccd::bullet;

namespace {

// A random motion of free vertices, pinned vertices and vertices of a static rigid body.
Motion random_motion(std::mt19937& random) {
  constexpr std::size_t soft = 40, all = 50;
  std::uniform_real_distribution<double> within(-1, 1);
  Motion motion;
  motion.input().start.resize(3 * all);
  motion.end.resize(3 * all);
  for (btScalar& x : motion.input().start) x = static_cast<btScalar>(within(random));
  for (btScalar& x : motion.end) x = static_cast<btScalar>(within(random));
  for (std::size_t v = 0; v < soft; ++v) {
    motion.input().inverse_mass.push_back(v % 5 == 0 ? 0 : 1 + within(random));
    motion.input().shortest_edge.push_back(0.2 * (1 + within(random)));
  }
  RigidMotion body;
  body.inverse_mass.setZero();
  body.inverse_inertia.setZero();
  motion.input().rigid.push_back(body);
  motion.input().rigid_of_body = {-1, -1, 0};
  return motion;
}

// A random contact of soft body 0 with soft body 0 or 1 or rigid body 2. Some points are at
// vertices or on edges.
Contact random_contact(std::mt19937& random) {
  const auto below = [&](int count) { return static_cast<int>(random() % unsigned(count)); };
  Contact contact = {};
  contact.kind = below(2) ? ContactKind::vertex_face : ContactKind::edge_edge;
  contact.body_b = below(3);
  const int first_of_b = first_vertex_of_b(contact.kind);
  for (int i = 0; i < 4; ++i)
    contact.vertices[i] = contact.body_b == 2 && i >= first_of_b ? 40 + below(10) : below(40);
  constexpr float parts[] = {0, 0.25f, 0.3f, 0.5f};
  contact.u = below(8) == 0 ? 1 : parts[below(4)];
  contact.v = contact.u == 1 ? 0 : parts[below(4)];
  const double x = below(7) - 3, y = below(7) - 3, z = below(7) + 1;
  const bullet::Vector3d normal = bullet::Vector3d(x, y, z).normalized();
  contact.normal = {float(normal[0]), float(normal[1]), float(normal[2])};
  return contact;
}

RowEstimate by_row(const Contact& contact, double thickness, double position_correction,
                   const Motion& motion) {
  ContactRow row;
  make_row(contact, thickness, position_correction, motion, row);
  Vector3d move = Vector3d::Zero();
  for (int i = 0; i < 4; ++i) {
    const std::int32_t v = contact.vertices[i];
    move += row.weights[i] * (motion.end_of(v) - motion.start_of(v));
  }
  return estimate_row(row, move);
}

}  // namespace

TEST_CASE("kernels of all instruction sets and rows agree to the bit") {
  constexpr double thickness = 0.3, position_correction = 0.2;
  std::mt19937 random(1);
  for (int round = 0; round < 200; ++round) {
    const Motion motion = random_motion(random);
    const RowEstimateInput<btScalar> of = {
        motion.start().data(),         motion.end.data(),   motion.inverse_mass().data(),
        motion.shortest_edge().data(), motion.soft_count(), position_correction};
    const int count = 1 + static_cast<int>(random() % RowEstimateLanes::count);
    std::vector<Contact> contacts;
    for (int i = 0; i < count; ++i) contacts.push_back(random_contact(random));
    for (const char* isa : {"plain", "baseline", "avx2", "avx512"}) {
      const RowEstimateKernels* const kernels = named_row_estimate_kernels(isa);
      if (!kernels) continue;
      CAPTURE(isa, round);
      RowEstimateLanes lanes;
      std::fill(std::begin(lanes.thickness), std::end(lanes.thickness), thickness);
      kernels->find(of, contacts.data(), count, lanes);
      for (int i = 0; i < count; ++i) {
        const double own = thickness_of(contacts[i], motion, thickness);
        const RowEstimate row = by_row(contacts[i], own, position_correction, motion);
        CHECK(lanes.thickness[i] == own);
        CHECK(lanes.move_squared[i] == row.move_squared);
        CHECK(lanes.need[i] == row.need);
        CHECK(lanes.normal_mass[i] == row.normal_mass);
        CHECK((lanes.can_act[i] != 0) == row.can_act);
        CHECK((lanes.may_need_split[i] != 0) == row.may_need_split);
        const auto gap = [&](const std::vector<btScalar>& places) {
          const std::array<double, 4> weights = contacts[i].weights();
          Vector3d sum = Vector3d::Zero();
          for (int k = 0; k < 4; ++k)
            sum += weights[k] * Motion::read(places, contacts[i].vertices[k]);
          return sum;
        };
        CHECK(lanes.gap_squared[i] == gap(motion.start()).squaredNorm());
        CHECK(lanes.gap_dot[i] == gap(motion.start()).dot(gap(motion.end)));
      }
    }
  }
  CHECK(row_estimate_kernels("no such set") == nullptr);
}
