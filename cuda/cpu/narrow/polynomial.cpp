#include "cpu/narrow/polynomial.h"

#include <algorithm>
#include <boost/math/tools/toms748_solve.hpp>
#include <cmath>
#include <utility>
#include <vector>

namespace lazyccd::exact {

bool Polynomial::is_zero() const {
  return std::all_of(c_.begin(), c_.begin() + degree_ + 1,
                     [](const Integer& c) { return c.is_zero(); });
}

int Polynomial::sign_changes() const {
  int changes = 0, last = 0;
  for (int i = 0; i <= degree_; ++i) {
    const int sign = (*this)[i].sign();
    if (sign != 0 && last != 0 && sign != last) ++changes;
    if (sign != 0) last = sign;
  }
  return changes;
}

int Polynomial::first_sign() const {
  for (int i = 0; i <= degree_; ++i)
    if (const int sign = (*this)[i].sign()) return sign;
  return 0;
}

Polynomial& Polynomial::operator+=(const Polynomial& q) {
  for (int i = 0; i <= degree_; ++i) at(i) += q[i];
  return *this;
}

Polynomial& Polynomial::operator-=(const Polynomial& q) {
  for (int i = 0; i <= degree_; ++i) at(i) -= q[i];
  return *this;
}

Polynomial operator*(const Polynomial& p, const Polynomial& q) {
  Polynomial product;
  product.degree_ = p.degree_ + q.degree_;
  for (int i = 0; i <= p.degree_; ++i)
    for (int j = 0; j <= q.degree_; ++j) product.at(i + j) += p[i] * q[j];
  return product;
}

Polynomial Polynomial::reversed() const {
  Polynomial r = *this;
  std::reverse(r.c_.begin(), r.c_.begin() + degree_ + 1);
  return r;
}

// With t = (1 + s) / 2, t : 1-t = 2s + (1-s) : 1-s. With x = s / (1-s) this doubles x and then
// shifts the variable by one.
Polynomial Polynomial::later_half() const {
  Polynomial r = *this;
  for (int i = 0; i < degree_; ++i)
    for (int j = degree_ - 1; j >= i; --j) r.at(j) += r[j + 1];
  for (int i = 1; i <= degree_; ++i) r.at(i) <<= static_cast<unsigned>(i);
  return r;
}

Polynomial Polynomial::earlier_half() const { return reversed().later_half().reversed(); }

Polynomial Polynomial::over(const Integer& k, unsigned level) const {
  if (level == 0) return *this;
  const Integer rest = (Integer(1) << level) - k;
  const Polynomial t(k, k + 1), one_minus_t(rest, rest - 1);
  Polynomial result, power;
  result.at(0) = (*this)[degree_];
  power.at(0) = 1;
  for (int i = degree_ - 1; i >= 0; --i) {
    result = result * t;
    power = power * one_minus_t;
    for (int j = 0; j <= power.degree_; ++j) result.at(j) += (*this)[i] * power[j];
  }
  return result;
}

Integer Polynomial::value(const Integer& k, unsigned level) const {
  const Integer rest = (Integer(1) << level) - k;
  Integer result = (*this)[degree_], power = 1;
  for (int i = degree_ - 1; i >= 0; --i) {
    power *= rest;
    result = result * k + (*this)[i] * power;
  }
  return result;
}

// Removes the factors t and 1-t, which have no root inside (0, 1).
void Polynomial::trim() {
  int first = 0, last = degree_;
  while (last > 0 && (*this)[last].is_zero()) --last;
  while (first < last && (*this)[first].is_zero()) ++first;
  if (first > 0) std::rotate(c_.begin(), c_.begin() + first, c_.begin() + last + 1);
  degree_ = last - first;
}

// Euclid's algorithm on the coefficients as polynomials in t / (1-t), with subresultants (Knuth,
// The Art of Computer Programming 2, section 4.6.1, algorithm C). The size of the coefficients
// grows only linearly, and no common divisors of large integers are needed.
Polynomial gcd(Polynomial p, Polynomial q) {
  using boost::multiprecision::pow;
  p.trim();
  q.trim();
  if (p.degree() < q.degree()) std::swap(p, q);
  Integer g = 1, h = 1;
  while (q.degree() > 0) {
    const Integer leading = q[q.degree()];
    const int drop = p.degree() - q.degree();
    const unsigned power = static_cast<unsigned>(drop);
    for (int shift = drop; shift >= 0; --shift) {
      const int top = q.degree() + shift;
      const Integer factor = p[top];
      for (int i = 0; i < top; ++i) {
        p.at(i) *= leading;
        if (i >= shift) p.at(i) -= factor * q[i - shift];
      }
      p.at(top) = 0;
    }
    const Integer divisor = g * pow(h, power);
    for (int i = 0; i < q.degree(); ++i) p.at(i) /= divisor;
    while (p.degree_ > 0 && p[p.degree_].is_zero()) --p.degree_;
    std::swap(p, q);
    g = leading;
    if (drop > 0) h = pow(g, power) / pow(h, power - 1);
  }
  return q.is_zero() ? p : q;
}

Polynomial square_free(Polynomial p) {
  p.trim();
  Polynomial derivative;
  derivative.degree_ = std::max(p.degree() - 1, 0);
  for (int i = 1; i <= p.degree(); ++i) derivative.at(i - 1) = p[i] * i;
  const Polynomial d = gcd(p, derivative);
  if (d.degree() == 0) return p;
  // Computes p / d up to a factor, by long division from the highest coefficient. d divides p, so
  // there is no remainder.
  Polynomial quotient;
  quotient.degree_ = p.degree() - d.degree();
  const Integer& leading = d[d.degree()];
  for (int i = quotient.degree(); i >= 0; --i) {
    const Integer factor = p[i + d.degree()];
    for (int j = i + 1; j <= quotient.degree(); ++j) quotient.at(j) *= leading;
    quotient.at(i) = factor;
    for (int j = 0; j < i + d.degree(); ++j) {
      p.at(j) *= leading;
      if (j >= i) p.at(j) -= factor * d[j - i];
    }
  }
  return quotient;
}

// Estimates the one root of p inside (0, 1). `sign` is the sign of p at the start. Correctness does
// not depend on the estimate.
static double estimate_root(const Polynomial& p, int sign) {
  unsigned top = 0;
  for (int i = 0; i <= p.degree(); ++i)
    if (!p[i].is_zero()) top = std::max(top, static_cast<unsigned>(msb(abs(p[i]))));
  const unsigned excess = top > 62 ? top - 62 : 0;
  std::array<double, Polynomial::max_degree + 1> c{};
  for (int i = 0; i <= p.degree(); ++i)
    c[static_cast<std::size_t>(i)] = sign * static_cast<double>(Integer(p[i] >> excess));
  const auto value = [&](double t) {
    double sum = c[static_cast<std::size_t>(p.degree())], power = 1;
    for (int i = p.degree() - 1; i >= 0; --i) {
      power *= 1 - t;
      sum = sum * t + c[static_cast<std::size_t>(i)] * power;
    }
    return sum;
  };
  if (!(value(0) > 0 && value(1) < 0)) return 0.5;
  std::uintmax_t iterations = 60;
  const auto root = boost::math::tools::toms748_solve(
      value, 0.0, 1.0, boost::math::tools::eps_tolerance<double>(50), iterations);
  return 0.5 * (root.first + root.second);
}

// Narrows the interval to one of its 2^bits cells. Returns false if the root is neither in the
// estimated cell nor in a cell next to it.
bool Instant::narrow(unsigned bits) {
  const std::uint64_t cells = std::uint64_t{1} << bits;
  const int first = local_.first_sign();
  const auto sign_at = [&](std::uint64_t j) {
    return j == 0 ? first : j == cells ? -first : local_.value(j, bits).sign();
  };
  std::uint64_t j = std::min(
      static_cast<std::uint64_t>(std::ldexp(estimate_root(local_, first), static_cast<int>(bits))),
      cells - 1);
  int before = sign_at(j), after = sign_at(j + 1);
  if (before == -first) {
    after = before;
    before = sign_at(--j);
  } else if (after == first) {
    before = after;
    after = sign_at(++j + 1);
  }
  if (before == -first || after == first) return false;
  k_ = (k_ << bits) + j + (after == 0);
  level_ += bits;
  is_dyadic_ = before == 0 || after == 0;
  if (!is_dyadic_) local_ = local_.over(j, bits);
  return true;
}

// Narrows the interval to `level` by quadratic interval refinement (Abbott 2006): tries as many
// bits at once as the estimate allows.
void Instant::refine(unsigned level) {
  for (unsigned bits = 32; !is_dyadic_ && level_ < level;) {
    bits = std::min(bits, level - level_);
    if (!narrow(bits)) bits = (bits + 1) / 2;
  }
}

int Instant::sign(const Polynomial& p) {
  // On a narrow interval a sign that is not zero is almost always found, and at less cost than a
  // common divisor.
  constexpr unsigned step = 32;
  for (bool may_be_zero = true;;) {
    if (is_dyadic_) return p.value(k_, level_).sign();
    const Polynomial q = p.over(k_, level_);
    if (q.sign_changes() == 0) return q.first_sign();
    if (may_be_zero && level_ >= step) {
      // Inside the interval the divisor has at most the root of root_of_, which is simple. So an
      // odd number of sign changes means that p vanishes at it.
      if (gcd(root_of_, p).over(k_, level_).sign_changes() % 2 == 1) return 0;
      may_be_zero = false;
    }
    refine(level_ + step);
  }
}

std::uint64_t Instant::ticks() {
  constexpr unsigned bits = 32;
  refine(bits);
  const Integer ticks =
      level_ >= bits ? Integer(k_ >> (level_ - bits)) : Integer(k_ << (bits - level_));
  return static_cast<std::uint64_t>(ticks);
}

std::optional<Instant> first_root(const Polynomial& p,
                                  const std::function<bool(Instant&)>& accepted) {
  const auto try_dyadic = [&](const Integer& k, unsigned level) -> std::optional<Instant> {
    Instant t(k, level);
    return accepted(t) ? std::optional(std::move(t)) : std::nullopt;
  };
  if (p[0].is_zero())
    if (auto t = try_dyadic(0, 0)) return t;

  struct Interval {
    Integer k;
    unsigned level;
    Polynomial local;
    bool root_at_start;
  };
  const Polynomial roots = p.sign_changes() < 2 ? p : square_free(p);
  std::vector<Interval> intervals;
  intervals.push_back({0, 0, roots, false});
  while (!intervals.empty()) {
    const Interval interval = std::move(intervals.back());
    intervals.pop_back();
    if (interval.root_at_start)
      if (auto t = try_dyadic(interval.k, interval.level)) return t;
    const int changes = interval.local.sign_changes();
    if (changes == 1) {
      Instant t(interval.k, interval.level, roots, interval.local);
      if (accepted(t)) return t;
    } else if (changes > 1) {
      const Polynomial later = interval.local.later_half();
      intervals.push_back({2 * interval.k + 1, interval.level + 1, later, later[0].is_zero()});
      intervals.push_back(
          {2 * interval.k, interval.level + 1, interval.local.earlier_half(), false});
    }
  }

  if (p[p.degree()].is_zero()) return try_dyadic(1, 0);
  return std::nullopt;
}

}  // namespace lazyccd::exact
