// The extension module lazyccd._native. The package's Python files check and convert arguments;
// here arrays already have the types that C++ takes.
#include <lazyccd/algorithm.h>

#include "bindings.h"

NB_MODULE(_native, module) {
  lazyccd::register_research();
  lazyccd::python::bind_errors(module);
  lazyccd::python::bind_detector(module);
  lazyccd::python::bind_queries(module);
}
