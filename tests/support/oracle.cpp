#include "support/oracle.h"

// FLINT 2 (Debian 12) has Arb beside it, FLINT 3 (Ubuntu 24.04) inside.
#include <flint/fmpz_poly.h>
#include <flint/fmpz_poly_factor.h>
#if __has_include(<flint/arb_fmpz_poly.h>)
#include <flint/acb.h>
#include <flint/arb_fmpz_poly.h>
#else
#include <acb.h>
#include <arb_fmpz_poly.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace lazyccd::test {
namespace {

class Int {
 public:
  Int() { fmpz_init(value_); }
  Int(const Int& other) { fmpz_init_set(value_, other.value_); }
  ~Int() { fmpz_clear(value_); }
  Int& operator=(const Int& other) {
    fmpz_set(value_, other.value_);
    return *this;
  }
  fmpz* get() { return value_; }
  const fmpz* get() const { return value_; }

 private:
  fmpz_t value_;
};

// c0 + c1 t + c2 t^2 + ...
class Poly {
 public:
  Poly() { fmpz_poly_init(value_); }
  Poly(const Int& c0, const Int& c1) : Poly() {
    fmpz_poly_set_coeff_fmpz(value_, 0, c0.get());
    fmpz_poly_set_coeff_fmpz(value_, 1, c1.get());
  }
  Poly(slong c0, slong c1) : Poly() {
    fmpz_poly_set_coeff_si(value_, 0, c0);
    fmpz_poly_set_coeff_si(value_, 1, c1);
  }
  explicit Poly(const fmpz_poly_struct* p) : Poly() { fmpz_poly_set(value_, p); }
  Poly(const Poly& other) : Poly(other.value_) {}
  Poly(Poly&& other) noexcept : Poly() { fmpz_poly_swap(value_, other.value_); }
  ~Poly() { fmpz_poly_clear(value_); }
  Poly& operator=(Poly other) {
    fmpz_poly_swap(value_, other.value_);
    return *this;
  }
  fmpz_poly_struct* get() { return value_; }
  const fmpz_poly_struct* get() const { return value_; }

  slong degree() const { return fmpz_poly_degree(value_); }
  bool is_zero() const { return fmpz_poly_is_zero(value_); }
  friend Poly operator+(Poly a, const Poly& b) {
    fmpz_poly_add(a.value_, a.value_, b.value_);
    return a;
  }
  friend Poly operator-(Poly a, const Poly& b) {
    fmpz_poly_sub(a.value_, a.value_, b.value_);
    return a;
  }
  friend Poly operator*(const Poly& a, const Poly& b) {
    Poly c;
    fmpz_poly_mul(c.value_, a.value_, b.value_);
    return c;
  }
  friend bool operator==(const Poly& a, const Poly& b) {
    return fmpz_poly_equal(a.value_, b.value_);
  }

 private:
  fmpz_poly_t value_;
};

class Ball {
 public:
  Ball() { arb_init(value_); }
  explicit Ball(const arb_struct* x) : Ball() { arb_set(value_, x); }
  Ball(const Ball& other) : Ball(other.value_) {}
  ~Ball() { arb_clear(value_); }
  Ball& operator=(const Ball& other) {
    arb_set(value_, other.value_);
    return *this;
  }
  arb_struct* get() { return value_; }
  const arb_struct* get() const { return value_; }

 private:
  arb_t value_;
};

// The real roots of a square-free polynomial, ascending.
std::vector<Ball> real_roots(const Poly& p, slong precision) {
  const slong n = p.degree();
  std::vector<Ball> roots;
  if (n < 1) return roots;
  const acb_ptr all = _acb_vec_init(n);
  arb_fmpz_poly_complex_roots(all, p.get(), 0, precision);
  for (slong i = 0; i < n; ++i)
    if (arb_is_zero(acb_imagref(all + i))) roots.emplace_back(acb_realref(all + i));
  _acb_vec_clear(all, n);
  std::sort(roots.begin(), roots.end(), [](const Ball& a, const Ball& b) {
    return arf_cmp(arb_midref(a.get()), arb_midref(b.get())) < 0;
  });
  return roots;
}

}  // namespace

// One real root of a square-free polynomial. Questions may narrow the ball and simplify the
// polynomial; the number stays what it is.
class AlgebraicNumber {
 public:
  static constexpr slong first_precision = 128;  // bits

  AlgebraicNumber(Poly p, std::size_t index, Ball ball)
      : p_(std::move(p)), index_(index), ball_(std::move(ball)) {}

  static AlgebraicNumber rational(slong numerator, slong denominator) {
    const Poly p(-numerator, denominator);
    return {p, 0, real_roots(p, first_precision)[0]};
  }

  int sign(const Poly& q) const {
    Ball value;
    for (bool may_vanish = true;;) {
      arb_fmpz_poly_evaluate_arb(value.get(), q.get(), ball_.get(), 2 * precision_);
      if (arb_is_zero(value.get())) return 0;
      if (arb_is_positive(value.get())) return 1;
      if (arb_is_negative(value.get())) return -1;
      if (may_vanish) {
        make_minimal();
        Poly quotient;
        if (fmpz_poly_divides(quotient.get(), q.get(), p_.get())) return 0;
        may_vanish = false;
      }
      refine();
    }
  }

  friend bool operator<(const AlgebraicNumber& a, const AlgebraicNumber& b) {
    while (arb_overlaps(a.ball_.get(), b.ball_.get())) {
      a.make_minimal();
      b.make_minimal();
      if (a.p_ == b.p_ && a.index_ == b.index_) return false;
      a.refine();
      b.refine();
    }
    return arb_lt(a.ball_.get(), b.ball_.get());
  }

  double minus(double x) const {
    arf_t y;
    arf_init(y);
    arf_set_d(y, x);
    Ball difference;
    arb_sub_arf(difference.get(), ball_.get(), y, precision_);
    arf_clear(y);
    return arf_get_d(arb_midref(difference.get()), ARF_RND_NEAR);
  }

 private:
  // Twice the precision: by Newton's method on intervals, m - p(m) / p'(ball) for the middle m,
  // which keeps the root inside; where that fails, from scratch.
  void refine() const {
    precision_ *= 2;
    Poly derivative;
    fmpz_poly_derivative(derivative.get(), p_.get());
    Ball middle, value, slope, next;
    while (arb_rel_accuracy_bits(ball_.get()) < precision_) {
      const slong working = 2 * precision_;
      arb_fmpz_poly_evaluate_arb(slope.get(), derivative.get(), ball_.get(), working);
      arb_get_mid_arb(middle.get(), ball_.get());
      arb_fmpz_poly_evaluate_arb(value.get(), p_.get(), middle.get(), working);
      arb_div(value.get(), value.get(), slope.get(), working);
      arb_sub(next.get(), middle.get(), value.get(), working);
      const slong before = arb_rel_accuracy_bits(ball_.get());
      if (arb_contains_zero(slope.get()) ||
          !arb_intersection(next.get(), next.get(), ball_.get(), working) ||
          arb_rel_accuracy_bits(next.get()) < before + 16) {
        ball_ = real_roots(p_, precision_)[index_];
        return;
      }
      ball_ = next;
    }
  }

  // From here on p_ is irreducible and primitive, with a positive leading coefficient.
  void make_minimal() const {
    if (is_minimal_) return;
    fmpz_poly_factor_t factors;
    fmpz_poly_factor_init(factors);
    fmpz_poly_factor(factors, p_.get());
    while (!is_minimal_) {
      std::vector<AlgebraicNumber> same;
      for (slong i = 0; i < factors->num; ++i) {
        const Poly factor(factors->p + i);
        const std::vector<Ball> roots = real_roots(factor, precision_);
        for (std::size_t j = 0; j < roots.size(); ++j)
          if (arb_overlaps(roots[j].get(), ball_.get())) same.emplace_back(factor, j, roots[j]);
      }
      if (same.size() == 1) {
        p_ = same[0].p_;
        index_ = same[0].index_;
        ball_ = same[0].ball_;
        is_minimal_ = true;
      } else {
        refine();
      }
    }
    fmpz_poly_factor_clear(factors);
  }

  mutable Poly p_;
  mutable std::size_t index_;
  mutable Ball ball_;
  mutable slong precision_ = first_precision;
  mutable bool is_minimal_ = false;
};

namespace {

// True where the Bernstein coefficients over [0, 1] are all of one sign.
bool has_no_root_by_hull(const Poly& p) {
  const slong n = p.degree();
  Int a, c, binomial;
  int sign = 0;
  for (slong i = 0; i <= n; ++i) {
    fmpz_zero(c.get());
    for (slong j = 0; j <= i; ++j) {
      fmpz_poly_get_coeff_fmpz(a.get(), p.get(), j);
      fmpz_bin_uiui(binomial.get(), static_cast<ulong>(n - j), static_cast<ulong>(i - j));
      fmpz_addmul(c.get(), a.get(), binomial.get());
    }
    const int s = fmpz_sgn(c.get());
    if (s == 0 || (sign != 0 && s != sign)) return false;
    sign = s;
  }
  return true;
}

// Appends the roots in [0, 1], ascending.
void append_roots(const Poly& p, std::vector<AlgebraicNumber>& out) {
  if (p.degree() < 1 || has_no_root_by_hull(p)) return;
  Poly derivative, divisor, q = p;
  fmpz_poly_derivative(derivative.get(), p.get());
  fmpz_poly_gcd(divisor.get(), p.get(), derivative.get());
  if (divisor.degree() > 0) fmpz_poly_div(q.get(), p.get(), divisor.get());
  fmpz_poly_primitive_part(q.get(), q.get());
  const std::vector<Ball> roots = real_roots(q, AlgebraicNumber::first_precision);
  for (std::size_t i = 0; i < roots.size(); ++i) {
    AlgebraicNumber root(q, i, roots[i]);
    if (root.sign(Poly(0, 1)) >= 0 && root.sign(Poly(-1, 1)) <= 0) out.push_back(std::move(root));
  }
}

using Vector = std::array<Poly, 3>;

Vector operator-(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
Poly dot(const Vector& a, const Vector& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The four moving points, all coordinates times one power of two.
std::array<Vector, 4> integer_motion(const QueryPoints& points) {
  constexpr int mantissa_bits = std::numeric_limits<double>::digits;
  int lowest = std::numeric_limits<int>::max();
  for (const auto& point : points)
    for (const double x : point)
      if (x != 0) lowest = std::min(lowest, std::ilogb(x) - (mantissa_bits - 1));
  const auto integer = [&](double x) {
    Int n;
    if (x == 0) return n;
    const int exponent = std::ilogb(x) - (mantissa_bits - 1);
    fmpz_set_d(n.get(), std::scalbn(x, -exponent));
    fmpz_mul_2exp(n.get(), n.get(), static_cast<ulong>(exponent - lowest));
    return n;
  };
  std::array<Vector, 4> motion;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const Int start = integer(points[i][k]);
      Int way = integer(points[i + 4][k]);
      fmpz_sub(way.get(), way.get(), start.get());
      motion[i][k] = Poly(start, way);
    }
  return motion;
}

// Point p and segment ab: on one line, and the projection d of p on ab within 0 and |ab|^2.
struct PointSegment {
  PointSegment(const Vector& p, const Vector& a, const Vector& b)
      : normal(cross(b - a, p - a)),
        along(dot(b - a, p - a)),
        length2(dot(b - a, b - a)),
        distance2(dot(p - a, p - a)) {}

  bool touches(const AlgebraicNumber& t) const {
    for (const Poly& c : normal)
      if (t.sign(c) != 0) return false;
    if (t.sign(length2) == 0) return t.sign(distance2) == 0;
    return t.sign(along) >= 0 && t.sign(length2 - along) >= 0;
  }

  Vector normal;
  Poly along, length2, distance2;
};

}  // namespace

Truth find_truth(ContactKind kind, const QueryPoints& points) {
  const auto [a, b, c, d] = integer_motion(points);
  const bool is_vf = kind == ContactKind::vertex_face;
  const Vector n = is_vf ? cross(c - b, d - b) : cross(b - a, d - c);
  const Poly f = dot(n, is_vf ? a - b : c - a);

  std::vector<AlgebraicNumber> times;
  Truth::Regularity regularity = Truth::Regularity::regular;
  if (f.is_zero()) {
    regularity = Truth::Regularity::coplanar;
  } else {
    append_roots(f, times);
    if (times.empty()) return {regularity, nullptr};
  }

  std::vector<Poly> inside;
  if (is_vf) {
    inside = {dot(n, cross(c - b, a - b)), dot(n, cross(d - c, a - c)),
              dot(n, cross(b - d, a - d))};
  } else {
    const Poly nn = dot(n, n);
    const Poly s = dot(cross(c - a, d - c), n), u = dot(cross(c - a, b - a), n);
    inside = {s, nn - s, u, nn - u};
  }
  std::vector<PointSegment> degenerate;
  const auto make_degenerate = [&, &a = a, &b = b, &c = c, &d = d] {
    if (!degenerate.empty()) return;
    if (is_vf)
      degenerate = {{a, b, c}, {a, c, d}, {a, d, b}};
    else
      degenerate = {{a, c, d}, {b, c, d}, {c, a, b}, {d, a, b}};
  };

  // In one plane at all times: whether there is contact can change only at the ends of the step and
  // where a sign changes that it depends on.
  if (f.is_zero()) {
    make_degenerate();
    times = {AlgebraicNumber::rational(0, 1), AlgebraicNumber::rational(1, 1)};
    for (const Poly& p : inside) append_roots(p, times);
    for (const Poly& p : n) append_roots(p, times);
    for (const PointSegment& s : degenerate) {
      for (const Poly& p : s.normal) append_roots(p, times);
      for (const Poly& p : {s.along, s.length2 - s.along, s.length2, s.distance2})
        append_roots(p, times);
    }
    std::sort(times.begin(), times.end());
  }

  for (const AlgebraicNumber& t : times) {
    bool touches = true;
    if (std::any_of(n.begin(), n.end(), [&](const Poly& p) { return t.sign(p) != 0; })) {
      touches =
          std::all_of(inside.begin(), inside.end(), [&](const Poly& p) { return t.sign(p) >= 0; });
    } else {
      make_degenerate();
      if (regularity == Truth::Regularity::regular) regularity = Truth::Regularity::singular;
      touches = std::any_of(degenerate.begin(), degenerate.end(),
                            [&](const PointSegment& s) { return s.touches(t); });
    }
    if (touches) return {regularity, std::make_shared<const AlgebraicNumber>(t)};
  }
  return {regularity, nullptr};
}

double Truth::toi() const { return minus(0); }

int Truth::compare(double toi) const {
  if (toi == 0) return time_->sign(Poly(0, 1));
  // toi = numerator / 2^shift with shift >= 0, for any double in [0, 1].
  const int shift = std::numeric_limits<double>::digits - 1 - std::ilogb(toi);
  Int numerator, denominator;
  fmpz_set_d(numerator.get(), -std::scalbn(toi, shift));
  fmpz_one(denominator.get());
  fmpz_mul_2exp(denominator.get(), denominator.get(), static_cast<ulong>(shift));
  return time_->sign(Poly(numerator, denominator));
}

double Truth::minus(double toi) const { return time_->minus(toi); }

}  // namespace lazyccd::test
