#include "support/oracle.h"

// Arb is a library of its own beside FLINT 2 (Debian 12) and part of FLINT 3 (Ubuntu 24.04).
#include <flint/fmpz_poly.h>
#include <flint/fmpz_poly_factor.h>
#if __has_include(<flint/arb_fmpz_poly.h>)
#include <flint/arb.h>
#include <flint/arb_fmpz_poly.h>
#else
#include <arb.h>
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

// The earlier (-1) or later (1) half of a ball, exact.
Ball half(const Ball& ball, int which) {
  Ball result = ball;
  arf_t shift;
  arf_init(shift);
  arf_set_mag(shift, arb_radref(ball.get()));
  arf_mul_2exp_si(shift, shift, -1);
  if (which < 0) arf_neg(shift, shift);
  arf_add(arb_midref(result.get()), arb_midref(ball.get()), shift, ARF_PREC_EXACT, ARF_RND_DOWN);
  mag_mul_2exp_si(arb_radref(result.get()), arb_radref(ball.get()), -1);
  arf_clear(shift);
  return result;
}

// The midpoint of a ball (0) or one of its ends (-1, 1), exact.
Ball point_of(const Ball& ball, int which) {
  Ball result;
  arf_struct* x = arb_midref(result.get());
  arf_set_mag(x, arb_radref(ball.get()));
  arf_mul_si(x, x, which, ARF_PREC_EXACT, ARF_RND_DOWN);
  arf_add(x, x, arb_midref(ball.get()), ARF_PREC_EXACT, ARF_RND_DOWN);
  return result;
}

// Sign of p(x), exact. x is a ball of radius 0.
int sign_at(const Poly& p, const Ball& x) {
  Ball value;
  arb_fmpz_poly_evaluate_arb(value.get(), p.get(), x.get(), ARF_PREC_EXACT);
  return arf_sgn(arb_midref(value.get()));
}

// Sturm's sequence of p, each member up to a positive factor. The last member is gcd(p, p').
std::vector<Poly> sturm_sequence(const Poly& p) {
  std::vector<Poly> sequence{p, Poly()};
  fmpz_poly_derivative(sequence[1].get(), p.get());
  while (sequence.back().degree() > 0) {
    const Poly& divisor = sequence.back();
    Poly rest;
    ulong power;
    fmpz_poly_pseudo_rem(rest.get(), &power, sequence[sequence.size() - 2].get(), divisor.get());
    if (rest.is_zero()) break;
    const bool flipped = power % 2 == 1 && fmpz_sgn(fmpz_poly_lead(divisor.get())) < 0;
    Int content;
    fmpz_poly_content(content.get(), rest.get());
    if (!flipped) fmpz_neg(content.get(), content.get());
    fmpz_poly_scalar_divexact_fmpz(rest.get(), rest.get(), content.get());
    sequence.push_back(std::move(rest));
  }
  return sequence;
}

int sign_changes(const std::vector<Poly>& sequence, const Ball& x) {
  int changes = 0, last = 0;
  for (const Poly& p : sequence) {
    const int sign = sign_at(p, x);
    if (sign * last < 0) ++changes;
    if (sign != 0) last = sign;
  }
  return changes;
}

}  // namespace

// The only root of a square-free polynomial inside a ball. Const functions may shrink the ball and
// simplify the polynomial; the number they represent does not change.
class AlgebraicNumber {
 public:
  AlgebraicNumber(Poly p, Ball ball) : p_(std::move(p)), ball_(std::move(ball)) {}

  static AlgebraicNumber integer(slong n) {
    Ball ball;
    arb_set_si(ball.get(), n);
    return {Poly(-n, 1), ball};
  }

  int sign(const Poly& q) const {
    Ball value;
    for (bool may_vanish = true;;) {
      arb_fmpz_poly_evaluate_arb(value.get(), q.get(), ball_.get(), 2 * precision_);
      if (arb_is_zero(value.get())) return 0;
      if (arb_is_positive(value.get())) return 1;
      if (arb_is_negative(value.get())) return -1;
      if (may_vanish && precision_ >= 128) {
        make_minimal();
        Poly quotient;
        if (fmpz_poly_divides(quotient.get(), q.get(), p_.get())) return 0;
        may_vanish = false;
      }
      refine(2 * precision_);
    }
  }

  friend bool operator<(const AlgebraicNumber& a, const AlgebraicNumber& b) {
    while (arb_overlaps(a.ball_.get(), b.ball_.get())) {
      a.make_minimal();
      b.make_minimal();
      if (a.p_ == b.p_) {
        Ball both;
        arb_union(both.get(), a.ball_.get(), b.ball_.get(), ARF_PREC_EXACT);
        if (count_roots(a.p_, both) == 1) return false;
      }
      const AlgebraicNumber& wider = a.precision_ < b.precision_ ? a : b;
      wider.refine(2 * wider.precision_);
    }
    return arb_lt(a.ball_.get(), b.ball_.get());
  }

  double minus(double x) const {
    refine(128);
    Ball difference;
    arb_set_d(difference.get(), x);
    arb_sub(difference.get(), ball_.get(), difference.get(), precision_);
    return arf_get_d(arb_midref(difference.get()), ARF_RND_NEAR);
  }

 private:
  // Shrinks the ball to `precision` bits of relative accuracy by the interval Newton method. The
  // interval m - p(m) / p'(ball) contains the root, where m is the midpoint. If this does not
  // shrink the ball, halves it.
  void refine(slong precision) const {
    precision_ = std::max(precision_, precision);
    Poly derivative;
    fmpz_poly_derivative(derivative.get(), p_.get());
    const slong working = 2 * precision_;
    Ball middle, value, slope, next;
    while (arb_rel_accuracy_bits(ball_.get()) < precision_) {
      arb_fmpz_poly_evaluate_arb(slope.get(), derivative.get(), ball_.get(), working);
      arb_get_mid_arb(middle.get(), ball_.get());
      arb_fmpz_poly_evaluate_arb(value.get(), p_.get(), middle.get(), working);
      arb_div(value.get(), value.get(), slope.get(), working);
      arb_sub(next.get(), middle.get(), value.get(), working);
      const bool narrower = arb_contains(ball_.get(), next.get()) &&
                            mag_cmp(arb_radref(next.get()), arb_radref(half(ball_, 1).get())) < 0;
      if (narrower)
        ball_ = next;
      else
        halve();
    }
  }

  void halve() const {
    int first_sign = 0;
    for (const int which : {-1, 1, 0}) {
      const Ball point = point_of(ball_, which);
      const int sign = sign_at(p_, point);
      if (sign == 0) {
        ball_ = point;
        return;
      }
      if (which == -1) first_sign = sign;
      if (which == 0) ball_ = half(ball_, sign == first_sign ? 1 : -1);
    }
  }

  static int count_roots(const Poly& p, const Ball& ball) {
    const std::vector<Poly> sequence = sturm_sequence(p);
    const Ball first = point_of(ball, -1), last = point_of(ball, 1);
    return sign_changes(sequence, first) - sign_changes(sequence, last) + (sign_at(p, first) == 0);
  }

  // Makes p_ irreducible and primitive, with a positive leading coefficient.
  void make_minimal() const {
    if (is_minimal_) return;
    is_minimal_ = true;
    fmpz_poly_factor_t factors;
    fmpz_poly_factor_init(factors);
    fmpz_poly_factor(factors, p_.get());
    for (slong i = 0; i < factors->num; ++i) {
      const Poly factor(factors->p + i);
      if (count_roots(factor, ball_) == 0) continue;
      p_ = factor;
      break;
    }
    fmpz_poly_factor_clear(factors);
  }

  mutable Poly p_;
  mutable Ball ball_;
  mutable slong precision_ = 32;
  mutable bool is_minimal_ = false;
};

namespace {

// True if all Bernstein coefficients over [0, 1] have the same sign.
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

// Appends the roots in [0, 1] in ascending order.
void append_roots(const Poly& p, std::vector<AlgebraicNumber>& out) {
  if (p.degree() < 1 || has_no_root_by_hull(p)) return;
  Poly q = p;
  std::vector<Poly> sequence = sturm_sequence(p);
  if (sequence.back().degree() > 0) {
    Poly common;
    fmpz_poly_primitive_part(common.get(), sequence.back().get());
    fmpz_poly_div(q.get(), p.get(), common.get());
    sequence = sturm_sequence(q);
  }
  if (fmpz_is_zero(fmpz_poly_get_coeff_ptr(q.get(), 0))) out.push_back(AlgebraicNumber::integer(0));

  // Stack of balls to search; the ball with the earliest times is on top. The difference of the
  // sign changes at the two ends is the number of roots in (first end, last end].
  struct Part {
    Ball ball;
    int changes_first, changes_last;
  };
  Ball step;
  arb_set_d(step.get(), 0.5);
  mag_set_ui_2exp_si(arb_radref(step.get()), 1, -1);
  std::vector<Part> parts{{step, sign_changes(sequence, point_of(step, -1)),
                           sign_changes(sequence, point_of(step, 1))}};
  while (!parts.empty()) {
    const Part part = parts.back();
    parts.pop_back();
    const int roots = part.changes_first - part.changes_last;
    if (roots == 0) continue;
    if (roots == 1 && sign_at(q, point_of(part.ball, -1)) != 0) {
      out.emplace_back(q, part.ball);
      continue;
    }
    const int changes = sign_changes(sequence, point_of(part.ball, 0));
    parts.push_back({half(part.ball, 1), changes, part.changes_last});
    parts.push_back({half(part.ball, -1), part.changes_first, changes});
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

// The motions of the four points. All coordinates are multiplied by one power of two, which makes
// them integers.
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

// Polynomials for the test whether point p is on segment ab: p is on the line if the normal
// vanishes, and on the segment if also 0 <= (p - a) . (b - a) <= |ab|^2. If a = b: if p = a.
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

  // Coplanar at all times: contact can begin or end only at the ends of the step or at a time when
  // one of the signs that decide it changes.
  if (f.is_zero()) {
    make_degenerate();
    times = {AlgebraicNumber::integer(0), AlgebraicNumber::integer(1)};
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
