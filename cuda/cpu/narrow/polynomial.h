// Polynomials in time over one step, with integer coefficients, and their roots: all exact.
#pragma once

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>
#include <functional>
#include <optional>

namespace lazyccd::exact {

// Unbounded; up to 512 bits without the heap, which holds the products that ordinary scenes make.
using Integer = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<512>,
                                              boost::multiprecision::et_off>;

// p(t) = sum_i c[i] t^i (1-t)^(degree-i), t in [0, 1], degree at most 4.
//
// Preferred to powers of t because a coordinate that moves linearly from x_t0 to x_t1 simply is
// {x_t0, x_t1}, products are convolutions, the values at the ends are c[0] and c[degree], and
// Descartes' rule of signs applies as it stands (with t/(1-t) in (0, inf) for its variable): the
// roots inside (0, 1), counted with multiplicity, are as many as the sign changes among the c[i],
// or fewer by an even number.
class Polynomial {
 public:
  static constexpr int max_degree = 4;

  Polynomial() = default;
  Polynomial(Integer at_start, Integer at_end)
      : degree_(1), c_{std::move(at_start), std::move(at_end)} {}

  int degree() const { return degree_; }
  const Integer& operator[](int i) const { return c_[static_cast<std::size_t>(i)]; }
  bool is_zero() const;
  int sign_changes() const;
  // Sign of the first coefficient that is not zero: that of p just after the start.
  int first_sign() const;

  Polynomial& operator+=(const Polynomial& q);  // of the same degree
  Polynomial& operator-=(const Polynomial& q);
  friend Polynomial operator+(Polynomial p, const Polynomial& q) { return p += q; }
  friend Polynomial operator-(Polynomial p, const Polynomial& q) { return p -= q; }
  friend Polynomial operator*(const Polynomial& p, const Polynomial& q);

  // A positive multiple of p over a half of the interval, seen as [0, 1] again. Additions only.
  Polynomial earlier_half() const;
  Polynomial later_half() const;
  // A positive multiple of p over [k, k+1] / 2^level, seen as [0, 1].
  Polynomial over(const Integer& k, unsigned level) const;
  // A positive multiple of p(k / 2^level).
  Integer value(const Integer& k, unsigned level) const;

  // A polynomial of lowest degree whose roots inside (0, 1) are the common ones of p and q.
  friend Polynomial gcd(Polynomial p, Polynomial q);
  // The roots of p inside (0, 1), each once.
  friend Polynomial square_free(Polynomial p);

 private:
  Integer& at(int i) { return c_[static_cast<std::size_t>(i)]; }
  Polynomial reversed() const;
  void trim();

  int degree_ = 0;
  std::array<Integer, max_degree + 1> c_;
};

// A time in [0, 1]: k / 2^level, or the one root of a polynomial, a simple one, inside an interval
// (k, k+1) / 2^level that narrows as questions need it.
class Instant {
 public:
  Instant(Integer k, unsigned level) : k_(std::move(k)), level_(level), is_dyadic_(true) {}
  // `local` is `root_of` over the interval and has one sign change.
  Instant(Integer k, unsigned level, Polynomial root_of, Polynomial local)
      : k_(std::move(k)),
        level_(level),
        is_dyadic_(false),
        root_of_(std::move(root_of)),
        local_(std::move(local)) {}

  // Sign of p at this time: -1, 0 or 1.
  int sign(const Polynomial& p);
  // floor(2^32 t)
  std::uint64_t ticks();

 private:
  void refine(unsigned level);
  bool narrow(unsigned bits);

  Integer k_;
  unsigned level_;
  bool is_dyadic_;
  Polynomial root_of_, local_;
};

// The first root in [0, 1] of p, which is not zero everywhere, that is accepted.
std::optional<Instant> first_root(const Polynomial& p,
                                  const std::function<bool(Instant&)>& accepted);

}  // namespace lazyccd::exact
