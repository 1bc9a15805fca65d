// Reading and writing rows of text for the module _native.
#ifndef LIVEBODE_NATIVE_TABLE_H
#define LIVEBODE_NATIVE_TABLE_H

#include <nanobind/nanobind.h>

void bind_table(nanobind::module_ &m);

#endif
