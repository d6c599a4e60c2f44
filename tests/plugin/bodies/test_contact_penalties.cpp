// The penalties of expected contacts, on several threads.
#include "bodies/contact_penalties.h"

#include <random>
#include <vector>

#include "lazyccd/threads.h"
#include "support/catch.h"

using namespace lazyccd;
using bullet::ContactPenalties;
using bullet::VectorStack;

TEST_CASE(
    "penalties have the bits of contacts added one after the other on any number of threads") {
  const int threads = GENERATE(1, 2, 3);
  const std::size_t count = GENERATE(0, 1, 700, 6000);
  CAPTURE(threads, count);
  constexpr int node_count = 2000;
  std::mt19937 random(5);
  const auto number = [&] { return static_cast<btScalar>(random() / 2147483648.0 - 1); };
  const auto vector = [&] { return btVector3(number(), number(), number()); };
  const auto nodes_of_row = [&] {
    const auto first = static_cast<int>(random() % 1900);
    return std::array<int, 4>{first, first + 60, first + 7, first + 90};
  };
  const Threads pool(threads);
  ContactPenalties penalties;
  for (int round = 0; round < 2; ++round) {  // the second time with other contacts
    std::vector<ContactPenalties::Row> rows;
    penalties.clear();
    for (std::size_t i = 0; i < count >> round; ++i) {
      rows.push_back({nodes_of_row(),
                      {number(), number(), number(), number()},
                      1 + static_cast<int>(i % 4),
                      btScalar(1.5) + number(),
                      vector()});
      penalties.add(rows.back());
    }
    VectorStack x, expected, found;
    for (int i = 0; i < node_count; ++i) {
      x.push_back(vector());
      expected.push_back(vector());
    }
    found = expected;
    for (int product = 0; product < 2; ++product) {
      for (const ContactPenalties::Row& row : rows) {
        btScalar speed = 0;
        for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k)
          speed += row.weights[k] * x[row.nodes[k]].dot(row.normal);
        const btVector3 impulse = row.penalty * speed * row.normal;
        for (std::size_t k = 0; k < static_cast<std::size_t>(row.count); ++k)
          expected[row.nodes[k]] += row.weights[k] * impulse;
      }
      penalties.multiply(x, found, [&](std::size_t n, std::size_t grain, const auto& body) {
        pool.parallel_for(n, grain, body);
      });
      int different = 0;
      for (int i = 0; i < node_count; ++i) different += !(found[i] == expected[i]);
      CHECK(different == 0);
    }
  }
}
