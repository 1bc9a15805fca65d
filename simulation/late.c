#include "late.h"

#include "instruction_sets.h"

#include <math.h>

#define LANES LB_LATE_LANES
#define PAD LB_LATE_PAD
#define POLE (-0.267949192431122706472553658494127633) /* sqrt(3) - 2 */

/* The padded rows, times the gain of the filter, a lane for each. `lanes` is a constant wherever these are called, so
 * that a single row is not computed eight times. */
static inline void load(size_t lanes, size_t rows, size_t ticks, const double *in, double *c)
{
    const double gain = (1.0 - POLE) * (1.0 - 1.0 / POLE);
    for (size_t i = 0; i < lanes; ++i) {
        const double *row = in + (i < rows ? i : 0) * ticks;
        for (size_t n = 0; n < PAD; ++n) c[n * lanes + i] = row[0] * gain;
        for (size_t n = 0; n < ticks; ++n) c[(PAD + n) * lanes + i] = row[n] * gain;
        for (size_t n = PAD + ticks; n < ticks + 2 * PAD; ++n) c[n * lanes + i] = row[ticks - 1] * gain;
    }
}

/* The first coefficient of the forward pass, for rows that are reflected at both ends. */
static inline void begin(size_t lanes, size_t length, double *c)
{
    const double far = pow(POLE, (double)length);
    double first[LANES], share = POLE;
    for (size_t i = 0; i < lanes; ++i) {
        first[i] = c[i];
        c[i] += far * c[(length - 1) * lanes + i];
    }
    for (size_t n = 1; n < length && share != 0.0; ++n) { /* what follows a share of zero adds nothing */
        for (size_t i = 0; i < lanes; ++i) c[i] += share * (c[n * lanes + i] + far * c[(length - 1 - n) * lanes + i]);
        share *= POLE;
    }
    for (size_t i = 0; i < lanes; ++i) {
        c[i] *= POLE / (1.0 - far * far);
        c[i] += first[i];
    }
}

/* From values to the coefficients of the spline. */
static inline void filter(size_t lanes, size_t length, double *c)
{
    double now[LANES];
    begin(lanes, length, c);
    for (size_t i = 0; i < lanes; ++i) now[i] = c[i];
    for (size_t n = 1; n < length; ++n) {
        for (size_t i = 0; i < lanes; ++i) c[n * lanes + i] = now[i] = c[n * lanes + i] + POLE * now[i];
    }
    for (size_t i = 0; i < lanes; ++i) c[(length - 1) * lanes + i] = now[i] = now[i] * (POLE / (POLE - 1.0));
    for (size_t n = length - 1; n-- > 0;) {
        for (size_t i = 0; i < lanes; ++i) c[n * lanes + i] = now[i] = POLE * (now[i] - c[n * lanes + i]);
    }
}

/* Number of the coefficients at a place; beyond the ends, of those at the end. */
static inline size_t nearest(double place, size_t length)
{
    return place <= 0.0 ? 0 : place >= (double)(length - 1) ? length - 1 : (size_t)place;
}

static inline void interpolate(size_t lanes, size_t rows, size_t ticks, double samples, const double *c, double *out)
{
    const size_t length = ticks + 2 * PAD;
    for (size_t n = 0; n < ticks; ++n) {
        const double at = (double)n - samples + PAD, whole = floor(at), x = at - whole, z = 1.0 - x;
        const double before = z * z * z / 6.0;
        const double here = (x * x * (x - 2.0) * 3.0 + 4.0) / 6.0, next = (z * z * (z - 2.0) * 3.0 + 4.0) / 6.0;
        const double after = 1.0 - before - here - next;
        const double *c0 = c + lanes * nearest(whole - 1.0, length), *c1 = c + lanes * nearest(whole, length);
        const double *c2 = c + lanes * nearest(whole + 1.0, length), *c3 = c + lanes * nearest(whole + 2.0, length);
        double sum[LANES];
        for (size_t i = 0; i < lanes; ++i) sum[i] = 0.0 + c0[i] * before + c1[i] * here + c2[i] * next + c3[i] * after;
        for (size_t i = 0; i < rows; ++i) out[i * ticks + n] = sum[i];
    }
}

static inline void shift(size_t lanes, size_t rows, size_t ticks, double samples, const double *in, double *out,
                         double *c)
{
    load(lanes, rows, ticks, in, c);
    filter(lanes, ticks + 2 * PAD, c);
    interpolate(lanes, rows, ticks, samples, c, out);
}

void LB_FOR_SET(lb_late)(size_t rows, size_t ticks, double samples, const double *in, double *out, double *work)
{
    for (size_t first = 0; first < rows; first += LANES) {
        const size_t here = rows - first < LANES ? rows - first : LANES, at = first * ticks;
        if (here == 1)
            shift(1, 1, ticks, samples, in + at, out + at, work);
        else
            shift(LANES, here, ticks, samples, in + at, out + at, work);
    }
}
