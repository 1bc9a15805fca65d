/* From a double to the shortest decimal that gives it again: Giulietti, "The Schubfach way to render doubles" (2020).
 */
#include "decimal.h"

#define MANTISSA 52

static uint64_t to_odd(const uint64_t *power, uint64_t x)
{
    const lb_product low = lb_multiply(power[1], x);
    lb_product high = lb_multiply(power[0], x);
    high.low += low.high;
    high.high += high.low < low.high;
    return high.high | (high.low > 1);
}

static lb_decimal stripped(uint64_t digits, int exponent)
{
    LB_ASSERT(digits != 0);
    for (; digits % 10u == 0; digits /= 10u) {
        ++exponent;
    }
    const lb_decimal found = {digits, exponent};
    return found;
}

/* The table is truncated from 10^56 on; here it is rounded up. */
static void power_above(const uint64_t *powers, int q, uint64_t *power)
{
    const uint64_t *of = lb_power_of_ten(powers, q);
    power[1] = of[1] + (q > 55);
    power[0] = of[0] + (power[1] < of[1]);
}

lb_decimal lb_shortest(const uint64_t *powers, double x)
{
    uint64_t bits, power[2];
    memcpy(&bits, &x, sizeof bits);
    const uint64_t fraction = bits & (((uint64_t)1 << MANTISSA) - 1);
    const int biased = (int)(bits >> MANTISSA);
    LB_ASSERT(bits != 0 && biased < 2047);
    const uint64_t c = biased ? fraction | (uint64_t)1 << MANTISSA : fraction;
    const int q = (biased ? biased : 1) - 1075;
    if (q <= 0 && q > -53 && (c & (((uint64_t)1 << -q) - 1)) == 0) {
        return stripped(c >> -q, 0);
    }
    /* Below a power of two, the next double is half as far away. */
    const int is_closer = fraction == 0 && biased > 1, is_odd = (int)(c & 1);
    const int k = lb_shifted(q * 1262611 - (is_closer ? 524031 : 0), 22), h = q + lb_shifted(-k * 1741647, 19) + 1;
    power_above(powers, -k, power);
    const uint64_t value = to_odd(power, (4 * c) << h);
    const uint64_t lower = to_odd(power, (4 * c - 2 + (uint64_t)is_closer) << h) + (uint64_t)is_odd;
    const uint64_t upper = to_odd(power, (4 * c + 2) << h) - (uint64_t)is_odd;
    const uint64_t s = value / 4, tens = s / 10;
    if (s >= 10) {
        const int below = lower <= 40 * tens, above = 40 * tens + 40 <= upper;
        if (below != above) {
            return stripped(tens + (uint64_t)above, k + 1);
        }
    }
    const int below = lower <= 4 * s, above = 4 * s + 4 <= upper;
    if (below != above) {
        return stripped(s + (uint64_t)above, k);
    }
    const uint64_t middle = 4 * s + 2;
    return stripped(s + (value > middle || (value == middle && (s & 1))), k);
}
