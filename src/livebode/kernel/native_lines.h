// The line stage's functions of the module _native.
#ifndef LIVEBODE_NATIVE_LINES_H
#define LIVEBODE_NATIVE_LINES_H

#include <nanobind/nanobind.h>

void bind_lines(nanobind::module_ &m);

#endif
