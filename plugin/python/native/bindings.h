// The parts of the extension module lazyccd._native.
#pragma once

#include <nanobind/nanobind.h>

namespace lazyccd::python {

void bind_errors(nanobind::module_& module);    ///< lazyccd::Error as lazyccd.Error
void bind_detector(nanobind::module_& module);  ///< Detector, Stats, contact_hash()
void bind_queries(nanobind::module_& module);   ///< single elementary tests, many at once

}  // namespace lazyccd::python
