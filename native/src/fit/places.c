/* Tables of the lines. */
#include "fit.h"

static lb_curve inverse_at(const lb_curve of, size_t i, lb_curve to)
{
    const double size = of.re[i] * of.re[i] + of.im[i] * of.im[i];
    to.re[i] = of.re[i] / size;
    to.im[i] = -of.im[i] / size;
    return to;
}

static void multiply_at(const lb_curve a, const lb_curve b, size_t i, lb_curve to)
{
    const double re = a.re[i] * b.re[i] - a.im[i] * b.im[i], im = a.re[i] * b.im[i] + a.im[i] * b.re[i];
    to.re[i] = re;
    to.im[i] = im;
}

void lb_find_places(lb_places *p, const double *frequency_hz, double rate_hz)
{
    p->tick = 1.0 / rate_hz;
    p->lowest_hz = p->highest_hz = frequency_hz[0];
    p->ticks = 0.0;
    for (size_t i = 0; i < p->width; ++i) {
        const double f = frequency_hz[i < p->lines ? i : 0u];
        p->lowest_hz = f < p->lowest_hz ? f : p->lowest_hz;
        p->highest_hz = f > p->highest_hz ? f : p->highest_hz;
        const double theta = 2.0 * LB_PI * f * p->tick;
        const lb_complex z = lb_turned(theta), half = lb_turned(0.5 * theta);
        p->theta[i] = theta;
        p->w.re[i] = -2.0 * half.im * half.im;
        p->w.im[i] = z.im;
        p->before.re[i] = z.re;
        p->before.im[i] = -z.im;
        multiply_at(p->w, p->w, i, p->square);
        inverse_at(p->w, i, p->once);
        multiply_at(p->once, p->before, i, p->once_late);
        multiply_at(p->once, p->once, i, p->twice);
        multiply_at(p->twice, p->before, i, p->twice_late);
    }
}
