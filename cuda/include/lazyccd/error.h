// The one error type of the core. Bad input names its body and primitive.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

namespace lazyccd {

enum class ErrorCode {
  invalid_argument,     // an option or an argument outside its range
  non_finite_position,  // NaN or infinity in a position
  index_out_of_range,   // a face, edge or body id points outside its table
  degenerate_face,      // a face or edge names one vertex twice
  duplicate_face,       // two faces with the same three vertices
  mixed_body,           // a face or edge whose vertices belong to different bodies
  empty_body,           // a body without a face or an edge
  size_mismatch,        // arrays whose lengths do not fit together
  file,                 // a file that cannot be read as what it should be
  unavailable,          // a backend that this build or this machine does not have
  device,               // the GPU reported an error
};

class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& what, std::int32_t body = -1, std::int32_t primitive = -1)
      : std::runtime_error(what), code_(code), body_(body), primitive_(primitive) {}

  ErrorCode code() const { return code_; }
  // Index of the body, or -1 where no body is at fault.
  std::int32_t body() const { return body_; }
  // Index of the vertex, edge or face at fault (the message says which), or -1.
  std::int32_t primitive() const { return primitive_; }

 private:
  ErrorCode code_;
  std::int32_t body_;
  std::int32_t primitive_;
};

}  // namespace lazyccd
