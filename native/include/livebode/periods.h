/* A signal cut into its periods, x [periods][window]: their typical one, and how far they are from it. */
#ifndef LIVEBODE_PERIODS_H
#define LIVEBODE_PERIODS_H

#include <stddef.h>

#include "livebode/sdft.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LB_PERIODS_MAX 128u /* of which a typical one is found */
#define LB_PERIODS_WORK(window) (2u * (window) + 8u)

typedef struct {
    size_t periods, window; /* at least 1 */
    const double *x;
    lb_instruction_set set;
} lb_periods;

/* Median over the periods at each place: out [window]. Like all medians here, NaN where one of the samples is, and the
 * mean of the two middle ones of an even number. LB_ERROR_SIZE for more than LB_PERIODS_MAX. */
lb_status lb_periods_typical(const lb_periods *of, double *out);

/* Median of each period less another one [window], which may be missing: out [periods]; work [LB_PERIODS_WORK(window)].
 */
lb_status lb_periods_levels(const lb_periods *of, const double *less, double *work, double *out);

/* Straight pieces, from the middle of each period to that of the next one. */
typedef struct {
    const double *position;                /* of each place about the middle of the period [window] */
    size_t middle;                         /* the first place behind it */
    const double *level, *before, *behind; /* at the middle, and the slopes before it and behind it [periods] */
    double all;                            /* that remains of all levels */
} lb_periods_drift;

/* The periods without their drift: out [periods][window]. */
lb_status lb_periods_straighten(const lb_periods *of, const lb_periods_drift *drift, double *out);

/* The largest |x - typical| and |x| of each period: far, size [periods]. */
lb_status lb_periods_reach(const lb_periods *of, const double *typical, double *far, double *size);

#ifdef __cplusplus
}
#endif

#endif
