#include "late.h"

#include "instruction_sets.h"

#include <math.h>

#define LANES LB_LATE_LANES
#define PAD LB_LATE_PAD
#define POLE (-0.267949192431122706472553658494127633) /* sqrt(3) - 2 */

/* The padded rows, times the gain of the filter, a lane for each. */
static void load(size_t rows, size_t ticks, const double *in, double (*c)[LANES])
{
    const double gain = (1.0 - POLE) * (1.0 - 1.0 / POLE);
    for (size_t i = 0; i < LANES; ++i) {
        const double *row = in + (i < rows ? i : 0) * ticks;
        for (size_t n = 0; n < PAD; ++n) c[n][i] = row[0] * gain;
        for (size_t n = 0; n < ticks; ++n) c[PAD + n][i] = row[n] * gain;
        for (size_t n = PAD + ticks; n < ticks + 2 * PAD; ++n) c[n][i] = row[ticks - 1] * gain;
    }
}

/* The first coefficient of the forward pass, for rows that are reflected at both ends. */
static void begin(size_t length, double (*c)[LANES])
{
    const double far = pow(POLE, (double)length);
    double first[LANES], share = POLE;
    for (size_t i = 0; i < LANES; ++i) {
        first[i] = c[0][i];
        c[0][i] += far * c[length - 1][i];
    }
    for (size_t n = 1; n < length && share != 0.0; ++n) { /* what follows a share of zero adds nothing */
        for (size_t i = 0; i < LANES; ++i) c[0][i] += share * (c[n][i] + far * c[length - 1 - n][i]);
        share *= POLE;
    }
    for (size_t i = 0; i < LANES; ++i) {
        c[0][i] *= POLE / (1.0 - far * far);
        c[0][i] += first[i];
    }
}

/* From values to the coefficients of the spline. */
static void filter(size_t length, double (*c)[LANES])
{
    begin(length, c);
    for (size_t n = 1; n < length; ++n) {
        for (size_t i = 0; i < LANES; ++i) c[n][i] += POLE * c[n - 1][i];
    }
    for (size_t i = 0; i < LANES; ++i) c[length - 1][i] *= POLE / (POLE - 1.0);
    for (size_t n = length - 1; n-- > 0;) {
        for (size_t i = 0; i < LANES; ++i) c[n][i] = POLE * (c[n + 1][i] - c[n][i]);
    }
}

/* The coefficients at a place; beyond the ends, those at the end. */
static const double *nearest(double place, size_t length, double (*c)[LANES])
{
    return c[place <= 0.0 ? 0 : place >= (double)(length - 1) ? length - 1 : (size_t)place];
}

static void interpolate(size_t rows, size_t ticks, double samples, double (*c)[LANES], double *out)
{
    const size_t length = ticks + 2 * PAD;
    for (size_t n = 0; n < ticks; ++n) {
        const double at = (double)n - samples + PAD, whole = floor(at), x = at - whole, z = 1.0 - x;
        const double before = z * z * z / 6.0;
        const double here = (x * x * (x - 2.0) * 3.0 + 4.0) / 6.0, next = (z * z * (z - 2.0) * 3.0 + 4.0) / 6.0;
        const double after = 1.0 - before - here - next;
        const double *c0 = nearest(whole - 1.0, length, c), *c1 = nearest(whole, length, c);
        const double *c2 = nearest(whole + 1.0, length, c), *c3 = nearest(whole + 2.0, length, c);
        double sum[LANES];
        for (size_t i = 0; i < LANES; ++i) sum[i] = 0.0 + c0[i] * before + c1[i] * here + c2[i] * next + c3[i] * after;
        for (size_t i = 0; i < rows; ++i) out[i * ticks + n] = sum[i];
    }
}

void LB_FOR_SET(lb_late)(size_t rows, size_t ticks, double samples, const double *in, double *out, double *work)
{
    double (*c)[LANES] = (double (*)[LANES])work;
    for (size_t first = 0; first < rows; first += LANES) {
        const size_t here = rows - first < LANES ? rows - first : LANES, at = first * ticks;
        load(here, ticks, in + at, c);
        filter(ticks + 2 * PAD, c);
        interpolate(here, ticks, samples, c, out + at);
    }
}
