/* From decimal digits to the nearest double: Lemire, "Number parsing at a gigabyte per second" (2021), and Mushtak and
 * Lemire, "Fast number parsing without fallback" (2023). */
#include "decimal.h"

#define MANTISSA 52
#define EXPONENT_BIAS 1023
#define INFINITE 2047
/* 10^q is a double up to here (Clinger 1990). */
#define EXACT 22
static const double exact[EXACT + 1] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                        1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

static int leading_zeros(uint64_t x)
{
    LB_ASSERT(x != 0);
#if defined(__GNUC__)
    return __builtin_clzll(x);
#else
    int count = 0;
    for (; !(x >> 63); x <<= 1) {
        ++count;
    }
    return count;
#endif
}

static double of_bits(uint64_t mantissa, int exponent)
{
    const uint64_t bits = mantissa | (uint64_t)exponent << MANTISSA;
    double value;
    LB_ASSERT(exponent >= 0 && exponent <= INFINITE);
    memcpy(&value, &bits, sizeof value);
    return value;
}

static double nearest(const uint64_t *powers, uint64_t w, int q)
{
    const int zeros = leading_zeros(w);
    const uint64_t *power = lb_power_of_ten(powers, q);
    lb_product z = lb_multiply(w << zeros, power[0]);
    if ((z.high & 0x1FF) == 0x1FF) { /* the lower half may change the bits that decide */
        const uint64_t more = lb_multiply(w << zeros, power[1]).high;
        z.low += more;
        z.high += z.low < more;
    }
    const int upper = (int)(z.high >> 63), shift = upper + 64 - MANTISSA - 3;
    uint64_t mantissa = z.high >> shift;
    int exponent = lb_shifted(217706 * q, 16) + 63 + upper - zeros + EXPONENT_BIAS;
    if (exponent <= 0) {
        if (exponent <= -63) {
            return 0.0;
        }
        mantissa >>= 1 - exponent;
        mantissa = (mantissa + (mantissa & 1)) >> 1;
        return of_bits(mantissa, 0); /* a carry into the exponent is the smallest normal number */
    }
    if (z.low <= 1 && q >= -4 && q <= 23 && (mantissa & 3) == 1 && mantissa << shift == z.high) {
        mantissa &= ~(uint64_t)1; /* exactly between two doubles: to the even one */
    }
    mantissa = (mantissa + (mantissa & 1)) >> 1;
    if (mantissa >> (MANTISSA + 1)) {
        mantissa >>= 1;
        ++exponent;
    }
    return exponent >= INFINITE ? of_bits(0, INFINITE) : of_bits(mantissa & (((uint64_t)1 << MANTISSA) - 1), exponent);
}

double lb_nearest_double(const uint64_t *powers, uint64_t w, int q)
{
    if (w >> (MANTISSA + 1) == 0 && q >= -EXACT && q <= EXACT) {
        return q < 0 ? (double)w / exact[-q] : (double)w * exact[q];
    }
    if (w == 0 || q < LB_POWER_FIRST) {
        return 0.0;
    }
    return q > 308 ? of_bits(0, INFINITE) : nearest(powers, w, q);
}
