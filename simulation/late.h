/* Rows of samples, later by a part of a sample or by several. C99; memory belongs to the caller. */
#ifndef LB_LATE_H
#define LB_LATE_H

#include <stddef.h>

/* Rows that are shifted together. */
#define LB_LATE_LANES 8
/* Samples before and after a row: its first and its last value, as far as they matter. */
#define LB_LATE_PAD 12

/* Interpolates `rows` rows of `ticks` values, at least one and finite, at places that many `samples` earlier: a cubic
 * spline through the values (Unser, Aldroubi and Eden, IEEE Trans. Pattern Anal. 13, 1991), before and after them
 * constant. `work`: (ticks + 2 LB_LATE_PAD) LB_LATE_LANES values. The operations and their order, and so the bits, are
 * those of SciPy's ndimage.shift of order 3 with the mode "nearest". */
void lb_late(size_t rows, size_t ticks, double samples, const double *in, double *out, double *work);

#endif
