/* Decimal digits and doubles. Private. */
#ifndef LB_DECIMAL_H
#define LB_DECIMAL_H

#include <string.h>

#include "livebode/table.h"
#include "lb_assert.h"

/* The double nearest to w · 10^q. */
double lb_nearest_double(const uint64_t *powers, uint64_t w, int q);

/* digits · 10^exponent, without trailing zeros. */
typedef struct {
    uint64_t digits;
    int exponent;
} lb_decimal;

/* The shortest decimal that is nearest to x, which is positive and finite. */
lb_decimal lb_shortest(const uint64_t *powers, double x);

/* The end of the number that begins here, and its value; NULL if there is none, or its digits do not suffice.
 * decimal -1: no mark is one. */
const uint8_t *lb_number(const uint64_t *powers, const uint8_t *p, const uint8_t *end, int decimal, double *value);

/* The end of the date and time that begins here; NULL if there is none, or in a rarer form. */
const uint8_t *lb_moment(const uint8_t *p, const uint8_t *end, int has_zone, int64_t *ns);

typedef struct {
    uint64_t high, low;
} lb_product;

static inline lb_product lb_multiply(uint64_t a, uint64_t b)
{
#if defined(__SIZEOF_INT128__) && !defined(LB_SCALAR)
    __extension__ typedef unsigned __int128 wide;
    const wide product = (wide)a * b;
    const lb_product found = {(uint64_t)(product >> 64), (uint64_t)product};
#else
    const uint64_t half = 0xFFFFFFFFu, a0 = a & half, a1 = a >> 32, b0 = b & half, b1 = b >> 32;
    const uint64_t low = a0 * b0, mid = a1 * b0 + (low >> 32), other = a0 * b1 + (mid & half);
    const lb_product found = {a1 * b1 + (mid >> 32) + (other >> 32), other << 32 | (low & half)};
#endif
    return found;
}

static inline const uint64_t *lb_power_of_ten(const uint64_t *powers, int q)
{
    LB_ASSERT(q >= LB_POWER_FIRST && q <= LB_POWER_LAST);
    return powers + 2 * (q - LB_POWER_FIRST);
}

static inline int lb_is_digit(uint8_t c) { return (uint8_t)(c - '0') < 10u; }

/* floor(x / 2^bits), also for negative x. */
static inline int lb_shifted(int x, int bits) { return x >= 0 ? x >> bits : -((-x + (1 << bits) - 1) >> bits); }

#endif
