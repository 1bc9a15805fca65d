/* What the lines of a row have in common, and what follows from the number of windows. Private. */
#ifndef LB_LINE_FACTS_H
#define LB_LINE_FACTS_H

#include "moments.h"
#include "rows.h"

/* Σv − Σv²/Σv is exactly 0 for one window, except for rounding. */
static const double lb_several = 1e-9;
/* Logarithms of 10,000 and 4: how seldom noise alone has a trend at one line, and how often at any. */
static const double lb_log_rare = 9.210340371976184, lb_log_usual = 1.3862943611198906;
/* Degrees of freedom below which a trend cannot be told from noise. */
static const double lb_trend_dof_min = 2.0;
/* (1 − 1/e)²/4: a linear change over m periods is within (1 − 1/e)·m/2 of its middle as often as noise within sigma. */
static const double lb_linear_share = 0.09989410140273;
/* What is slower than a period, but no trend: between a sine, 1.4, and a step, 1. */
static const double lb_erratic_share = 1.3;

static const union {
    uint64_t bits;
    double value;
} lb_not_a_number = {0x7ff8000000000000u}, lb_infinite = {0x7ff0000000000000u};
#define LB_NOT_A_NUMBER (lb_not_a_number.value)
#define LB_INFINITE (lb_infinite.value)

/* What follows from the number of windows in the moments. */
typedef struct {
    int64_t before, count; /* without this window, and those of which the value is */
    double share;          /* of another window in the mean */
    double of_mean;        /* variance of the mean over that of one window; 1 where there is no average */
    double variance;       /* times a scatter: variance of one window */
    double dof;            /* of the variance, from the scatter or the detection lines */
    double dof_scatter;    /* NaN for fewer than two windows */
    double dof_moving;     /* of the variance, where the machine moves */
    double bias;           /* times 1 − γ²: the share without the bias of the coherence */
    /* Of changes: numbers by which their moments are multiplied. */
    double turn;        /* error of another window, for the trend */
    double trend_share; /* power of the trend, for its part of the scatter */
    double detrended;   /* scatter without that, for the variance of one window; NaN for fewer than four */
    double steps;       /* power of the steps, for the variance of one window */
    double trend_noise; /* that variance, for the power of a trend by chance */
    double rare, usual; /* and for a power that chance exceeds once in 10,000 windows, and in four */
    double spread;      /* power of a trend, for the variance of the response about what the value is of */
    double erratic;     /* variance beyond noise of one window, likewise */
} lb_weight_facts;

/* What the lines of a row have in common. */
typedef struct {
    size_t row, place;
    const double *output, *denominator, *reference;
    const lb_weight_facts *of;
    int usable, seen, moving, several;
    int trends, varies; /* as most lines of the previous window at this place */
    double dof;
    double excited_above;       /* power of the reference */
    lb_lanes least_dof;         /* of lines with errors that repeat */
    lb_mask widened;            /* by errors that repeat */
    lb_lanes trending, varying; /* numbers of lines */
} lb_row_facts;

/* d·(exp(log/d) − 1): what F(2, 2d) exceeds with the probability exp(−log), as (1 + x/64)^64 by squares. */
static double lb_exceeded(double log, double dof)
{
    double power = 1.0 + log / (64.0 * dof);
    for (int i = 0; i < 6; ++i) {
        power *= power;
    }
    return dof * (power - 1.0);
}

static void lb_add_change_facts(const lb_line_job *j, const lb_weight_sums *w, double unbiased, lb_weight_facts *f)
{
    const lb_weight_sums past = lb_sums_of(j->weights, f->before);
    const double dof = f->dof_scatter - 1.0, periods = w->one * w->one / w->two, slope = 1.0 / w->spread;
    const int known = dof >= lb_trend_dof_min;
    f->turn = f->before ? (1.0 - f->share) * (1.0 + past.ages / past.one) : 0.0;
    f->trend_share = slope;
    f->detrended = known ? 1.0 / (unbiased - w->spread_two * slope) : LB_NOT_A_NUMBER;
    f->steps = known ? 0.5 / lb_sums_of(j->weights, f->count - 1).one : LB_NOT_A_NUMBER;
    f->trend_noise = w->spread_two;
    f->rare = w->spread_two * lb_exceeded(lb_log_rare, dof);
    f->usual = w->spread_two * lb_exceeded(lb_log_usual, dof);
    f->spread = lb_linear_share * slope * slope * (j->s->averages ? periods * periods : 1.0);
    f->erratic = j->s->averages ? lb_erratic_share : 0.0; /* within one window it is none */
}

static lb_weight_facts lb_facts_of(const lb_line_job *j, int64_t before, int64_t count)
{
    const lb_weight_sums w = lb_sums_of(j->weights, count);
    const double rest = w.one - w.two / w.one, unbiased = rest > lb_several ? rest : LB_NOT_A_NUMBER;
    const double ratio = w.two / w.one, of_mean = w.two / (w.one * w.one);
    lb_weight_facts f = {.before = before, .count = count, .share = 1.0 / lb_sums_of(j->weights, before + 1).one};
    f.dof_scatter = unbiased * unbiased / (w.two - 2.0 * w.three / w.one + ratio * ratio);
    f.variance = 1.0 / unbiased;
    f.of_mean = j->s->averages ? of_mean : 1.0;
    f.bias = 1.0 / (1.0 - of_mean);
    f.dof = f.dof_scatter;
    if (j->s->noise == LB_NOISE_LARGER && !lb_is_finite(f.dof)) {
        f.dof = j->s->noise_dof;
    }
    f.dof_moving = j->s->noise != LB_NOISE_SCATTER ? j->s->noise_dof / f.of_mean : f.dof;
    lb_add_change_facts(j, &w, unbiased, &f);
    return f;
}

#endif
