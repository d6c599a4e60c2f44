// An exact time within the step, and the signs of polynomials at it.
#pragma once

#include <cstdint>

#include "core/exact/common_root.h"
#include "core/exact/polynomial.h"

namespace lazyccd::exact {

/// Result of a sign that would need more bits than the integers have.
constexpr int kUnknown = 2;
/// Most halvings of the step. Together with kCoordinateBits it bounds all integers.
constexpr int kMaxLevel = 224;

/// An interval [k, k+1] / 2^level of the step, as the halves that lead to it.
class Path {
 public:
  LAZYCCD_HD int level() const { return level_; }
  LAZYCCD_HD bool later(int at) const { return (half_[at / 32] >> (31 - at % 32) & 1) != 0; }
  LAZYCCD_HD void push(bool is_later) {
    set(level_, is_later);
    ++level_;
  }
  /// Goes on to the interval that comes next in time and is no part of this one. Returns false if
  /// there is none.
  LAZYCCD_HD bool advance() {
    while (level_ > 0 && later(level_ - 1)) --level_;
    if (level_ == 0) return false;
    set(level_ - 1, true);
    return true;
  }
  /// floor(2^32 k / 2^level)
  LAZYCCD_HD std::int64_t ticks() const {
    const std::uint32_t kept = level_ >= 32 ? ~0u : level_ == 0 ? 0u : ~0u << (32 - level_);
    return static_cast<std::int64_t>(half_[0] & kept);
  }
  /// k
  template <class Integer>
  LAZYCCD_HD LAZYCCD_CALLED Integer index() const {
    constexpr int word = 32;
    Integer index(0);
    for (int at = 0; at < level_; at += word) {
      const int bits = level_ - at < word ? level_ - at : word;
      const Integer low(static_cast<std::int64_t>(half_[at / word] >> (word - bits)));
      index = at == 0 ? low : (index << bits) + low;
    }
    return index;
  }
  template <class Integer>
  LAZYCCD_HD Part<Integer> part() const {
    return Part<Integer>(index<Integer>(), level_);
  }
  /// Goes on to part `index` of the 2^levels equal parts of the interval. levels: 1 to 32.
  LAZYCCD_HD void push(std::int64_t index, int levels) {
    const int word = level_ / 32, used = level_ % 32;
    const std::uint64_t kept = used == 0 ? 0 : std::uint64_t{half_[word]} >> (32 - used);
    const std::uint64_t bits = (kept << levels | static_cast<std::uint64_t>(index))
                               << (64 - used - levels);
    half_[word] = static_cast<std::uint32_t>(bits >> 32);
    if (used + levels > 32) half_[word + 1] = static_cast<std::uint32_t>(bits);
    level_ += levels;
  }

 private:
  LAZYCCD_HD void set(int at, bool is_later) {
    const std::uint32_t bit = std::uint32_t{1} << (31 - at % 32);
    half_[at / 32] = is_later ? half_[at / 32] | bit : half_[at / 32] & ~bit;
  }

  int level_ = 0;
  std::uint32_t half_[kMaxLevel / 32] = {};
};

/// Either the start of an interval, or the end of the step, or the only root of a polynomial inside
/// an interval.
template <class Integer>
class Instant {
 public:
  using P = Poly<Integer>;

  LAZYCCD_HD static Instant start_of(const Path& path) { return {Kind::start, path}; }
  LAZYCCD_HD static Instant end_of_step() { return {Kind::end, Path()}; }
  /// Root of `f`, which is trimmed. It is also the only root of `single` inside the interval, where
  /// that changes its sign once; `local` is `single` over the interval. `other`: a linear
  /// polynomial whose root may be inside too, or null.
  LAZYCCD_HD static Instant root(const Path& path, const P& f, const P& single, const P& local,
                                 const P* other) {
    Instant t{Kind::root, path};
    t.f_ = &f;
    t.single_ = &single;
    t.other_ = other;
    t.local_ = local;
    t.local_level_ = path.level();
    t.first_sign_ = local.first_sign();
    return t;
  }

  /// Sign of p, of degree 2 at most: -1, 0, 1 or kUnknown. Narrows the interval as needed.
  LAZYCCD_HD LAZYCCD_CALLED int sign(const P& p) {
    constexpr int step = 32;
    bool may_be_zero = true;
    for (;;) {
      if (kind_ == Kind::end) return p.c[p.degree].sign();
      if (kind_ == Kind::start) return sign_at_start(p);
      const P q = over(p);
      if (q.sign_changes() == 0) return q.first_sign();
      if (may_be_zero && path_.level() >= step) {
        const int zero = is_root_of(p);
        if (zero == 1) return 0;
        may_be_zero = zero < 0;  // not narrow enough to tell
      }
      if (kind_ == Kind::root && !refine(path_.level() + step)) return kUnknown;
    }
  }

  /// floor(2^32 t)
  LAZYCCD_HD LAZYCCD_CALLED std::int64_t ticks() {
    if (kind_ == Kind::end) return std::int64_t{1} << 32;
    refine(32);
    return path_.ticks();
  }

 private:
  enum class Kind { start, end, root };

  LAZYCCD_HD Instant(Kind kind, const Path& path) : kind_(kind), path_(path) {}

  LAZYCCD_HD LAZYCCD_CALLED int sign_at_start(const P& p) const {
    if (path_.level() == 0) return p.c[0].sign();
    const Integer index = path_.template index<Integer>();
    return p.at(index, (Integer(1) << path_.level()) - index).sign();
  }
  // A positive multiple of p over the interval, mapped to [0, 1].
  LAZYCCD_HD LAZYCCD_CALLED P over(const P& p) {
    if (path_.level() == 0) return p;
    if (part_level_ != path_.level()) {
      part_ = path_.template part<Integer>();
      part_level_ = path_.level();
    }
    return p.over(part_);
  }

  // Returns 1 if p is zero here, 0 if not, -1 if the interval is too wide to tell.
  LAZYCCD_HD LAZYCCD_CALLED int is_root_of(const P& p) {
    if (other_ != nullptr && over(*other_).sign_changes() != 0) return -1;
    const P q = p.trimmed();
    if (q.degree == 0) return 0;
    const CommonRoots<Integer> common = common_roots(*f_, q);
    if (common.kind == CommonRoots<Integer>::none) return 0;
    // The interval holds no root of f but this one.
    if (common.kind == CommonRoots<Integer>::of_linear)
      return over(common.linear).sign_changes() == 1;
    const int changes = over(q).sign_changes();
    return changes == 1 || (changes == 2 && has_multiple_root(q));
  }

  // Narrows the interval down to a level. Returns false if that is too far.
  LAZYCCD_HD LAZYCCD_CALLED bool refine(int level) {
    constexpr int fewest = 4;  // levels for which a guess takes less time than halving
    if (level > kMaxLevel) return false;
    while (kind_ == Kind::root && path_.level() < level) {
      int levels = level - path_.level();
      if (levels > kGuessedLevels) levels = kGuessedLevels;
      while (levels >= fewest && !narrow_by_guess(levels)) levels /= 2;
      if (levels < fewest) halve();
    }
    return true;
  }

  // Makes local_ that of the interval.
  LAZYCCD_HD LAZYCCD_CALLED void localize() {
    if (local_level_ == path_.level()) return;
    local_ = over(*single_);
    local_level_ = path_.level();
  }

  LAZYCCD_HD LAZYCCD_CALLED void halve() {
    localize();
    const int middle = local_.sum().sign();
    path_.push(middle == 0 || middle == first_sign_);
    ++local_level_;
    if (middle == 0) {
      kind_ = Kind::start;
    } else if (middle == first_sign_) {
      local_.take_later_half();
    } else {
      local_.take_earlier_half();
    }
  }

  // Guesses, in floating point, which of the 2^levels parts of the interval holds the root. Returns
  // false and changes nothing if exact signs at both ends of the part do not say so.
  LAZYCCD_HD LAZYCCD_CALLED bool narrow_by_guess(int levels) {
    localize();
    const std::int64_t part = guessed_part(local_, first_sign_, levels);
    Path path = path_;
    path.push(part, levels);
    const Integer one(1), later = path.template index<Integer>(),
                          earlier = (one << path.level()) - later;
    const int at_start = single_->at(later, earlier).sign();
    if (at_start == 0 && part != 0) {
      path_ = path;
      kind_ = Kind::start;
      return true;
    }
    if (part != 0 && at_start != first_sign_) return false;
    // There is one root and one change of sign, so a part with different signs at its ends has
    // both. At part 0 the start may be a zero that is no root inside.
    if (single_->at(later + one, earlier - one).sign() * first_sign_ >= 0) return false;
    path_ = path;
    return true;
  }

  Kind kind_;
  Path path_;
  // Of a root. first_sign_: of single_ just before it. local_ and part_ are those of a level.
  const P* f_ = nullptr;
  const P* single_ = nullptr;
  const P* other_ = nullptr;
  int first_sign_ = 0;
  P local_;
  Part<Integer> part_;
  int local_level_ = 0, part_level_ = 0;
};

/// Whether a contact is at a time.
enum class Answer { no, yes, unknown };

/// The first root of p in [0, 1] at which accepted(Instant&) says yes.
struct FirstRoot {
  Answer answer;
  std::int64_t ticks;
};

/// p must not be zero everywhere.
template <class Integer, class Accepted>
LAZYCCD_HD LAZYCCD_CALLED FirstRoot first_root(const Poly<Integer>& p, Accepted&& accepted) {
  using At = Instant<Integer>;
  FirstRoot result{Answer::no, 0};
  // Returns whether the search is over.
  const auto test = [&](At t) {
    result.answer = accepted(t);
    if (result.answer == Answer::yes) result.ticks = t.ticks();
    return result.answer != Answer::no;
  };
  if (p.c[0].sign() == 0 && test(At::start_of(Path()))) return result;

  const Poly<Integer> f = p.trimmed();
  if (f.sign_changes() >= 2 && has_multiple_root(f)) {
    const RationalRoots<Integer> roots = rational_roots(f);
    for (int i = 0; i < roots.count; ++i) {
      const int which = roots.first_is_smaller ? i : roots.count - 1 - i;
      const Poly<Integer>& root = roots.root[which];
      const Poly<Integer>* other = roots.count == 2 ? &roots.root[1 - which] : nullptr;
      if (root.sign_changes() == 1 && test(At::root(Path(), f, root, root, other))) return result;
    }
  } else {
    Path path;
    do {
      Poly<Integer> local = path.level() == 0 ? f : f.over(path.template part<Integer>());
      const bool begins_later = path.level() > 0 && path.later(path.level() - 1);
      if (begins_later && local.c[0].sign() == 0 && test(At::start_of(path))) return result;
      int changes = local.sign_changes();
      while (changes > 1) {
        if (path.level() == kMaxLevel) return {Answer::unknown, 0};
        path.push(false);
        local.take_earlier_half();
        changes = local.sign_changes();
      }
      if (changes == 1 && test(At::root(path, f, f, local, nullptr))) return result;
    } while (path.advance());
  }
  if (p.c[p.degree].sign() == 0) test(At::end_of_step());
  return result;
}

}  // namespace lazyccd::exact
