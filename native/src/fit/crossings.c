/* Places of an open loop between points of a grid. */
#include "loop.h"

static const double bandwidth = 0.7079457843841379; /* |T| 3 dB down */
static const double of_frequency = 1e-12, of_log = 1e-7;
static const int root_steps = 60, nearest_steps = 60;

double lb_gain_side(lb_complex value) { return lb_log(lb_square(value)); }

double lb_phase_side(lb_complex value) { return value.im; }

double lb_bandwidth_side(lb_complex value) { return lb_log(lb_square(lb_closed(value)) / (bandwidth * bandwidth)); }

/* Place of the next try between x1 and x2 by inverse quadratic interpolation, where it is safe (Chandrupatla 1997). */
static double next_place(const double x[3], const double y[3], double least)
{
    const double xi = (x[0] - x[1]) / (x[2] - x[1]), phi = (y[0] - y[1]) / (y[2] - y[1]);
    double t = 0.5;
    if (phi * phi < xi && (1.0 - phi) * (1.0 - phi) < 1.0 - xi) {
        t = y[0] / (y[1] - y[0]) * (y[2] / (y[1] - y[2])) +
            (x[2] - x[0]) / (x[1] - x[0]) * (y[0] / (y[2] - y[0])) * (y[1] / (y[2] - y[1]));
    }
    return lb_clipped(t, least, 1.0 - least);
}

lb_crossing lb_root(const lb_loop *l, size_t at, lb_side side)
{
    const double *f = l->grid->frequency_hz;
    double x[3] = {f[at], f[at + 1u], 0.0}, y[3] = {side(l->curve[at]), side(l->curve[at + 1u]), 0.0}, t = 0.5;
    lb_crossing found = {0.0, {0.0, 0.0}, 1};
    for (int i = 0; i < root_steps; ++i) {
        const double now = x[0] + t * (x[1] - x[0]), of_it = side(lb_loop_at(l, now));
        if ((of_it > 0.0) == (y[0] > 0.0)) {
            x[2] = x[0];
            y[2] = y[0];
        } else {
            x[2] = x[1];
            y[2] = y[1];
            x[1] = x[0];
            y[1] = y[0];
        }
        x[0] = now;
        y[0] = of_it;
        const double least = of_frequency * now / fabs(x[1] - x[0]);
        if (!(least < 0.5) || of_it == 0.0) {
            break;
        }
        t = next_place(x, y, least);
    }
    found.frequency_hz = fabs(y[0]) < fabs(y[1]) || !lb_finite(y[1]) ? x[0] : x[1];
    found.value = lb_loop_at(l, found.frequency_hz);
    return found;
}

static double distance(const lb_loop *l, double log_frequency)
{
    lb_complex value = lb_loop_at(l, lb_exp(log_frequency));
    value.re += 1.0;
    return lb_log(lb_square(value));
}

/* Brent's minimum by parabolas and golden sections. */
static double least_between(const lb_loop *l, double low, double middle, double high)
{
    const double golden = 0.3819660112501051;
    double x = middle, w = middle, v = middle, before = 0.0, step = 0.0;
    double fx = distance(l, x), fw = fx, fv = fx;
    for (int i = 0; i < nearest_steps; ++i) {
        const double centre = 0.5 * (low + high);
        if (fabs(x - centre) <= 2.0 * of_log - 0.5 * (high - low)) {
            break;
        }
        const double r = (x - w) * (fx - fv), q0 = (x - v) * (fx - fw), p0 = (x - v) * q0 - (x - w) * r;
        const double q = 2.0 * (q0 - r), p = q > 0.0 ? -p0 : p0, size = fabs(q), last = before;
        before = step;
        if (fabs(p) < fabs(0.5 * size * last) && p > size * (low - x) && p < size * (high - x)) {
            step = p / size;
        } else {
            before = x < centre ? high - x : low - x;
            step = golden * before;
        }
        const double u = x + (fabs(step) >= of_log ? step : step > 0.0 ? of_log : -of_log), fu = distance(l, u);
        if (fu <= fx) {
            low = u >= x ? x : low;
            high = u >= x ? high : x;
            v = w, fv = fw, w = x, fw = fx, x = u, fx = fu;
        } else {
            low = u < x ? u : low;
            high = u < x ? high : u;
            if (fu <= fw || w == x) {
                v = w, fv = fw, w = u, fw = fu;
            } else if (fu <= fv || v == x || v == w) {
                v = u, fv = fu;
            }
        }
    }
    return x;
}

lb_crossing lb_nearest(const lb_loop *l)
{
    const double *f = l->grid->frequency_hz;
    size_t at = 0;
    double least = lb_infinity();
    for (size_t i = 0; i < l->grid->points; ++i) {
        const double re = 1.0 + l->curve[i].re, im = l->curve[i].im, size = re * re + im * im;
        at = size < least ? i : at;
        least = size < least ? size : least;
    }
    lb_crossing found = {f[at], l->curve[at], 1};
    if (at > 0u && at + 1u < l->grid->points) {
        found.frequency_hz = lb_exp(least_between(l, lb_log(f[at - 1u]), lb_log(f[at]), lb_log(f[at + 1u])));
        found.value = lb_loop_at(l, found.frequency_hz);
    }
    return found;
}
