/* exp, expm1, log, sin and cos from IEEE 754 operations alone: the same bits on every machine. Private.
 *
 * Argument reduction in two parts (Cody and Waite), then Taylor's series; errors below two units in the last place for
 * arguments of a fit. */
#ifndef LB_ELEMENTARY_H
#define LB_ELEMENTARY_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "lb_assert.h"

#define LB_PI 3.141592653589793

typedef struct {
    double re, im;
} lb_complex;

static inline double lb_not_a_number(void)
{
    const uint64_t bits = 0x7ff8000000000000u;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static inline double lb_infinity(void)
{
    const uint64_t bits = 0x7ff0000000000000u;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* Rounded once, as ldexp; exponents of a double. */
static inline double lb_scaled(double x, int exponent)
{
    const uint64_t low = (uint64_t)(exponent / 2 + 1023) << 52, high = (uint64_t)(exponent - exponent / 2 + 1023) << 52;
    double one, two;
    LB_ASSERT(exponent > -1100 && exponent < 1100);
    memcpy(&one, &low, sizeof one);
    memcpy(&two, &high, sizeof two);
    return x * one * two;
}

/* By Horner's rule, from the highest power. */
static inline double lb_polynomial(const double *c, size_t count, double x)
{
    double p = c[0];
    for (size_t i = 1; i < count; ++i) {
        p = p * x + c[i];
    }
    return p;
}

static inline double lb_exp(double x)
{
    static const double c[] = {1.0 / 6227020800.0,
                               1.0 / 479001600.0,
                               1.0 / 39916800.0,
                               1.0 / 3628800.0,
                               1.0 / 362880.0,
                               1.0 / 40320.0,
                               1.0 / 5040.0,
                               1.0 / 720.0,
                               1.0 / 120.0,
                               1.0 / 24.0,
                               1.0 / 6.0,
                               0.5,
                               1.0,
                               1.0};
    if (!(x > -700.0 && x < 700.0)) {
        return x != x ? x : x > 0.0 ? lb_infinity() : 0.0;
    }
    const double k = floor(x * 1.4426950408889634 + 0.5);
    const double r = (x - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;
    return lb_scaled(lb_polynomial(c, sizeof c / sizeof *c, r), (int)k);
}

static inline double lb_expm1(double x)
{
    static const double c[] = {1.0 / 1307674368000.0,
                               1.0 / 87178291200.0,
                               1.0 / 6227020800.0,
                               1.0 / 479001600.0,
                               1.0 / 39916800.0,
                               1.0 / 3628800.0,
                               1.0 / 362880.0,
                               1.0 / 40320.0,
                               1.0 / 5040.0,
                               1.0 / 720.0,
                               1.0 / 120.0,
                               1.0 / 24.0,
                               1.0 / 6.0,
                               0.5,
                               1.0};
    if (!(x > -0.5 && x < 0.5)) {
        return lb_exp(x) - 1.0;
    }
    return lb_polynomial(c, sizeof c / sizeof *c, x) * x;
}

/* Of a positive number that is not subnormal; NaN or infinite otherwise. */
static inline double lb_log(double x)
{
    uint64_t bits;
    double m;
    if (!(x >= 2.2250738585072014e-308)) {
        return x == x && x >= 0.0 ? -lb_infinity() : lb_not_a_number();
    }
    if (x - x != 0.0) {
        return x;
    }
    memcpy(&bits, &x, sizeof bits);
    double e = (double)((int)(bits >> 52) - 1022);
    bits = (bits & 0x000fffffffffffffu) | 0x3fe0000000000000u;
    memcpy(&m, &bits, sizeof m);
    if (m < 0.7071067811865476) {
        m = m * 2.0;
        e = e - 1.0;
    }
    const double s = (m - 1.0) / (m + 1.0), z = s * s;
    double p = 1.0 / 23.0;
    for (double odd = 21.0; odd > 0.0; odd -= 2.0) {
        p = p * z + 1.0 / odd;
    }
    return e * 6.93147180369123816490e-01 + (e * 1.90821492927058770002e-10 + 2.0 * s * p);
}

/* cos x + j·sin x for |x| below 1e6; NaN beyond. */
static inline lb_complex lb_turned(double x)
{
    static const double s[] = {1.0 / 355687428096000.0, -1.0 / 1307674368000.0, 1.0 / 6227020800.0, -1.0 / 39916800.0,
                               1.0 / 362880.0,          -1.0 / 5040.0,          1.0 / 120.0,        -1.0 / 6.0};
    static const double c[] = {-1.0 / 6402373705728000.0,
                               1.0 / 20922789888000.0,
                               -1.0 / 87178291200.0,
                               1.0 / 479001600.0,
                               -1.0 / 3628800.0,
                               1.0 / 40320.0,
                               -1.0 / 720.0,
                               1.0 / 24.0,
                               -0.5};
    if (!(x > -1e6 && x < 1e6)) {
        const lb_complex none = {lb_not_a_number(), lb_not_a_number()};
        return none;
    }
    const double k = floor(x * 0.6366197723675814 + 0.5);
    const double r = (x - k * 1.57079632673412561417) - k * 6.07710050650619224932e-11, z = r * r;
    double sine = s[0], cosine = c[0];
    for (size_t i = 1; i < sizeof s / sizeof *s; ++i) {
        sine = sine * z + s[i];
    }
    for (size_t i = 1; i < sizeof c / sizeof *c; ++i) {
        cosine = cosine * z + c[i];
    }
    sine = r + r * (z * sine);
    cosine = 1.0 + z * cosine;
    const int quarter = (int)((int64_t)k & 3);
    const lb_complex found[] = {{cosine, sine}, {-sine, cosine}, {-cosine, -sine}, {sine, -cosine}};
    return found[quarter];
}

/* e^(a + jb) − 1 without cancellation. */
static inline lb_complex lb_expm1_of(double a, double b)
{
    const lb_complex half = lb_turned(0.5 * b), whole = lb_turned(b);
    const lb_complex found = {lb_expm1(a) * whole.re - 2.0 * half.im * half.im, lb_exp(a) * whole.im};
    return found;
}

#endif
