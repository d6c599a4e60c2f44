// Exact polynomials in time over one step, with integer coefficients, and their roots.
#pragma once

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstdint>
#include <functional>
#include <optional>

namespace lazyccd::exact {

// Integer of any size. Up to 512 bits need no heap memory; that is enough for the products of
// ordinary scenes.
using Integer = boost::multiprecision::number<boost::multiprecision::cpp_int_backend<512>,
                                              boost::multiprecision::et_off>;

/// Polynomial p(t) = sum_i c[i] t^i (1-t)^(degree-i), t in [0, 1], of degree at most 4.
///
/// This basis has advantages over powers of t. A coordinate that moves linearly from x_t0 to x_t1
/// is {x_t0, x_t1}. Products are convolutions. The values at the ends are c[0] and c[degree].
/// Descartes' rule of signs applies directly, with t/(1-t) in (0, inf) as its variable: the number
/// of roots inside (0, 1), counted with multiplicity, is the number of sign changes among the c[i],
/// or less by an even number.
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
  /// Sign of the first coefficient that is not zero, which is the sign of p just after the start.
  int first_sign() const;

  // q must have the same degree.
  Polynomial& operator+=(const Polynomial& q);
  Polynomial& operator-=(const Polynomial& q);
  friend Polynomial operator+(Polynomial p, const Polynomial& q) { return p += q; }
  friend Polynomial operator-(Polynomial p, const Polynomial& q) { return p -= q; }
  friend Polynomial operator*(const Polynomial& p, const Polynomial& q);

  /// A positive multiple of p over one half of the interval, mapped to [0, 1]. Uses only additions
  /// and shifts.
  Polynomial earlier_half() const;
  Polynomial later_half() const;
  /// A positive multiple of p over [k, k+1] / 2^level, mapped to [0, 1].
  Polynomial over(const Integer& k, unsigned level) const;
  /// A positive multiple of p(k / 2^level).
  Integer value(const Integer& k, unsigned level) const;

  /// Greatest common divisor, without factors t and 1-t: its roots inside (0, 1) are the common
  /// roots of p and q.
  friend Polynomial gcd(Polynomial p, Polynomial q);
  /// A polynomial with the roots of p inside (0, 1), each of them once.
  friend Polynomial square_free(Polynomial p);

 private:
  Integer& at(int i) { return c_[static_cast<std::size_t>(i)]; }
  Polynomial reversed() const;
  void trim();

  int degree_ = 0;
  std::array<Integer, max_degree + 1> c_;
};

/// An exact time in [0, 1]: either k / 2^level, or a root of a polynomial. The root is simple and
/// the only one inside the interval (k, k+1) / 2^level. sign() and ticks() narrow the interval as
/// needed.
class Instant {
 public:
  Instant(Integer k, unsigned level) : k_(std::move(k)), level_(level), is_dyadic_(true) {}
  /// Root of `root_of`. `local` is `root_of` over the interval and has exactly one sign change.
  Instant(Integer k, unsigned level, Polynomial root_of, Polynomial local)
      : k_(std::move(k)),
        level_(level),
        is_dyadic_(false),
        root_of_(std::move(root_of)),
        local_(std::move(local)) {}

  /// Sign of p at this time: -1, 0 or 1.
  int sign(const Polynomial& p);
  /// floor(2^32 t)
  std::uint64_t ticks();

 private:
  void refine(unsigned level);
  bool narrow(unsigned bits);

  Integer k_;
  unsigned level_;
  bool is_dyadic_;
  Polynomial root_of_, local_;
};

/// Returns the first root of p in [0, 1] for which accepted() returns true, if any. p must not be
/// zero everywhere.
std::optional<Instant> first_root(const Polynomial& p,
                                  const std::function<bool(Instant&)>& accepted);

}  // namespace lazyccd::exact
