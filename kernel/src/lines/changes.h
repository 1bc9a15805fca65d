/* Changes of the machine in the scatter of the periods: their moments, and what they add. Private. */
#ifndef LB_LINE_CHANGES_H
#define LB_LINE_CHANGES_H

#include "facts.h"

/* A trend counts at all lines where significantly more of them than a quarter (2.5 standard deviations), and 40 %, have
 * one that noise has in a quarter of the windows; likewise where significantly more than half, and 65 %, have more
 * scatter than steps. Squares of 2.5 · √3 and 2.5. */
static const double lb_several_trends = 18.75, lb_several_scatters = 6.25;
/* At one line the scatter is so many times the steps: by noise once in 10,000 windows or less, of six or more. */
static const double lb_scatter_rare = 2.5;
static const double lb_trends_min = 0.6, lb_scatters_min = 0.3; /* of the lines, 4 · 0.4 − 1 and 2 · 0.65 − 1 */

/* Changes of some lines of a place. */
typedef struct {
    lb_lanes of[LB_LINE_CHANGES];
} lb_some_changes;

LB_INLINE lb_some_changes lb_load_changes(const lb_line_moments *m, size_t at, size_t count)
{
    lb_some_changes c;
    for (size_t q = 0; q < LB_LINE_CHANGES; ++q) {
        c.of[q] = lb_load(m->change + q * lb_step(m) + at, count);
    }
    return c;
}

LB_INLINE void lb_store_changes(const lb_line_moments *m, size_t at, size_t count, const lb_some_changes *c)
{
    for (size_t q = 0; q < LB_LINE_CHANGES; ++q) {
        lb_store(m->change + q * lb_step(m) + at, c->of[q], count);
    }
}

/* Adds the error of a window to the changes, from its deviations from the means before it. */
LB_INLINE void lb_add_change(const lb_line_job *j, const lb_row_facts *f, const lb_deviation *d,
                             const lb_quotient *ratio, lb_some_changes *c)
{
    const lb_lanes re = ratio->re, im = ratio->im;
    lb_lanes now[2] = {d->of[0] - (re * d->of[2] - im * d->of[3]), d->of[1] - (re * d->of[3] + im * d->of[2])};
    lb_lanes power = lb_all(0.0);
    for (size_t i = 0; i < 2u; ++i) {
        now[i] = lb_select(lb_are_finite(now[i]), now[i], lb_all(0.0));
        const lb_lanes step = now[i] - c->of[NEWEST_RE + i];
        power += step * step;
        c->of[TREND_RE + i] = c->of[TREND_RE + i] * j->weights->forgetting + now[i] * f->of->turn;
        c->of[NEWEST_RE + i] = now[i] * (1.0 - f->of->share);
    }
    c->of[STEPS] = c->of[STEPS] * j->weights->forgetting + power;
}

/* Parts of the scatter: noise of one window, and the variance of the response about what the value is of. A trend is
 * tested as a regression is; what else is slower than a period has more scatter than steps (J. von Neumann, Ann. Math.
 * Stat. 12, 1941). */
LB_INLINE lb_lanes lb_divided_scatter(lb_row_facts *f, lb_lanes total, const lb_some_changes *c, lb_lanes *variation)
{
    const lb_weight_facts *of = f->of;
    const lb_lanes zero = lb_all(0.0), one = lb_all(1.0);
    const lb_lanes trend = c->of[TREND_RE] * c->of[TREND_RE] + c->of[TREND_IM] * c->of[TREND_IM];
    const lb_lanes rest = lb_at_least(0.0, total - trend * of->trend_share) * of->detrended;
    const lb_lanes steps = c->of[STEPS] * of->steps, all = total * of->variance;
    f->trending += lb_select(lb_above(trend, rest * of->usual), one, zero);
    f->varying += lb_select(lb_above(all, steps), one, zero);
    const lb_mask slower = lb_above(rest, steps * (f->varies ? 1.0 : lb_scatter_rare));
    lb_mask trends = lb_above(trend, rest * of->rare) | slower;
    if (f->trends) {
        trends = lb_are_numbers(rest);
    }
    const lb_lanes linear = lb_at_least(0.0, trend - rest * of->trend_noise) * of->spread;
    *variation = lb_select(trends, linear, lb_select(lb_are_numbers(rest), zero, rest));
    *variation += lb_select(slower, (rest - steps) * of->erratic, zero);
    const lb_lanes noise = lb_select(slower, steps, lb_select(trends, rest, all));
    return noise;
}

/* Whether more of the lines than chance explains had a change in the previous window at this place. */
LB_INLINE void lb_judge_changes(const lb_line_job *j, lb_row_facts *f)
{
    const double lines = (double)j->m->lines;
    const double *of_place = j->m->moment + 3u * j->m->places + f->place;
    const double trends = 4.0 * of_place[0] - lines, scatters = 2.0 * of_place[j->m->places] - lines;
    f->varies = scatters > lb_scatters_min * lines && scatters * scatters > lb_several_scatters * lines;
    f->trends = f->varies || (trends > lb_trends_min * lines && trends * trends > lb_several_trends * lines);
    f->trending = lb_all(0.0);
    f->varying = lb_all(0.0);
}

LB_INLINE double lb_total(lb_lanes counts)
{
    double sum = 0.0;
    for (size_t i = 0; i < LB_LANES; ++i) {
        sum += lb_lane(&counts, i);
    }
    return sum;
}

LB_INLINE void lb_write_changes(const lb_line_job *j, const lb_row_facts *f)
{
    double *of_place = j->m->moment + 3u * j->m->places + f->place;
    if (f->usable) {
        of_place[0] = lb_total(f->trending);
        of_place[j->m->places] = lb_total(f->varying);
    }
}

#endif
