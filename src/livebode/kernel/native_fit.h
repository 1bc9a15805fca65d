// The fit's functions of the module _native.
#ifndef LIVEBODE_NATIVE_FIT_H
#define LIVEBODE_NATIVE_FIT_H

#include <nanobind/nanobind.h>

void bind_fit(nanobind::module_ &m);

#endif
