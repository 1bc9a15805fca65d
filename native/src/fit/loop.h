/* The open loop at single frequencies. Private. */
#ifndef LB_LOOP_H
#define LB_LOOP_H

#include "fit.h"
#include "livebode/margins.h"

/* A row: the plant at its values, and with each parameter moved up and down. */
typedef struct {
    const lb_fit_model *model;
    const lb_feedback *feedback;
    const lb_margin_grid *grid;
    const double *covariance;
    double sigma[LB_FIT_PARAMETERS], share[LB_FIT_PARAMETERS]; /* share: a change to one per sigma */
    lb_sampled plant, above[LB_FIT_PARAMETERS], below[LB_FIT_PARAMETERS];
    lb_complex *curve; /* L on the grid */
} lb_loop;

/* Where a margin is read. */
typedef struct {
    double frequency_hz;
    lb_complex value; /* L */
    int is_found;
} lb_crossing;

/* Change of ln L by ln f and by each parameter in its sigmas. */
typedef struct {
    lb_complex by_frequency, by[LB_FIT_PARAMETERS];
} lb_slopes;

static inline double lb_square(lb_complex x) { return x.re * x.re + x.im * x.im; }

static inline lb_complex lb_times(lb_complex a, lb_complex b)
{
    const lb_complex found = {a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
    return found;
}

static inline lb_complex lb_over(lb_complex a, lb_complex b)
{
    const double size = lb_square(b);
    const lb_complex found = {(a.re * b.re + a.im * b.im) / size, (a.im * b.re - a.re * b.im) / size};
    return found;
}

/* L/(1 + L) */
static inline lb_complex lb_closed(lb_complex value)
{
    const lb_complex return_difference = {1.0 + value.re, value.im};
    return lb_over(value, return_difference);
}

/* Its angle by the half angle, twice, and Taylor's series. */
static inline double lb_angle(lb_complex x)
{
    const double a = fabs(x.re), b = fabs(x.im), large = a > b ? a : b, small = a > b ? b : a;
    double t = large > 0.0 ? small / large : 0.0;
    t = t / (1.0 + sqrt(1.0 + t * t));
    t = t / (1.0 + sqrt(1.0 + t * t));
    double p = 1.0 / 25.0;
    for (double odd = 23.0; odd > 0.0; odd -= 2.0) {
        p = 1.0 / odd - t * t * p;
    }
    double angle = 4.0 * t * p;
    angle = b > a ? LB_PI / 2.0 - angle : angle;
    angle = x.re < 0.0 ? LB_PI - angle : angle;
    return x.im < 0.0 ? -angle : angle;
}

static inline lb_complex lb_log_of(lb_complex x)
{
    const lb_complex found = {0.5 * lb_log(lb_square(x)), lb_angle(x)};
    return found;
}

/* loop.c */
void lb_open_loop(lb_loop *l, const double *values);
lb_complex lb_loop_at(const lb_loop *l, double frequency_hz);
lb_slopes lb_slopes_at(const lb_loop *l, double frequency_hz);
int lb_is_stable(const lb_loop *l);
/* crossings.c */
typedef double (*lb_side)(lb_complex value);
double lb_gain_side(lb_complex value);
double lb_phase_side(lb_complex value);
double lb_bandwidth_side(lb_complex value);
lb_crossing lb_root(const lb_loop *l, size_t at, lb_side side);
lb_crossing lb_nearest(const lb_loop *l);

#endif
