#include <lazyccd/error.h>

#include <exception>

#include "bindings.h"

namespace lazyccd::python {

namespace nb = nanobind;

namespace {

const char* name(ErrorCode code) {
  switch (code) {
    case ErrorCode::invalid_argument:
      return "invalid_argument";
    case ErrorCode::non_finite_position:
      return "non_finite_position";
    case ErrorCode::index_out_of_range:
      return "index_out_of_range";
    case ErrorCode::degenerate_face:
      return "degenerate_face";
    case ErrorCode::duplicate_face:
      return "duplicate_face";
    case ErrorCode::mixed_body:
      return "mixed_body";
    case ErrorCode::empty_body:
      return "empty_body";
    case ErrorCode::size_mismatch:
      return "size_mismatch";
    case ErrorCode::file:
      return "file";
    case ErrorCode::unavailable:
      return "unavailable";
    case ErrorCode::device:
      return "device";
  }
  return "unknown";
}

nb::object index_or_none(std::int32_t index) {
  return index < 0 ? nb::object(nb::none()) : nb::object(nb::int_(index));
}

}  // namespace

void bind_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const Error& error) {
      const nb::object type = nb::module_::import_("lazyccd.errors").attr("Error");
      const nb::object value = type(error.what(), name(error.code()), index_or_none(error.body()),
                                    index_or_none(error.primitive()));
      PyErr_SetObject(type.ptr(), value.ptr());
    }
  });
}

}  // namespace lazyccd::python
