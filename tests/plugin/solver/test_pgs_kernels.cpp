#include "solver/pgs_kernels.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>
#include <random>
#include <vector>

#include "plugin/support/named_kernels.h"
#include "solver/row_batches.h"
#include "support/catch.h"

using namespace lazyccd::bullet;

namespace {

struct Problem {
  std::vector<RowBatch> batches;
  std::vector<RowRigidTerm> parts;
  std::vector<RowBody> bodies;
  std::vector<RowCoupling> couplings;
  std::vector<Float4> displacement;

  PgsProblem swept() {
    return {batches.data(), parts.data(), bodies.data(), couplings.data(), displacement.data()};
  }
};

// A problem of random rows, some with rigid bodies, in batches whose rows share no node, but may
// share a body.
Problem random_problem(unsigned seed) {
  std::mt19937 random(seed);
  const auto within = [&](float lo, float hi) {
    return std::uniform_real_distribution<float>(lo, hi)(random);
  };
  const auto below = [&](std::int32_t count) {
    return std::uniform_int_distribution<std::int32_t>(0, count - 1)(random);
  };
  constexpr std::int32_t rows = 103, nodes = 200, bodies = 3;
  Problem problem;
  constexpr std::int32_t first_body = 1 + RowBatch::vertices, first_node = first_body + 2 * bodies;
  problem.displacement.resize(first_node + nodes);
  for (int b = 0; b < bodies; ++b) {
    RowBody body = {};
    for (int k = 0; k < 3; ++k) {
      body.inverse_mass[k] = 0.3f;
      for (int i = 0; i < 3; ++i) body.inverse_inertia[k][i] = i == k ? 0.5f : 0.01f;
    }
    problem.bodies.push_back(body);
  }
  // The last body is held at its supports: it does not move along y, and turns about y alone.
  problem.bodies.back().held = 0;
  RowCoupling& held = problem.couplings.emplace_back();
  held = {};
  held.translation_by[0][0] = held.translation_by[2][2] = 0.3f;
  held.rotation_by[4][1] = 0.5f;
  std::vector<std::array<std::int32_t, 4>> nodes_of(rows);
  std::vector<std::int32_t> body_of(rows);
  RowBatches row_batches;
  row_batches.begin(problem.displacement.size());
  for (std::int32_t row = 0; row < rows; ++row) {
    std::array<std::int32_t, 4> things;
    std::int32_t* last = things.data();
    body_of[row] = row % 3 == 0 ? below(bodies) : -1;
    // Four different nodes. A row with a rigid body has three; its last vertex belongs to the body.
    for (std::int32_t& node : nodes_of[row]) {
      const auto first = things.data();
      do {
        node = first_node + below(nodes);
      } while (std::find(first, last, node) != last);
      if (body_of[row] >= 0 && &node == &nodes_of[row].back()) {
        node = 0;
      } else {
        *last++ = node;
      }
    }
    row_batches.add(row, things.data(), last);
    // All rows are satisfied if the nodes' positions grow with their numbers, so the problem has a
    // solution.
    std::sort(nodes_of[row].rbegin(), nodes_of[row].rend());
  }
  row_batches.finish();
  for (const RowBatches::Batch& rows_of_batch : row_batches.batches()) {
    RowBatch batch = {};
    std::iota(std::begin(batch.scatter_node), std::end(batch.scatter_node), 1);
    batch.first_term = static_cast<std::int32_t>(problem.parts.size());
    for (int i = 0; i < RowBatch::lanes && rows_of_batch[i] != RowBatches::none; ++i) {
      float *const normal = batch.normal + 4 * i, *const terms = batch.terms + 4 * i;
      const float angle = within(-0.5f, 0.5f), sliding = within(-1, 1);
      normal[1] = std::cos(angle);
      normal[2] = std::sin(angle);
      batch.tangent_move[4 * i] = within(-1, 1);
      batch.tangent_move[4 * i + 1] = -sliding * normal[2];
      batch.tangent_move[4 * i + 2] = sliding * normal[1];
      constexpr float sliding_bounds[] = {0, 0.25f, -0.1f};
      batch.tangent_move[4 * i + 3] = sliding_bounds[rows_of_batch[i] % 3];
      for (int k = 0; k < 4; ++k) {
        const std::int32_t node = nodes_of[rows_of_batch[i]][k];
        batch.node[4 * i + k] = node;
        batch.scatter_node[4 * i + k] = node != 0 ? node : 1 + 4 * i + k;
        batch.weight[4 * i + k] = k < 2 ? 0.5f : -0.5f;
        if (node != 0) batch.mobility[4 * i + k] = batch.weight[4 * i + k];
      }
      terms[0] = within(-0.5f, 1);
      terms[1] = terms[3] = 0.7f;
      terms[2] = within(0, 1);
      std::fill_n(batch.compliance + 4 * i, 4, 1.4f);
      if (body_of[rows_of_batch[i]] < 0) continue;
      RowRigidTerm part = {};
      part.arm[0] = within(-1, 1);
      part.weight = -0.5f;
      part.lane = i;
      part.body = body_of[rows_of_batch[i]];
      part.translation = first_body + 2 * part.body;
      part.rotation = part.translation + 1;
      problem.parts.push_back(part);
    }
    batch.last_term = static_cast<std::int32_t>(problem.parts.size());
    problem.batches.push_back(batch);
  }
  return problem;
}

}  // namespace

TEST_CASE("a sweep is the same with every instruction set and converges to the constraints") {
  const auto solve = [](const PgsKernels& kernels, Problem& problem) {
    std::vector<std::int32_t> all;
    for (std::size_t i = 0; i < problem.batches.size(); ++i)
      all.push_back(static_cast<std::int32_t>(i));
    SweepChange change;
    for (int i = 0; i < 500; ++i) {
      change = kernels.sweep(problem.swept(), all.data(), static_cast<int>(all.size()), {});
      CHECK(problem.displacement.front().x[0] == 0);
    }
    return change;
  };
  for (unsigned number = 1; number <= 4; ++number) {
    CAPTURE(number);
    Problem expected = random_problem(number);
    const PgsKernels& baseline = *pgs_kernels("baseline");
    const SweepChange last = solve(baseline, expected);
    CHECK(last.largest < 1e-6f);
    const Float4& translation_of_held = expected.displacement[1 + RowBatch::vertices + 4];
    CHECK(translation_of_held.x[0] != 0);
    CHECK(translation_of_held.x[1] == 0);
    CHECK(baseline.max_violation(expected.swept(), static_cast<int>(expected.batches.size())) <
          1e-3f);
    // The impulses produce the displacements.
    Problem pushed = expected;
    std::fill(pushed.displacement.begin(), pushed.displacement.end(), Float4{});
    for (std::size_t i = 0; i < pushed.batches.size(); ++i)
      baseline.apply_impulses(pushed.swept(), static_cast<int>(i));
    for (std::size_t i = 0; i < pushed.displacement.size(); ++i)
      for (int k = 0; k < 4; ++k)
        CHECK(pushed.displacement[i].x[k] == Approx(expected.displacement[i].x[k]).margin(1e-3));
    for (const char* name : {"plain", "avx2", "avx512"}) {
      const PgsKernels* const kernels = named_pgs_kernels(name);
      if (!kernels) continue;
      CAPTURE(name);
      Problem problem = random_problem(number);
      const SweepChange change = solve(*kernels, problem);
      CHECK(change.largest == last.largest);
      CHECK(change.size == last.size);
      CHECK(change.restart_test == last.restart_test);
      const std::size_t bytes = problem.displacement.size() * sizeof(Float4);
      CHECK(!std::memcmp(problem.displacement.data(), expected.displacement.data(), bytes));
      CHECK(kernels->max_violation(problem.swept(), static_cast<int>(problem.batches.size())) ==
            baseline.max_violation(expected.swept(), static_cast<int>(expected.batches.size())));
    }
  }
}

TEST_CASE("friction is bounded by a fraction, by an impulse, or by Coulomb's cone") {
  // One node of mass 1 that slides on something immovable, and is pressed with an impulse of 2.
  constexpr float sliding = 8, need = 2;
  const auto friction = [&](float sliding_bound, float coefficient) {
    Problem problem;
    constexpr std::int32_t node = 1 + RowBatch::vertices;
    problem.displacement.resize(node + 1);
    RowBatch& batch = problem.batches.emplace_back();
    batch = {};
    std::iota(std::begin(batch.scatter_node), std::end(batch.scatter_node), 1);
    batch.normal[1] = batch.weight[0] = batch.mobility[0] = 1;
    batch.node[0] = batch.scatter_node[0] = node;
    batch.tangent_move[0] = sliding;
    batch.tangent_move[3] = sliding_bound;
    batch.terms[0] = need;
    batch.terms[1] = batch.terms[3] = 1;
    batch.terms[2] = coefficient;
    std::fill_n(batch.compliance, 4, 1.0f);
    const std::int32_t all = 0;
    pgs_kernels("baseline")->sweep(problem.swept(), &all, 1, {});
    CHECK(batch.impulse[3] == need);
    return -batch.impulse[0];
  };
  CHECK(friction(0, 0) == 0);
  CHECK(friction(0, 0.5f) == 0.5f * need);
  CHECK(friction(0.25f, 0.5f) == 0.25f * sliding);
  CHECK(friction(0.25f, 2) == 2 * need);
  CHECK(friction(-3, 0.5f) == 3);
  CHECK(friction(-3, 2) == 2 * need);
  CHECK(friction(-20, 0) == sliding);
}

TEST_CASE("violated rows are found among inactive ones as in the full problem") {
  Problem problem = random_problem(5);
  std::vector<std::int32_t> node_of(problem.displacement.size());
  std::iota(node_of.begin(), node_of.end(), 0);
  std::vector<std::int32_t> all;
  std::vector<InactiveBatch> inactive;
  for (const RowBatch& batch : problem.batches) {
    all.push_back(static_cast<std::int32_t>(all.size()));
    InactiveBatch& other = inactive.emplace_back();
    std::copy(std::begin(batch.normal), std::end(batch.normal), other.normal);
    std::copy(std::begin(batch.weight), std::end(batch.weight), other.weight);
    std::copy(std::begin(batch.node), std::end(batch.node), other.vertex);
    for (int i = 0; i < InactiveBatch::lanes; ++i) other.normal[4 * i + 3] = batch.terms[4 * i];
    other.first_term = batch.first_term;
    other.last_term = batch.last_term;
  }
  const auto find_violated = [&](const PgsKernels& kernels) {
    std::vector<std::int32_t> rows(InactiveBatch::lanes * inactive.size());
    rows.resize(static_cast<std::size_t>(
        kernels.find_violated(problem.swept(), node_of.data(), inactive.data(),
                              static_cast<int>(inactive.size()), rows.data())));
    return rows;
  };
  const auto check_all = [&](const std::vector<std::int32_t>& expected) {
    for (const char* name : {"plain", "baseline", "avx2", "avx512"}) {
      CAPTURE(name);
      if (const PgsKernels* kernels = named_pgs_kernels(name))
        CHECK(find_violated(*kernels) == expected);
    }
  };
  // Before any motion: the rows with a positive need are violated.
  std::vector<std::int32_t> in_need;
  for (std::size_t i = 0; i < InactiveBatch::lanes * inactive.size(); ++i)
    if (inactive[i / InactiveBatch::lanes].normal[4 * (i % InactiveBatch::lanes) + 3] > 0)
      in_need.push_back(static_cast<std::int32_t>(i));
  check_all(in_need);
  // After convergence: no row with a slightly smaller need is violated, and one with a much larger
  // need is.
  const PgsKernels& baseline = *pgs_kernels("baseline");
  for (int i = 0; i < 500; ++i)
    baseline.sweep(problem.swept(), all.data(), static_cast<int>(all.size()), {});
  for (InactiveBatch& batch : inactive)
    for (int i = 0; i < InactiveBatch::lanes; ++i) batch.normal[4 * i + 3] -= 2e-3f;
  check_all({});
  inactive[3].normal[4 * 2 + 3] += 100;
  check_all({3 * InactiveBatch::lanes + 2});
}

TEST_CASE("extrapolation adds a fraction of the last change with every instruction set") {
  for (const char* name : {"plain", "baseline", "avx2", "avx512"}) {
    const PgsKernels* const kernels = named_pgs_kernels(name);
    if (!kernels) continue;
    CAPTURE(name);
    std::vector<Float4> now(3, {{1, 2, 3, 0}}), last(3, {{1, 1, 1, 0}});
    kernels->extrapolate(0.5f, now.data(), last.data(), 2);
    for (int i = 0; i < 2; ++i) {
      CHECK(std::equal(now[i].x, now[i].x + 4, std::array<float, 4>{1, 2.5f, 4, 0}.begin()));
      CHECK(std::equal(last[i].x, last[i].x + 4, std::array<float, 4>{1, 2, 3, 0}.begin()));
    }
    CHECK(now[2].x[1] == 2);
    CHECK(last[2].x[1] == 1);
  }
}

TEST_CASE("rows of a batch share no node and each row is in one batch") {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::int32_t> any(0, 59);
  RowBatches row_batches;
  for (int run = 0; run < 3; ++run) {
    std::vector<std::array<std::int32_t, 3>> things(100);
    row_batches.begin(60);
    for (std::size_t row = 0; row < things.size(); ++row) {
      for (std::int32_t& thing : things[row]) thing = any(random);
      row_batches.add(static_cast<std::int32_t>(row), things[row].data(), things[row].data() + 3);
    }
    std::vector<int> met(things.size(), 0);
    row_batches.finish();
    for (const RowBatches::Batch& rows_of_batch : row_batches.batches()) {
      std::vector<int> moved(60, 0);
      bool ended = false;
      for (const std::int32_t row : rows_of_batch) {
        CHECK(!(ended && row != RowBatches::none));
        ended = row == RowBatches::none;
        if (ended) continue;
        ++met[row];
        std::array<std::int32_t, 3> of_row = things[row];
        std::sort(of_row.begin(), of_row.end());
        const auto last = std::unique(of_row.begin(), of_row.end());
        for (auto thing = of_row.begin(); thing != last; ++thing) CHECK(++moved[*thing] == 1);
      }
    }
    CHECK(std::count(met.begin(), met.end(), 1) == static_cast<std::ptrdiff_t>(met.size()));
  }
}
