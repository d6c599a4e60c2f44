// Other ways to decide an elementary query, behind one interface, for comparison only.
//
// None of them is used by LazyCCD. They show what the field's usual tests cost and get wrong, so
// each keeps the habits of its source, epsilons included.
#pragma once

#include "lazyccd/contact.h"
#include "lazyccd/query.h"

namespace lazyccd::peers {

// Cubic of coplanarity, its roots by Newton-Raphson kept in a bracket by bisection (Press et al.,
// Numerical Recipes, rtsafe), then an inside test with epsilons at each root (Provot 1997; the test
// of da Silva's dissertation on lazy work stealing).
template <class Real>
QueryResult cubic_newton(ContactKind kind, const QueryPoints& points);

// The non-coplanar filter alone (Tang, Manocha, Tong 2010): a query is no contact where the four
// Bernstein coefficients of the cubic have one strict sign, and counts as one, with no time, where
// they do not.
template <class Real>
QueryResult noncoplanar_filter(ContactKind kind, const QueryPoints& points);

// Interval subdivision over time and the two parameters of the primitives in the way of
// Tight-Inclusion (Wang et al. 2021): conservative, to a tolerance.
template <class Real>
QueryResult interval_subdivision(ContactKind kind, const QueryPoints& points);

}  // namespace lazyccd::peers
