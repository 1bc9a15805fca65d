/* Frequency responses with their scatter: one pass over the windows, whose lines stay in registers from the spectra to
 * the results. Compiled once for each instruction set. */
#include "rows.h"

#include "moments.h"

#ifndef LB_LINES_NAME
#define LB_LINES_NAME lb_lines_baseline
#endif

/* A window counts as excited at a line down to this share of the largest power seen: above the rounding of the DFT,
 * below any intended excitation. */
static const double excited_share = 1e-12;
/* Σv − Σv²/Σv is exactly 0 for one window, except for rounding. */
static const double several = 1e-9;

/* A trend counts at a line where noise alone has it once in 10,000 windows, and at all lines where significantly more
 * of them than a quarter (2.5 standard deviations), and 40 %, have one that noise has in a quarter of the windows;
 * likewise where significantly more than half, and 65 %, have more scatter than steps. Logarithms of 10,000 and 4,
 * squares of 2.5 · √3 and 2.5. */
static const double log_rare = 9.210340371976184, log_usual = 1.3862943611198906;
static const double several_trends = 18.75, several_scatters = 6.25;
/* At one line the scatter is so many times the steps: by noise once in 10,000 windows or less, of six or more. */
static const double scatter_rare = 2.5;
static const double trends_min = 0.6, scatters_min = 0.3; /* of the lines, 4 · 0.4 − 1 and 2 · 0.65 − 1 */
/* Degrees of freedom below which a trend cannot be told from noise. */
static const double trend_dof_min = 2.0;
/* (1 − 1/e)²/4: a linear change over m periods is within (1 − 1/e)·m/2 of its middle as often as noise within sigma. */
static const double linear_share = 0.09989410140273;
/* What is slower than a period, but no trend: between a sine, 1.4, and a step, 1. */
static const double erratic_share = 1.3;

static const union {
    uint64_t bits;
    double value;
} not_a_number = {0x7ff8000000000000u}, infinite = {0x7ff0000000000000u};
#define NOT_A_NUMBER (not_a_number.value)

typedef lb_line_job job;

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
} weight_facts;

/* What the lines of a row have in common. */
typedef struct {
    size_t row, place;
    const double *output, *denominator, *reference;
    const weight_facts *of;
    int usable, seen, moving, several;
    int trends, varies; /* as most lines of the previous window at this place */
    double dof;
    double excited_above;       /* power of the reference */
    lb_lanes least_dof;         /* of lines with errors that repeat */
    lb_mask widened;            /* by errors that repeat */
    lb_lanes trending, varying; /* numbers of lines */
} row_facts;

/* Changes of some lines of a place. */
typedef struct {
    lb_lanes of[LB_LINE_CHANGES];
} some_changes;

/* Numerator over denominator, and 1/|denominator|². */
typedef struct {
    lb_lanes re, im, inverse;
} quotient;

/* Some lines of a row. */
typedef struct {
    lb_lanes re, im, inverse; /* the value, and 1/|denominator|² */
    lb_lanes variance, variation, distortion;
    lb_mask valid;
} estimates;

/* d·(exp(log/d) − 1): what F(2, 2d) exceeds with the probability exp(−log), as (1 + x/64)^64 by squares. */
static double exceeded(double log, double dof)
{
    double power = 1.0 + log / (64.0 * dof);
    for (int i = 0; i < 6; ++i) {
        power *= power;
    }
    return dof * (power - 1.0);
}

static void add_change_facts(const job *j, const lb_weight_sums *w, double unbiased, weight_facts *f)
{
    const lb_weight_sums past = lb_sums_of(j->weights, f->before);
    const double dof = f->dof_scatter - 1.0, periods = w->one * w->one / w->two, slope = 1.0 / w->spread;
    const int known = dof >= trend_dof_min;
    f->turn = f->before ? (1.0 - f->share) * (1.0 + past.ages / past.one) : 0.0;
    f->trend_share = slope;
    f->detrended = known ? 1.0 / (unbiased - w->spread_two * slope) : NOT_A_NUMBER;
    f->steps = known ? 0.5 / lb_sums_of(j->weights, f->count - 1).one : NOT_A_NUMBER;
    f->trend_noise = w->spread_two;
    f->rare = w->spread_two * exceeded(log_rare, dof);
    f->usual = w->spread_two * exceeded(log_usual, dof);
    f->spread = linear_share * slope * slope * (j->s->averages ? periods * periods : 1.0);
    f->erratic = j->s->averages ? erratic_share : 0.0; /* within one window it is none */
}

static weight_facts facts_of(const job *j, int64_t before, int64_t count)
{
    const lb_weight_sums w = lb_sums_of(j->weights, count);
    const double rest = w.one - w.two / w.one, unbiased = rest > several ? rest : NOT_A_NUMBER;
    const double ratio = w.two / w.one, of_mean = w.two / (w.one * w.one);
    weight_facts f = {.before = before, .count = count, .share = 1.0 / lb_sums_of(j->weights, before + 1).one};
    f.dof_scatter = unbiased * unbiased / (w.two - 2.0 * w.three / w.one + ratio * ratio);
    f.variance = 1.0 / unbiased;
    f.of_mean = j->s->averages ? of_mean : 1.0;
    f.bias = 1.0 / (1.0 - of_mean);
    f.dof = f.dof_scatter;
    if (j->s->noise == LB_NOISE_LARGER && !lb_is_finite(f.dof)) {
        f.dof = j->s->noise_dof;
    }
    f.dof_moving = j->s->noise != LB_NOISE_SCATTER ? j->s->noise_dof / f.of_mean : f.dof;
    add_change_facts(j, &w, unbiased, &f);
    return f;
}

LB_INLINE some_changes load_changes(const lb_line_moments *m, size_t at, size_t count)
{
    some_changes c;
    for (size_t q = 0; q < LB_LINE_CHANGES; ++q) {
        c.of[q] = lb_load(m->change + q * lb_step(m) + at, count);
    }
    return c;
}

LB_INLINE void store_changes(const lb_line_moments *m, size_t at, size_t count, const some_changes *c)
{
    for (size_t q = 0; q < LB_LINE_CHANGES; ++q) {
        lb_store(m->change + q * lb_step(m) + at, c->of[q], count);
    }
}

LB_INLINE const double *row_of(const lb_line_windows *in, const double *spectra, size_t row)
{
    return spectra + 2u * row * in->stride;
}

LB_INLINE double power_at(const double *spectrum) { return spectrum[0] * spectrum[0] + spectrum[1] * spectrum[1]; }

LB_INLINE lb_lanes powers_at(const double *spectrum, size_t count)
{
    lb_lanes re, im;
    lb_load_pairs(spectrum, count, &re, &im);
    return re * re + im * im;
}

/* The largest power at a line, NaN where one is. Zeros beyond the last line change nothing. */
LB_INLINE double level_of(const double *reference, size_t lines)
{
    lb_lanes most = lb_all(0.0);
    size_t first = 0;
    for (; lines - first >= LB_LANES; first += LB_LANES) {
        most = lb_larger(most, powers_at(reference + 2u * first, LB_LANES));
    }
    most = lb_larger(most, powers_at(reference + 2u * first, lines - first));
    return lb_largest_lane(most);
}

/* The largest power of the reference so far, and whether the window has excitation at a line. */
LB_INLINE int is_excited(const job *j, size_t row, const double *reference, double *largest)
{
    const double level = level_of(reference, j->m->lines);
    *largest = lb_maximum(*largest, j->in->whole[row] ? level : 0.0);
    const double above = excited_share * *largest;
    int found = level > above && level > 0.0;
    for (size_t i = 0; level != level && i < j->m->lines; ++i) {
        const double power = power_at(reference + 2u * i);
        found |= power > above && power > 0.0;
    }
    return found;
}

LB_INLINE void multiply_conjugate(lb_lanes a, lb_lanes b, lb_lanes c, lb_lanes d, lb_lanes *product)
{
    product[0] = a * c + b * d;
    product[1] = b * c - a * d;
}

LB_INLINE lb_window read_window(const job *j, const row_facts *f, size_t first, size_t count)
{
    lb_window now;
    lb_lanes yr, yi, ur, ui, wr, wi;
    lb_load_pairs(f->output + 2u * first, count, &yr, &yi);
    lb_load_pairs(f->denominator + 2u * first, count, &ur, &ui);
    lb_load_pairs(f->reference + 2u * first, count, &wr, &wi);
    multiply_conjugate(yr, yi, wr, wi, now.of + NUM_RE);
    multiply_conjugate(ur, ui, wr, wi, now.of + DEN_RE);
    now.of[REF_RE] = wr;
    now.of[REF_IM] = wi;
    now.of[REF_POWER] = wr * wr + wi * wi;
    now.of[OUT_POWER] = yr * yr + yi * yi;
    now.of[NOISE_POWER] = j->in->noise ? lb_load(j->in->noise + f->row * j->m->lines + first, count) : lb_all(0.0);
    now.of[DEN_POWER] = ur * ur + ui * ui;
    return now;
}

LB_INLINE quotient divided(const lb_lanes *pair)
{
    const lb_lanes nr = pair[NUM_RE], ni = pair[NUM_IM], dr = pair[DEN_RE], di = pair[DEN_IM];
    const lb_lanes inverse = 1.0 / (dr * dr + di * di);
    return (quotient){(nr * dr + ni * di) * inverse, (ni * dr - nr * di) * inverse, inverse};
}

/* Scatter of numerator − ratio·denominator over the periods. */
LB_INLINE lb_lanes unexplained(const lb_some_moments *m, const quotient *ratio)
{
    const lb_lanes re = ratio->re, im = ratio->im;
    const lb_lanes shared = re * m->scatter[SHARED_RE] + im * m->scatter[SHARED_IM];
    const lb_lanes total = m->scatter[NUM_SCATTER] - 2.0 * shared + (re * re + im * im) * m->scatter[DEN_SCATTER];
    return lb_at_least(0.0, total); /* rounding can make it negative */
}

/* Adds the error of a window to the changes, from its deviations from the means before it. */
LB_INLINE void add_change(const job *j, const row_facts *f, const lb_deviation *d, const quotient *ratio,
                          some_changes *c)
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
LB_INLINE lb_lanes divided_scatter(row_facts *f, lb_lanes total, const some_changes *c, lb_lanes *variation)
{
    const weight_facts *of = f->of;
    const lb_lanes zero = lb_all(0.0), one = lb_all(1.0);
    const lb_lanes trend = c->of[TREND_RE] * c->of[TREND_RE] + c->of[TREND_IM] * c->of[TREND_IM];
    const lb_lanes rest = lb_at_least(0.0, total - trend * of->trend_share) * of->detrended;
    const lb_lanes steps = c->of[STEPS] * of->steps, all = total * of->variance;
    f->trending += lb_select(lb_above(trend, rest * of->usual), one, zero);
    f->varying += lb_select(lb_above(all, steps), one, zero);
    const lb_mask slower = lb_above(rest, steps * (f->varies ? 1.0 : scatter_rare));
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

/* With detection lines: the noise from the scatter is replaced by theirs where that is wanted. */
LB_INLINE lb_lanes selected_noise(const job *j, const row_facts *f, lb_lanes remembered, lb_lanes now, lb_lanes noise)
{
    const lb_lanes beside = j->s->averages ? remembered : now;
    if (f->moving) {
        return beside;
    }
    if (j->s->noise == LB_NOISE_LARGER) {
        return lb_known_larger(noise, lb_select(lb_are_finite(noise), remembered, beside));
    }
    return noise;
}

/* Adds errors that repeat to the variance; the degrees of freedom are matched in two moments (Satterthwaite 1946). */
LB_INLINE void widen(const job *j, row_facts *f, size_t first, size_t count, estimates *e)
{
    const double *known = j->in->distortion + (size_t)j->in->verdict[f->row] * j->m->lines + first;
    const double noise_share = 1.0 / f->dof, added_share = 1.0 / j->s->dof_repeating;
    const lb_lanes distortion = lb_load(known, count), noise = e->variance;
    const lb_lanes added = lb_select(lb_are_finite(distortion), distortion * distortion, lb_all(0.0));
    const lb_lanes together = noise + added;
    const lb_lanes dof = together * together / (noise * noise * noise_share + added * added * added_share);
    e->distortion = distortion;
    e->variance = together;
    f->least_dof = lb_select(lb_are_finite(dof) & lb_above(f->least_dof, dof), dof, f->least_dof);
    f->widened |= lb_above(added, lb_all(0.0));
}

LB_INLINE estimates estimated(const job *j, row_facts *f, size_t first, size_t count, const lb_some_moments *m,
                              const quotient *ratio, const some_changes *c, const lb_window *now)
{
    estimates e;
    const quotient value = j->s->averages ? *ratio : divided(now->of);
    lb_lanes noise = divided_scatter(f, unexplained(m, ratio), c, &e.variation);
    e.re = value.re;
    e.im = value.im;
    e.inverse = value.inverse;
    if (j->s->noise != LB_NOISE_SCATTER) {
        noise = selected_noise(j, f, m->mean[NOISE_POWER], now->of[NOISE_POWER], noise);
    }
    const lb_lanes power = now->of[REF_POWER];
    e.variance = noise * f->of->of_mean * e.inverse;
    e.variation = e.variation * e.inverse;
    if (f->moving) { /* it is the motion */
        e.variation = lb_all(NOT_A_NUMBER);
    }
    e.variance += lb_select(lb_are_numbers(e.variation), e.variation, lb_all(0.0));
    e.distortion = lb_all(NOT_A_NUMBER);
    e.valid = lb_no_lane();
    if (f->seen) {
        const lb_mask excited = lb_above(power, lb_all(f->excited_above)) & lb_above(power, lb_all(0.0));
        e.valid = excited & lb_are_finite(e.re) & lb_are_finite(e.im);
    }
    if (j->in->distortion) {
        widen(j, f, first, count, &e);
    }
    return e;
}

/* γ² of the reference and another signal, S_rx/(S_rr·S_xx), Nevaranta 2016, eq. (18), without its bias of (1 − γ²)/m
 * over m periods. */
LB_INLINE lb_lanes coherence_of(const lb_lanes *cross, lb_lanes reference, lb_lanes other, const row_facts *f,
                                lb_mask valid)
{
    const lb_lanes squared = cross[0] * cross[0] + cross[1] * cross[1];
    const lb_lanes coherence = squared / (reference * other);
    const lb_lanes found = lb_at_least(0.0, 1.0 - (1.0 - coherence) * f->of->bias);
    return lb_select(valid, found, lb_all(NOT_A_NUMBER));
}

LB_INLINE void write_coherence(const job *j, const row_facts *f, const lb_some_moments *m, lb_mask valid, size_t to,
                               size_t count)
{
    lb_lanes found = lb_all(NOT_A_NUMBER), of_input = found;
    if (f->several) {
        const lb_lanes reference = m->mean[REF_POWER];
        found = coherence_of(m->mean + NUM_RE, reference, m->mean[OUT_POWER], f, valid);
        if (!j->s->direct) {
            of_input = coherence_of(m->mean + DEN_RE, reference, m->mean[DEN_POWER], f, valid);
        }
    }
    lb_store(j->out->coherence + to, found, count);
    lb_store(j->out->input_coherence + to, of_input, count);
}

/* Weight of a response in a mean, so that the mean is a ratio of averages: U/W, for the direct estimator |U|². */
LB_INLINE void write_weight(const job *j, const lb_some_moments *m, const lb_window *now, lb_mask valid, double *out,
                            size_t count)
{
    lb_lanes re = now->of[REF_POWER], im = lb_all(0.0);
    if (!j->s->direct) {
        const lb_lanes *pair = j->s->averages ? m->mean : now->of;
        re = pair[DEN_RE] / pair[REF_POWER];
        im = pair[DEN_IM] / pair[REF_POWER];
    }
    const lb_lanes nothing = lb_all(NOT_A_NUMBER);
    lb_store_pairs(out, lb_select(valid, re, nothing), lb_select(valid, im, nothing), count);
}

/* A line that is invalid because of an error that repeats has an infinite one. */
LB_INLINE lb_mask write_verdicts(const job *j, const row_facts *f, size_t first, size_t to, size_t count,
                                 const estimates *e)
{
    lb_lanes distortion = lb_select(e->valid, e->distortion, lb_all(NOT_A_NUMBER));
    lb_mask valid = e->valid;
    if (j->in->invalid) {
        const size_t at = (size_t)j->in->verdict[f->row] * j->m->lines + first;
        const lb_mask against = lb_load_flags(j->in->invalid + at, count);
        distortion = lb_select(valid & against, lb_all(infinite.value), distortion);
        valid = valid & ~against;
    }
    lb_store(j->out->distortion + to, distortion, count);
    lb_store_flags(j->out->valid + to, valid, count);
    return valid;
}

LB_INLINE void write(const job *j, const row_facts *f, size_t first, size_t count, const lb_some_moments *m,
                     const lb_window *now, const estimates *e)
{
    const lb_line_rows *out = j->out;
    const size_t to = f->row * j->m->lines + first;
    const lb_mask valid = write_verdicts(j, f, first, to, count, e);
    const lb_lanes nothing = lb_all(NOT_A_NUMBER);
    lb_store_pairs(out->value + 2u * to, lb_select(valid, e->re, nothing), lb_select(valid, e->im, nothing), count);
    lb_store(out->sigma + to, lb_roots(lb_select(valid, e->variance, nothing)), count);
    lb_store(out->variation + to, lb_roots(lb_select(valid, e->variation, nothing)), count);
    write_weight(j, m, now, valid, out->weight + 2u * to, count);
    write_coherence(j, f, m, valid, to, count);
}

LB_INLINE void process_lines(const job *j, row_facts *f, size_t first, size_t count)
{
    const size_t at = lb_place(j->m, f->place, first);
    const lb_window now = read_window(j, f, first, count);
    lb_some_moments m = lb_load_moments(j->m, at, count);
    some_changes c = load_changes(j->m, at, count);
    lb_deviation apart = {{lb_all(0.0), lb_all(0.0), lb_all(0.0), lb_all(0.0)}};
    if (f->usable && j->s->averages) {
        apart = lb_add_window(&m, j->weights->forgetting, f->of->share, &now);
    }
    const quotient ratio = divided(m.mean);
    if (f->usable && j->s->averages) {
        add_change(j, f, &apart, &ratio, &c);
    }
    const estimates e = estimated(j, f, first, count, &m, &ratio, &c, &now);
    write(j, f, first, count, &m, &now, &e);
    if (f->usable && !j->s->averages) {
        apart = lb_add_window(&m, j->weights->forgetting, f->of->share, &now);
        add_change(j, f, &apart, &ratio, &c);
    }
    if (f->usable) {
        lb_store_moments(j->m, at, count, &m);
        store_changes(j->m, at, count, &c);
    }
}

/* Whether more of the lines than chance explains had a change in the previous window at this place. */
LB_INLINE void judge_changes(const job *j, row_facts *f)
{
    const double lines = (double)j->m->lines;
    const double *of_place = j->m->moment + 3u * j->m->places + f->place;
    const double trends = 4.0 * of_place[0] - lines, scatters = 2.0 * of_place[j->m->places] - lines;
    f->varies = scatters > scatters_min * lines && scatters * scatters > several_scatters * lines;
    f->trends = f->varies || (trends > trends_min * lines && trends * trends > several_trends * lines);
    f->trending = lb_all(0.0);
    f->varying = lb_all(0.0);
}

LB_INLINE double sum_of(lb_lanes counts)
{
    double sum = 0.0;
    for (size_t i = 0; i < LB_LANES; ++i) {
        sum += lb_lane(&counts, i);
    }
    return sum;
}

LB_INLINE void write_changes(const job *j, const row_facts *f)
{
    double *of_place = j->m->moment + 3u * j->m->places + f->place;
    if (f->usable) {
        of_place[0] = sum_of(f->trending);
        of_place[j->m->places] = sum_of(f->varying);
    }
}

LB_INLINE double dof_of(const row_facts *f)
{
    double least = infinite.value;
    int is_widened = 0;
    for (size_t i = 0; i < LB_LANES; ++i) {
        const lb_lanes widened = lb_select(f->widened, lb_all(1.0), lb_all(0.0));
        least = lb_lane(&f->least_dof, i) < least ? lb_lane(&f->least_dof, i) : least;
        is_widened |= lb_lane(&widened, i) > 0.0;
    }
    return is_widened ? lb_fmin(f->dof, least) : f->dof;
}

/* Means of time and schedule, and the oldest sample. */
LB_INLINE void average_moment(const job *j, const row_facts *f)
{
    const size_t rows = j->in->rows, places = j->m->places;
    double *mean = j->m->moment + f->place;
    const double *now = j->in->moment + f->row;
    if (!f->usable) {
        return;
    }
    mean[2u * places] = f->of->share < 1.0 ? mean[2u * places] : now[2u * rows];
    for (size_t i = 0; i < 2u; ++i) {
        mean[i * places] += (now[i * rows] - mean[i * places]) * f->of->share;
    }
}

LB_INLINE void write_moment(const job *j, const row_facts *f, int has_begun)
{
    for (size_t i = 0; i < 3u; ++i) {
        const size_t to = i * j->in->rows + f->row;
        j->out->moment[to] = has_begun ? j->m->moment[i * j->m->places + f->place] : j->in->moment[to];
    }
}

LB_INLINE void process_row(const job *j, size_t row, size_t place, double *largest, weight_facts *known)
{
    const lb_line_windows *in = j->in;
    int64_t *counted = j->m->count + place;
    row_facts f = {.row = row, .place = place, .of = known};
    f.output = row_of(in, in->output, row);
    f.denominator = row_of(in, in->denominator, row);
    f.reference = row_of(in, in->reference, row);
    f.usable = is_excited(j, row, f.reference, largest) && in->clean[row] && !(in->aside && in->aside[row]);
    f.seen = j->s->averages ? in->whole[row] : in->clean[row]; /* an average continues through what it excludes */
    f.moving = in->moving && in->moving[row];
    f.excited_above = excited_share * *largest;
    const int64_t count = *counted + (j->s->averages && f.usable);
    if (known->before != *counted || known->count != count) { /* most places of a period have as many */
        *known = facts_of(j, *counted, count);
    }
    f.several = lb_is_finite(known->dof_scatter);
    f.dof = f.moving ? known->dof_moving : known->dof;
    f.least_dof = lb_all(infinite.value);
    f.widened = lb_no_lane();
    judge_changes(j, &f);
    *counted += f.usable;
    size_t first = 0;
    for (; j->m->lines - first >= LB_LANES; first += LB_LANES) {
        process_lines(j, &f, first, LB_LANES);
    }
    if (first < j->m->lines) {
        process_lines(j, &f, first, j->m->lines - first);
    }
    write_changes(j, &f);
    j->out->dof[row] = dof_of(&f);
    j->out->usable[row] = (uint8_t)f.usable;
    if (j->s->averages) {
        average_moment(j, &f);
    }
    write_moment(j, &f, j->s->averages && *counted > 0);
}

void LB_LINES_NAME(const lb_line_job *job_, double *largest)
{
    /* Copies that no store of a result can change, so that they stay in registers. */
    const lb_line_weights weights = *job_->weights;
    const lb_line_moments moments = *job_->m;
    const lb_line_settings settings = *job_->s;
    const lb_line_windows windows = *job_->in;
    const lb_line_rows rows = *job_->out;
    const job j = {&weights, &moments, &settings, &windows, &rows};
    weight_facts known = {.before = -1};
    size_t place = windows.place;
    double most = *largest;
    for (size_t row = 0; row < windows.rows; ++row) {
        process_row(&j, row, place, &most, &known);
        place = place + 1u < moments.places ? place + 1u : 0u;
    }
    *largest = most;
}
