/* A date and time in a text: 2024-05-01 12:00:00.000250, with a T in place of the blank, and a zone behind it. */
#include "decimal.h"

#define NS_PER_S 1000000000

/* So many digits as a number; negative if there are others. */
static int digits_at(const uint8_t *p, int count)
{
    int found = 0;
    for (int i = 0; i < count; ++i) {
        if (!lb_is_digit(p[i])) {
            return -1;
        }
        found = found * 10 + (p[i] - '0');
    }
    return found;
}

/* Days since 1970-01-01 of a date of the Gregorian calendar; years begin in March, so that a leap day is the last. */
static int64_t days_of(int year, int month, int day)
{
    const int y = year - (month <= 2), of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    return (int64_t)y * 365 + y / 4 - y / 100 + y / 400 + of_year - 719468;
}

static int days_in(int year, int month)
{
    const int is_leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    return month == 2 ? 28 + is_leap : 30 + (month + (month > 7)) % 2;
}

/* Seconds ahead of UTC, from Z, ±hh:mm or ±hhmm; NULL if there is no zone. */
static const uint8_t *read_zone(const uint8_t *p, const uint8_t *end, int *ahead_s)
{
    if (p < end && *p == 'Z') {
        *ahead_s = 0;
        return p + 1;
    }
    if (end - p < 5 || (*p != '+' && *p != '-')) {
        return NULL;
    }
    const int has_colon = p[3] == ':';
    if (end - p < 5 + has_colon) {
        return NULL;
    }
    const int hours = digits_at(p + 1, 2), minutes = digits_at(p + 3 + has_colon, 2);
    if (hours < 0 || hours > 23 || minutes < 0 || minutes > 59) {
        return NULL;
    }
    *ahead_s = (*p == '-' ? -60 : 60) * (hours * 60 + minutes);
    return p + 5 + has_colon;
}

static const uint8_t *read_fraction(const uint8_t *p, const uint8_t *end, int64_t *ns)
{
    int64_t unit = NS_PER_S;
    const uint8_t *first = ++p;
    for (; p < end && lb_is_digit(*p) && unit > 1; ++p) {
        unit /= 10;
        *ns += unit * (*p - '0');
    }
    return p == first ? NULL : p;
}

const uint8_t *lb_moment(const uint8_t *p, const uint8_t *end, int has_zone, int64_t *ns)
{
    if (end - p < 19 || p[4] != '-' || p[7] != '-' || (p[10] != ' ' && p[10] != 'T') || p[13] != ':' || p[16] != ':') {
        return NULL;
    }
    const int year = digits_at(p, 4), month = digits_at(p + 5, 2), day = digits_at(p + 8, 2);
    const int hour = digits_at(p + 11, 2), minute = digits_at(p + 14, 2), second = digits_at(p + 17, 2);
    const int is_date =
        year > 1677 && year < 2262 && month >= 1 && month <= 12 && day >= 1 && day <= days_in(year, month);
    if (!is_date || hour < 0 || hour > 23 || minute < 0 || minute > 59 || second < 0 || second > 59) {
        return NULL;
    }
    int64_t fraction_ns = 0;
    int ahead_s = 0;
    p += 19;
    if (p < end && *p == '.') {
        p = read_fraction(p, end, &fraction_ns);
    }
    if (p && has_zone) {
        p = read_zone(p, end, &ahead_s);
    }
    const int64_t of_day = (hour * 60 + minute) * 60 + second - ahead_s;
    *ns = (days_of(year, month, day) * 86400 + of_day) * NS_PER_S + fraction_ns;
    return p;
}
