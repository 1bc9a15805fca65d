/* Cubic splines over a position, with the bits of SciPy's BSpline. All memory belongs to the caller. */
#ifndef LIVEBODE_CURVE_H
#define LIVEBODE_CURVE_H

#include <stddef.h>

#include "livebode/sdft.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LB_CURVE_DEGREE 3u

/* Between its ends, which are the first and the last knot; a place beyond them is taken as the end. */
typedef struct {
    size_t splines;      /* at least LB_CURVE_DEGREE + 1 */
    const double *knots; /* [splines + LB_CURVE_DEGREE + 1], ascending, each end LB_CURVE_DEGREE + 1 times */
} lb_curve_knots;

/* Beyond its ends a curve continues straight as far as `reach`, and is constant from there on. */
typedef struct {
    const double *weights; /* [splines] */
    double reach, slope_before, slope_beyond;
} lb_curve_shape;

/* Value of the curve at each place: out [count]. */
lb_status lb_curve_at(const lb_curve_knots *knots, const lb_curve_shape *shape, size_t count, const double *x,
                      double *out);

/* Value of every spline at each place: out [count][splines]. */
lb_status lb_curve_splines(const lb_curve_knots *knots, size_t count, const double *x, double *out);

#ifdef __cplusplus
}
#endif

#endif
