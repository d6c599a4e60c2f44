// The method of conjugate residuals against Bullet's, on several threads.
#include <BulletSoftBody/btConjugateResidual.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "bodies/conjugate_residual.h"
#include "lazyccd/threads.h"
#include "support/catch.h"

using namespace lazyccd;
using bullet::VectorStack;

namespace {

// A chain of springs between masses, in the form in which Bullet takes a matrix.
struct Chain {
  VectorStack diagonal;

  void multiply(const VectorStack& x, VectorStack& b) const {
    for (int i = 0; i < x.size(); ++i) {
      b[i] = x[i] * btScalar(2.5);
      if (i > 0) b[i] -= x[i - 1];
      if (i + 1 < x.size()) b[i] -= x[i + 1];
    }
  }
  void precondition(const VectorStack& x, VectorStack& b) const {
    for (int i = 0; i < x.size(); ++i) b[i] = x[i] * diagonal[i];
  }
};

VectorStack random_vectors(int size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<btScalar> number(-1, 1);
  VectorStack vectors;
  for (int i = 0; i < size; ++i)
    vectors.push_back(btVector3(number(random), number(random), number(random)));
  return vectors;
}

void on_one_thread(std::size_t count, std::size_t,
                   const std::function<void(std::size_t, std::size_t)>& body) {
  body(0, count);
}

std::vector<int> all_of(const VectorStack& vectors) {
  std::vector<int> unknowns(static_cast<std::size_t>(vectors.size()));
  std::iota(unknowns.begin(), unknowns.end(), 0);
  return unknowns;
}

std::size_t count_different(const VectorStack& a, const VectorStack& b) {
  std::size_t different = 0;
  for (int i = 0; i < a.size(); ++i) different += !(a[i] == b[i]);
  return different;
}

}  // namespace

TEST_CASE("conjugate residuals have the bits of Bullet's method on any number of threads") {
  const int threads = GENERATE(1, 2, 3);
  const int size = GENERATE(1, 900, 5000);
  const int iterations = GENERATE(0, 1, 7, 300);
  CAPTURE(threads, size, iterations);
  Chain chain;
  chain.diagonal.resize(size, btVector3(btScalar(0.4), btScalar(0.35), btScalar(0.5)));
  const VectorStack b = random_vectors(size, 1);
  VectorStack expected = random_vectors(size, 2), found = expected;
  btConjugateResidual<Chain> bullets(iterations);
  bullets.solve(chain, expected, b);

  const Threads pool(threads);
  bullet::ConjugateResidual ours;
  ours.resize(b.size());
  ours.solve(
      all_of(b), [&](const VectorStack& x, VectorStack& out) { chain.multiply(x, out); },
      chain.diagonal, b, found, bullets.m_maxIterations, bullets.m_tolerance,
      [&](std::size_t count, std::size_t grain, const auto& body) {
        pool.parallel_for(count, grain, body);
      });
  if (iterations == 0) return;  // Bullet returns a solution that it never computed
  CHECK(count_different(expected, found) == 0);
}

TEST_CASE("conjugate residuals end when a number is not finite") {
  Chain chain;
  chain.diagonal.resize(3000, btVector3(1, 1, 1));
  VectorStack b = random_vectors(3000, 1), x = random_vectors(3000, 2);
  b[2000].setY(std::numeric_limits<btScalar>::quiet_NaN());
  bullet::ConjugateResidual ours;
  ours.resize(b.size());
  ours.solve(
      all_of(b), [&](const VectorStack& in, VectorStack& out) { chain.multiply(in, out); },
      chain.diagonal, b, x, 300, btScalar(1e-8),
      [](std::size_t count, std::size_t, const auto& body) { body(0, count); });
  CHECK(std::isnan(x[2000].y()));
}

TEST_CASE("conjugate residuals of unknowns that share nothing are those of each alone") {
  // Two chains, the unknowns of one between those of the other.
  constexpr int size = 400;
  const VectorStack b = random_vectors(2 * size, 1), start = random_vectors(2 * size, 2);
  VectorStack diagonal;
  diagonal.resize(2 * size, btVector3(btScalar(0.4), btScalar(0.4), btScalar(0.4)));
  VectorStack found = start;
  bullet::ConjugateResidual both;
  both.resize(2 * size);
  for (const int chain : {1, 0}) {
    std::vector<int> unknowns;
    VectorStack own_b, own_x, own_diagonal;
    for (int i = chain; i < 2 * size; i += 2) {
      unknowns.push_back(i);
      own_b.push_back(b[i]);
      own_x.push_back(start[i]);
      own_diagonal.push_back(diagonal[i]);
    }
    const auto multiply = [](int first, int step) {
      return [first, step](const VectorStack& x, VectorStack& out) {
        for (int i = first; i < x.size(); i += step) {
          out[i] = x[i] * btScalar(2.5);
          if (i >= step) out[i] -= x[i - step];
          if (i + step < x.size()) out[i] -= x[i + step];
        }
      };
    };
    both.solve(unknowns, multiply(chain, 2), diagonal, b, found, 300, btScalar(1e-5),
               on_one_thread);
    bullet::ConjugateResidual alone;
    alone.resize(size);
    alone.solve(all_of(own_b), multiply(0, 1), own_diagonal, own_b, own_x, 300, btScalar(1e-5),
                on_one_thread);
    for (int i = 0; i < size; ++i) CHECK(found[2 * i + chain] == own_x[i]);
  }
}
