// The matrix stage's functions of the module _native.
#ifndef LIVEBODE_NATIVE_MATRIX_H
#define LIVEBODE_NATIVE_MATRIX_H

#include <nanobind/nanobind.h>

void bind_matrix(nanobind::module_ &m);

#endif
