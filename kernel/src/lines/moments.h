/* Weighted moments of line spectra, a few lines at a time. Private. */
#ifndef LB_MOMENTS_H
#define LB_MOMENTS_H

#include "../lb_assert.h"
#include "lanes.h"
#include "livebode/lines.h"

/* Order of the means. */
enum { NUM_RE, NUM_IM, DEN_RE, DEN_IM, REF_RE, REF_IM, REF_POWER, OUT_POWER, NOISE_POWER, DEN_POWER };
/* Order of the scatter. */
enum { NUM_SCATTER, DEN_SCATTER, SHARED_RE, SHARED_IM };
/* Order of the changes. */
enum { STEPS, TREND_RE, TREND_IM, NEWEST_RE, NEWEST_IM };

/* Some lines of a window, and of the moments of its place, as they are in registers. */
typedef struct {
    lb_lanes of[LB_LINE_MEANS];
} lb_window;
typedef struct {
    lb_lanes mean[LB_LINE_MEANS], scatter[LB_LINE_SCATTER];
} lb_some_moments;
/* Deviations of a window from the means before it: re and im of numerator and denominator. */
typedef struct {
    lb_lanes of[4];
} lb_deviation;

/* Numerator over denominator, and 1/|denominator|². */
typedef struct {
    lb_lanes re, im, inverse;
} lb_quotient;

/* Sums of weights: Σλ^i, Σλ^2i, Σλ^3i, Σiλ^i, and Σλ^i(i − μ)², Σλ^2i(i − μ)². */
typedef struct {
    double one, two, three, ages, spread, spread_two;
} lb_weight_sums;

static inline int lb_is_finite(double x) { return x - x == 0.0; }

/* As numpy.maximum: NaN where one of them is; as numpy.fmax and numpy.fmin: NaN where both are. */
static inline double lb_maximum(double a, double b) { return a >= b || a != a ? a : b; }
static inline double lb_fmax(double a, double b) { return a >= b || b != b ? a : b; }
static inline double lb_fmin(double a, double b) { return a <= b || b != b ? a : b; }

static inline lb_weight_sums lb_sums_of(const lb_line_weights *w, int64_t count)
{
    LB_ASSERT(count >= 0);
    const double c = (double)count, ages = 0.5 * c * (c - 1.0), spread = c * (c * c - 1.0) / 12.0;
    lb_weight_sums s = {c, c, c, ages, spread, spread};
    if (w->forgetting != 1.0) {
        const size_t at = (uint64_t)count < w->length ? (size_t)count : w->length - 1u;
        s.one = w->table[at];
        s.two = w->table[w->length + at];
        s.three = w->table[2u * w->length + at];
        s.ages = w->table[3u * w->length + at];
        s.spread = w->table[4u * w->length + at];
        s.spread_two = w->table[5u * w->length + at];
    }
    return s;
}

/* The moments of a place, `first` lines further; quantities follow at lb_step. */
static inline size_t lb_place(const lb_line_moments *m, size_t place, size_t first)
{
    LB_ASSERT(place < m->places && first < m->lines);
    return place * m->lines + first;
}

static inline size_t lb_step(const lb_line_moments *m) { return m->places * m->lines; }

LB_INLINE lb_some_moments lb_load_moments(const lb_line_moments *m, size_t at, size_t count)
{
    lb_some_moments s;
    for (size_t q = 0; q < LB_LINE_MEANS; ++q) {
        s.mean[q] = lb_load(m->means + q * lb_step(m) + at, count);
    }
    for (size_t q = 0; q < LB_LINE_SCATTER; ++q) {
        s.scatter[q] = lb_load(m->scatter + q * lb_step(m) + at, count);
    }
    return s;
}

LB_INLINE void lb_store_moments(const lb_line_moments *m, size_t at, size_t count, const lb_some_moments *s)
{
    for (size_t q = 0; q < LB_LINE_MEANS; ++q) {
        lb_store(m->means + q * lb_step(m) + at, s->mean[q], count);
    }
    for (size_t q = 0; q < LB_LINE_SCATTER; ++q) {
        lb_store(m->scatter + q * lb_step(m) + at, s->scatter[q], count);
    }
}

/* A window with the start or end of the excitation has no noise: the mean is of the others. */
LB_INLINE void lb_complete_noise(lb_lanes *mean, double share, lb_lanes *now)
{
    *mean = lb_select(lb_are_numbers(*mean), *mean, *now);
    if (share < 1.0) {
        *now = lb_select(lb_are_numbers(*now), *now, *mean);
    }
}

/* Adds some lines of a window to the moments of its place, by deviations (West 1979), which are returned. `share` is
 * its share of the mean. */
LB_INLINE lb_deviation lb_add_window(lb_some_moments *s, double forgetting, double share, const lb_window *window)
{
    lb_window now = *window;
    lb_lanes deviation[LB_LINE_MEANS];
    const double kept = 1.0 - share;
    LB_ASSERT(share > 0.0 && share <= 1.0);
    lb_complete_noise(&s->mean[NOISE_POWER], share, &now.of[NOISE_POWER]);
    for (size_t q = 0; q < LB_LINE_MEANS; ++q) {
        deviation[q] = now.of[q] - s->mean[q];
        s->mean[q] += deviation[q] * share;
    }
    const lb_lanes nr = deviation[NUM_RE], ni = deviation[NUM_IM], dr = deviation[DEN_RE], di = deviation[DEN_IM];
    const lb_lanes found[LB_LINE_SCATTER] = {nr * nr + ni * ni, dr * dr + di * di, nr * dr + ni * di,
                                             ni * dr - nr * di};
    for (size_t q = 0; q < LB_LINE_SCATTER; ++q) {
        s->scatter[q] = s->scatter[q] * forgetting + found[q] * kept;
    }
    return (lb_deviation){{nr, ni, dr, di}};
}

LB_INLINE lb_quotient lb_divided(const lb_lanes *pair)
{
    const lb_lanes nr = pair[NUM_RE], ni = pair[NUM_IM], dr = pair[DEN_RE], di = pair[DEN_IM];
    const lb_lanes inverse = 1.0 / (dr * dr + di * di);
    return (lb_quotient){(nr * dr + ni * di) * inverse, (ni * dr - nr * di) * inverse, inverse};
}

#endif
