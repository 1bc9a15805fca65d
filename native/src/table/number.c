/* A decimal number in a text. */
#include "decimal.h"

#define DIGITS 19 /* any so many fit in 64 bits */
#define EXPONENT_MAX 99999

/* Digits from p on; a number of more than DIGITS overflows. */
static const uint8_t *read_digits(const uint8_t *p, const uint8_t *end, uint64_t *w)
{
    uint64_t found = *w;
    for (; p < end && lb_is_digit(*p); ++p) {
        found = found * 10u + (uint64_t)(*p - '0');
    }
    *w = found;
    return p;
}

/* The exponent behind e or E; NULL if it has no digits. */
static const uint8_t *read_exponent(const uint8_t *p, const uint8_t *end, int *exponent)
{
    const int is_negative = p < end && *p == '-';
    int found = 0;
    p += p < end && (*p == '-' || *p == '+');
    if (p == end || !lb_is_digit(*p)) {
        return NULL;
    }
    for (; p < end && lb_is_digit(*p); ++p) {
        found = found < EXPONENT_MAX ? found * 10 + (*p - '0') : found;
    }
    *exponent += is_negative ? -found : found;
    return p;
}

/* The first DIGITS digits that count, of many between p and end; the number of those behind them. */
static int first_digits(const uint8_t *p, const uint8_t *end, uint64_t *w)
{
    int taken = 0, more = 0;
    *w = 0;
    for (; p < end; ++p) {
        if (!lb_is_digit(*p) || (taken == 0 && *p == '0')) {
            continue;
        }
        if (taken < DIGITS) {
            *w = *w * 10u + (uint64_t)(*p - '0');
            ++taken;
        } else {
            ++more;
        }
    }
    return more;
}

const uint8_t *lb_number(const uint64_t *powers, const uint8_t *p, const uint8_t *end, int decimal, double *value)
{
    const int is_negative = p < end && *p == '-';
    p += p < end && (*p == '-' || *p == '+');
    const uint8_t *first = p;
    uint64_t w = 0;
    p = read_digits(p, end, &w);
    ptrdiff_t digits = p - first, fraction = 0;
    if (p < end && *p == decimal) {
        const uint8_t *point = ++p;
        p = read_digits(p, end, &w);
        fraction = p - point;
        digits += fraction;
    }
    if (digits == 0 || digits > EXPONENT_MAX) {
        return NULL;
    }
    const uint8_t *last = p;
    int exponent = -(int)fraction;
    if (p < end && (*p | 0x20) == 'e') {
        p = read_exponent(p + 1, end, &exponent);
        if (!p) {
            return NULL;
        }
    }
    const int more = digits > DIGITS ? first_digits(first, last, &w) : 0;
    const double found = lb_nearest_double(powers, w, exponent + more);
    if (more && found < lb_nearest_double(powers, w + 1u, exponent + more)) {
        return NULL;
    }
    *value = is_negative ? -found : found;
    return p;
}
