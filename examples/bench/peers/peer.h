// Other methods to decide an elementary query, behind one interface, for comparison only.
//
// LazyCCD uses none of them. They show the cost and the errors of the usual tests, so each one
// follows its source closely, with the same epsilons.
#pragma once

#include "lazyccd/contact.h"
#include "lazyccd/query.h"

namespace lazyccd::peers {

/// Finds the roots of the cubic of coplanarity by Newton-Raphson within a bracket, with bisection
/// (Press et al., Numerical Recipes, rtsafe). Then tests with epsilons whether the primitives touch
/// at each root (Provot 1997). V. da Silva's dissertation on lazy work stealing uses this test.
template <class Real>
QueryResult cubic_newton(ContactKind kind, const QueryPoints& points);

/// The non-coplanar filter alone (Tang, Manocha, Tong 2010). A query is no contact if the four
/// Bernstein coefficients of the cubic have the same strict sign. Otherwise it counts as a contact,
/// without a time.
template <class Real>
QueryResult noncoplanar_filter(ContactKind kind, const QueryPoints& points);

/// Interval subdivision over time and the two parameters of the primitives, in the manner of
/// Tight-Inclusion (Wang et al. 2021). It misses nothing and reports false hits within a tolerance.
template <class Real>
QueryResult interval_subdivision(ContactKind kind, const QueryPoints& points);

}  // namespace lazyccd::peers
