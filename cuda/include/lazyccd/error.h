// The error type that the detector throws. For invalid input it names the body and the primitive.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "lazyccd/export.h"

namespace lazyccd {

/// Class of an error.
enum class ErrorCode {
  invalid_argument,     ///< an option or an argument is outside its range
  non_finite_position,  ///< a position contains NaN or infinity
  index_out_of_range,   ///< the index of a vertex or a body is outside its table
  degenerate_face,      ///< a face or an edge has one vertex twice
  duplicate_face,       ///< two faces have the same three vertices
  mixed_body,           ///< the vertices of a face or an edge belong to different bodies
  empty_body,           ///< a body has neither a face nor an edge
  size_mismatch,        ///< the lengths of arrays do not fit together
  file,                 ///< a file cannot be read in its format
  unavailable,          ///< this build or this machine does not have the backend or the option
  device,               ///< the GPU reported an error
};

/// Exception with a class and, if known, the body and the primitive. what() is a message for users.
class LAZYCCD_API Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& what, std::int32_t body = -1,
        std::int32_t primitive = -1)
      : std::runtime_error(what), code_(code), body_(body), primitive_(primitive) {}

  ErrorCode code() const { return code_; }
  /// Index of the body at fault, or -1.
  std::int32_t body() const { return body_; }
  /// Index of the vertex, edge or face at fault, or -1. The message names the kind.
  std::int32_t primitive() const { return primitive_; }

 private:
  ErrorCode code_;
  std::int32_t body_;
  std::int32_t primitive_;
};

}  // namespace lazyccd
