// The functions of the module _native for errors that repeat with the excitation.
#ifndef LIVEBODE_NATIVE_REPEATING_H
#define LIVEBODE_NATIVE_REPEATING_H

#include <nanobind/nanobind.h>

void bind_repeating(nanobind::module_ &m);

#endif
