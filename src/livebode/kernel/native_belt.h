// The functions of the module _native for two masses joined by a belt.
#ifndef LIVEBODE_NATIVE_BELT_H
#define LIVEBODE_NATIVE_BELT_H

#include <nanobind/nanobind.h>

void bind_belt(nanobind::module_ &m);

#endif
