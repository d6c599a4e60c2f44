// The contacts of a step as one array for each field that a caller reads.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "lazyccd/contact.h"
#include "lazyccd/span.h"

namespace lazyccd {

/// Fields of Contact, as bits.
enum ContactField : std::uint32_t {
  kKindField = 1,        ///< kind
  kBodiesField = 2,      ///< body_a, body_b
  kPrimitivesField = 4,  ///< primitive_a, primitive_b
  kVerticesField = 8,    ///< vertices
  kPointField = 16,      ///< u, v
  kNormalField = 32,     ///< normal
  kTimeField = 64,       ///< toi
};

/// The contacts in the order of Detector::detect(). Arrays of fields that were not asked for are
/// empty.
struct ContactColumns {
  std::size_t count = 0;
  Span<const ContactKind> kind;
  Span<const std::array<std::int32_t, 2>> bodies, primitives;
  Span<const std::array<std::int32_t, 4>> vertices;
  Span<const std::array<float, 2>> point;
  Span<const std::array<float, 3>> normal;
  Span<const double> toi;
};

}  // namespace lazyccd
