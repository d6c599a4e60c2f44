// Column: a stack of points in contact, for tests of the solver.
#pragma once

#include <cstdint>
#include <vector>

#include "lazyccd/contact.h"
#include "motion/motion.h"

namespace lazyccd::test {

/// Points above each other, 10 cm apart. The lowest one is pinned. Point i is vertex 3 * i; the
/// next two vertices only complete a face. Each point is near the face below it.
struct Column {
  bullet::Motion motion;
  std::vector<Contact> contacts;

  /// `inverse_masses`: of the points above the pinned one, 1/kg.
  explicit Column(std::vector<double> inverse_masses) {
    inverse_masses.insert(inverse_masses.begin(), 0);
    const auto points = static_cast<std::int32_t>(inverse_masses.size());
    bullet::StepInput& input = motion.input();
    input.dt = 0.01;
    for (std::int32_t i = 0; i < points; ++i) {
      for (int k = 0; k < 3; ++k) {
        input.start.insert(input.start.end(), {btScalar(k), btScalar(0.1) * i, 0});
        input.inverse_mass.push_back(inverse_masses[i]);
        input.shortest_edge.push_back(1);
      }
      Contact contact = {};
      contact.kind = ContactKind::vertex_face;
      contact.primitive_a = i;
      contact.vertices = {3 * i + 3, 3 * i, 3 * i + 1, 3 * i + 2};
      contact.normal = {0, 1, 0};
      if (i + 1 < points) contacts.push_back(contact);
    }
    motion.end = input.start;
    input.first_vertex = {0, 3 * points};
    input.rigid_of_body = {-1};
  }
};

}  // namespace lazyccd::test
