// Where the fields of contacts lie if each has an array of its own, all in one block of memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/platform.h"
#include "lazyccd/contact_columns.h"

namespace lazyccd {

/// Arrays of `places` items, one after another: first the fields with the strictest alignment.
struct ColumnLayout {
  std::uint32_t fields;  // bits of ContactField
  std::size_t places;    // a multiple of 4, so that every array is aligned to 16 bytes

  static ColumnLayout of(std::uint32_t fields, std::size_t count) {
    return {fields, (count + 3) / 4 * 4};
  }
  /// Bytes of one item of a field; 0 if it is not wanted.
  LAZYCCD_HD std::size_t size(ContactField field) const {
    if ((fields & field) == 0) return 0;
    return field == kKindField       ? sizeof(ContactKind)
           : field == kVerticesField ? 4 * sizeof(std::int32_t)
           : field == kNormalField   ? 3 * sizeof(float)
                                     : 8;
  }
  /// Byte at which the array of a field begins.
  LAZYCCD_HD std::size_t begin(ContactField field) const {
    std::size_t bytes = 0;
    for (std::uint32_t f = kKindField; f < field; f *= 2) bytes += size(ContactField(f));
    return bytes * places;
  }
  LAZYCCD_HD std::size_t bytes() const { return begin(ContactField(2 * kTimeField)); }

  /// Copies the fields of a contact to its place in the block.
  LAZYCCD_HD void put(const Contact& c, std::size_t place, char* block) const {
    const auto write = [&](ContactField field, auto... items) {
      if ((fields & field) == 0) return;
      using Item = std::common_type_t<decltype(items)...>;
      Item* to = reinterpret_cast<Item*>(block + begin(field)) + place * sizeof...(items);
      const Item values[] = {items...};
      for (std::size_t i = 0; i < sizeof...(items); ++i) to[i] = values[i];
    };
    write(kKindField, static_cast<std::int32_t>(c.kind));
    write(kBodiesField, c.body_a, c.body_b);
    write(kPrimitivesField, c.primitive_a, c.primitive_b);
    write(kVerticesField, c.vertices[0], c.vertices[1], c.vertices[2], c.vertices[3]);
    write(kPointField, c.u, c.v);
    write(kNormalField, c.normal[0], c.normal[1], c.normal[2]);
    write(kTimeField, c.toi);
  }

  /// The arrays in a block in host memory.
  ContactColumns columns(const char* block, std::size_t count) const {
    ContactColumns c;
    c.count = count;
    const auto set = [&](auto& span, ContactField field) {
      using Item = std::remove_reference_t<decltype(span[0])>;
      if ((fields & field) != 0) span = {reinterpret_cast<Item*>(block + begin(field)), count};
    };
    set(c.kind, kKindField);
    set(c.bodies, kBodiesField);
    set(c.primitives, kPrimitivesField);
    set(c.vertices, kVerticesField);
    set(c.point, kPointField);
    set(c.normal, kNormalField);
    set(c.toi, kTimeField);
    return c;
  }
};

}  // namespace lazyccd
