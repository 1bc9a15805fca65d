// The functions of the module _native for the periods of a signal.
#ifndef LIVEBODE_NATIVE_PERIODS_H
#define LIVEBODE_NATIVE_PERIODS_H

#include <nanobind/nanobind.h>

void bind_periods(nanobind::module_ &m);

#endif
