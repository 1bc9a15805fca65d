/* Cubic splines over a position. The operations and their order are those of SciPy's BSpline. */
#include "livebode/curve.h"

#include "belt.h"

#define DEGREE LB_CURVE_DEGREE

typedef struct {
    double x[LB_LANES], value[DEGREE + 1u][LB_LANES];
    size_t first; /* of the splines that are not zero there */
} places;

static inline double clipped(double x, double low, double high)
{
    const double above = x > low ? x : low;
    return above < high ? above : high;
}

/* The interval of a place, knot[i] <= x < knot[i + 1], or the last one; `near` is one of them. */
static size_t interval_of(const lb_curve_knots *c, double x, size_t near)
{
    size_t i = near;
    while (i > DEGREE && x < c->knots[i]) {
        --i;
    }
    while (i + 1u < c->splines && x >= c->knots[i + 1u]) {
        ++i;
    }
    return i;
}

/* Values of the splines that are not zero in an interval, at places in it (de Boor's recursion). */
static inline void find_values(const lb_curve_knots *c, size_t interval, places *p)
{
    double (*h)[LB_LANES] = p->value, before[DEGREE][LB_LANES];
    p->first = interval - DEGREE;
    for (size_t k = 0; k < LB_LANES; ++k) {
        h[0][k] = 1.0;
    }
    for (size_t j = 1u; j <= DEGREE; ++j) {
        for (size_t n = 0; n < j; ++n) {
            for (size_t k = 0; k < LB_LANES; ++k) {
                before[n][k] = h[n][k];
            }
        }
        for (size_t k = 0; k < LB_LANES; ++k) {
            h[0][k] = 0.0;
        }
        for (size_t n = 1u; n <= j; ++n) {
            const double upper = c->knots[interval + n], lower = c->knots[interval + n - j];
            const int is_empty = upper == lower;
            for (size_t k = 0; k < LB_LANES; ++k) {
                const double share = is_empty ? 0.0 : before[n - 1u][k] / (upper - lower);
                h[n - 1u][k] += share * (upper - p->x[k]);
                h[n][k] = share * (p->x[k] - lower);
            }
        }
    }
}

static lb_status check(const lb_curve_knots *c, size_t count, const double *x, const double *out)
{
    if (!c || !c->knots || (count && (!x || !out))) {
        return LB_ERROR_NULL;
    }
    return c->splines > DEGREE ? LB_OK : LB_ERROR_SIZE;
}

/* Up to LB_LANES places, within the ends, that are in one interval; returns how many. */
static size_t load(const lb_curve_knots *c, size_t count, const double *x, size_t *interval, places *p)
{
    const double low = c->knots[0], high = c->knots[c->splines];
    const size_t most = count < LB_LANES ? count : LB_LANES;
    size_t here = 1u;
    for (size_t k = 0; k < LB_LANES; ++k) {
        p->x[k] = clipped(x[k < most ? k : 0u], low, high);
    }
    *interval = interval_of(c, p->x[0], *interval);
    while (here < most && interval_of(c, p->x[here], *interval) == *interval) {
        ++here;
    }
    return here;
}

lb_status lb_curve_at(const lb_curve_knots *knots, const lb_curve_shape *shape, size_t count, const double *x,
                      double *out)
{
    const lb_status status = check(knots, count, x, out);
    if (status != LB_OK || !shape || !shape->weights) {
        return status != LB_OK ? status : LB_ERROR_NULL;
    }
    const double low = knots->knots[0], high = knots->knots[knots->splines];
    size_t interval = DEGREE;
    for (size_t i = 0, here = 0; i < count; i += here) {
        places p;
        double value[LB_LANES] = {0.0};
        here = load(knots, count - i, x + i, &interval, &p);
        find_values(knots, interval, &p);
        for (size_t a = 0; a <= DEGREE; ++a) {
            for (size_t k = 0; k < LB_LANES; ++k) {
                value[k] += shape->weights[p.first + a] * p.value[a][k];
            }
        }
        for (size_t k = 0; k < here; ++k) {
            const double before = clipped(x[i + k] - low, -shape->reach, 0.0);
            const double beyond = clipped(x[i + k] - high, 0.0, shape->reach);
            out[i + k] = value[k] + before * shape->slope_before + beyond * shape->slope_beyond;
        }
    }
    return LB_OK;
}

lb_status lb_curve_splines(const lb_curve_knots *knots, size_t count, const double *x, double *out)
{
    const lb_status status = check(knots, count, x, out);
    if (status != LB_OK) {
        return status;
    }
    size_t interval = DEGREE;
    for (size_t i = 0, here = 0; i < count; i += here) {
        places p;
        here = load(knots, count - i, x + i, &interval, &p);
        find_values(knots, interval, &p);
        for (size_t k = 0; k < here; ++k) {
            double *const row = out + (i + k) * knots->splines;
            for (size_t n = 0; n < knots->splines; ++n) {
                row[n] = n >= p.first && n <= p.first + DEGREE ? p.value[n - p.first][k] : 0.0;
            }
        }
    }
    return LB_OK;
}
