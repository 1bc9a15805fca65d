/* Weighted moments of line spectra, a few lines at a time. Private. */
#ifndef LB_MOMENTS_H
#define LB_MOMENTS_H

#include "../lb_assert.h"
#include "livebode/lines.h"

/* Lines of a row that are processed together: what is known of them stays in the first-level cache. */
#define LB_TOGETHER 32u

/* Order of the means. */
enum { NUM_RE, NUM_IM, DEN_RE, DEN_IM, REF_RE, REF_IM, REF_POWER, OUT_POWER, NOISE_POWER, DEN_POWER };

typedef struct {
    double of[LB_LINE_MEANS][LB_TOGETHER];
} lb_window;

/* Sums of weights: Σλ^i, Σλ^2i, Σλ^3i. */
typedef struct {
    double one, two, three;
} lb_weight_sums;

static inline int lb_is_finite(double x) { return x - x == 0.0; }

/* As numpy.maximum: NaN where one of them is; as numpy.fmax and numpy.fmin: NaN where both are. */
static inline double lb_maximum(double a, double b) { return a >= b || a != a ? a : b; }
static inline double lb_fmax(double a, double b) { return a >= b || b != b ? a : b; }
static inline double lb_fmin(double a, double b) { return a <= b || b != b ? a : b; }

static inline lb_weight_sums lb_sums_of(const lb_line_weights *w, int64_t count)
{
    LB_ASSERT(count >= 0);
    lb_weight_sums s = {(double)count, (double)count, (double)count};
    if (w->forgetting != 1.0) {
        const size_t at = (uint64_t)count < w->length ? (size_t)count : w->length - 1u;
        s.one = w->table[at];
        s.two = w->table[w->length + at];
        s.three = w->table[2u * w->length + at];
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

/* Adds some lines of a window to the moments of its place, by deviations (West 1979). Where it has no noise, that of
 * the mean is written to it. `share` is its share of the mean. */
void lb_moments_add(const lb_line_moments *m, size_t at, double forgetting, double share, size_t count, lb_window *now);

#endif
