/* The largest samples of stretches: whether all are finite, and plausible. */
#ifndef LIVEBODE_SIZES_H
#define LIVEBODE_SIZES_H

#include <stddef.h>

#include "livebode/sdft.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The largest |x| of the first `begun` samples and of each `window` samples after them, the last ones may be fewer:
 * NaN where one is NaN. `out` has room for one number, and one for each further stretch that begins.
 *
 * LB_ERROR_NULL for a missing pointer, LB_ERROR_SIZE for stretches without samples, LB_ERROR_INSTRUCTION_SET for one
 * that this machine does not have. */
lb_status lb_largest_sizes(const double *x, size_t count, size_t begun, size_t window, lb_instruction_set set,
                           double *out);

#ifdef __cplusplus
}
#endif

#endif
