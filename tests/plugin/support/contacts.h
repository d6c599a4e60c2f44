// Contacts for tests of what is made of them.
#pragma once

#include <array>
#include <cstdint>

#include "lazyccd/contact.h"

namespace lazyccd::test {

// With the normal upwards.
inline Contact contact(ContactKind kind, const std::array<std::int32_t, 4>& vertices, float u,
                       float v) {
  Contact result{};
  result.kind = kind;
  result.vertices = vertices;
  result.u = u;
  result.v = v;
  result.normal = {0, 1, 0};
  return result;
}

}  // namespace lazyccd::test
