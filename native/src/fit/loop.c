/* L = F·G at a frequency, its slopes, and Nyquist's criterion. */
#include "loop.h"

static const double frequency_step = 1e-5, of_sigma = 1e-3, of_value = 1e-7;

static lb_complex feedback_at(const lb_feedback *f, double frequency_hz)
{
    const double place = (lb_log(frequency_hz) - f->begin) / f->width;
    const double piece = lb_clipped(floor(place), 0.0, (double)(f->pieces - 1u));
    const double *c = f->coefficients + 2u * (LB_FEEDBACK_DEGREE + 1u) * (size_t)piece;
    const double x = 2.0 * (place - piece) - 1.0;
    lb_complex now = {0.0, 0.0}, before = {0.0, 0.0};
    for (size_t i = LB_FEEDBACK_DEGREE; i > 0u; --i) {
        const lb_complex next = {2.0 * x * now.re - before.re + c[2u * i],
                                 2.0 * x * now.im - before.im + c[2u * i + 1u]};
        before = now;
        now = next;
    }
    const lb_complex found = {x * now.re - before.re + c[0], x * now.im - before.im + c[1]};
    return found;
}

/* Tables of a single frequency. */
typedef struct {
    lb_places places;
    double theta, numbers[8][2];
} point_tables;

static void prepare(point_tables *t, double frequency_hz, double rate_hz)
{
    lb_places *p = &t->places;
    lb_curve *curves[] = {&p->w,         &p->square, &p->before,     &p->once,
                          &p->once_late, &p->twice,  &p->twice_late, &p->turned};
    p->lines = p->width = 1u;
    p->theta = &t->theta;
    for (size_t i = 0; i < sizeof curves / sizeof *curves; ++i) {
        curves[i]->re = &t->numbers[i][0];
        curves[i]->im = &t->numbers[i][1];
    }
    lb_find_places(p, &frequency_hz, rate_hz);
}

static lb_complex plant_at(point_tables *t, const lb_sampled *plant)
{
    lb_complex found;
    const lb_curve to = {&found.re, &found.im};
    lb_evaluate(&t->places, plant, to);
    return found;
}

void lb_open_loop(lb_loop *l, const double *values)
{
    const size_t n = l->model->parameters;
    const double tick = 1.0 / l->grid->rate_hz;
    double moved[LB_FIT_PARAMETERS];
    for (size_t i = 0; i < n; ++i) {
        moved[i] = values[i];
    }
    const lb_transfer t = lb_transfer_of(l->model, values);
    l->plant = lb_sampled_of(&t, tick, values[n - 1u]);
    for (size_t i = 0; i < n; ++i) {
        const double sigma = sqrt(l->covariance[i * n + i]);
        const double step =
            of_sigma * sigma > of_value * fabs(values[i]) ? of_sigma * sigma : of_value * fabs(values[i]);
        l->sigma[i] = sigma;
        /* A parameter without variance is not moved: it may be at its limit. */
        l->share[i] = sigma > 0.0 ? sigma / (2.0 * step) : 0.0;
        if (sigma > 0.0) {
            moved[i] = values[i] + step;
            const lb_transfer up = lb_transfer_of(l->model, moved);
            l->above[i] = lb_sampled_of(&up, tick, moved[n - 1u]);
            moved[i] = values[i] - step;
            const lb_transfer down = lb_transfer_of(l->model, moved);
            l->below[i] = lb_sampled_of(&down, tick, moved[n - 1u]);
            moved[i] = values[i];
        }
    }
}

lb_complex lb_loop_at(const lb_loop *l, double frequency_hz)
{
    point_tables t;
    prepare(&t, frequency_hz, l->grid->rate_hz);
    return lb_times(plant_at(&t, &l->plant), feedback_at(l->feedback, frequency_hz));
}

lb_slopes lb_slopes_at(const lb_loop *l, double frequency_hz)
{
    const double half_rate = l->grid->rate_hz / 2.0, up = frequency_hz * (1.0 + frequency_step);
    const double above = up < half_rate ? up : half_rate, below = frequency_hz * (1.0 - frequency_step);
    lb_slopes found;
    point_tables t;
    const lb_complex whole = lb_log_of(lb_over(lb_loop_at(l, above), lb_loop_at(l, below)));
    const double span = lb_log(above / below);
    found.by_frequency.re = whole.re / span;
    found.by_frequency.im = whole.im / span;
    prepare(&t, frequency_hz, l->grid->rate_hz);
    for (size_t i = 0; i < l->model->parameters; ++i) {
        lb_complex by = {0.0, 0.0};
        if (l->share[i] != 0.0) {
            /* F is the same in both. */
            by = lb_log_of(lb_over(plant_at(&t, &l->above[i]), plant_at(&t, &l->below[i])));
        }
        found.by[i].re = by.re * l->share[i];
        found.by[i].im = by.im * l->share[i];
    }
    return found;
}

/* Angles of 1 + L are followed by its changes of side at the negative real axis. */
static double turns_along(const lb_loop *l)
{
    double turns = 0.0;
    for (size_t i = 1; i < l->grid->points; ++i) {
        const lb_complex a = {1.0 + l->curve[i - 1u].re, l->curve[i - 1u].im},
                         b = {1.0 + l->curve[i].re, l->curve[i].im};
        const double across = a.re * b.im - a.im * b.re;
        turns += a.im >= 0.0 && b.im < 0.0 && across > 0.0 ? 1.0 : 0.0;
        turns -= a.im < 0.0 && b.im >= 0.0 && across < 0.0 ? 1.0 : 0.0;
    }
    return turns;
}

static double nearest_whole(double x) { return floor(x + 0.5); }

int lb_is_stable(const lb_loop *l)
{
    const size_t last = l->grid->points - 1u;
    const double *f = l->grid->frequency_hz;
    const double falls = 0.5 * (lb_log(lb_square(l->curve[1])) - lb_log(lb_square(l->curve[0])));
    const double integrators = nearest_whole(-falls / lb_log(f[1] / f[0])), begin = -integrators * LB_PI / 2.0;
    const lb_complex first = {1.0 + l->curve[0].re, l->curve[0].im}, end = {1.0 + l->curve[last].re, l->curve[last].im};
    const double turns = nearest_whole((lb_angle(first) - begin) / (2.0 * LB_PI));
    return fabs(lb_angle(end) + 2.0 * LB_PI * (turns_along(l) - turns)) < LB_PI / 2.0;
}
