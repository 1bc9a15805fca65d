/* Frequency responses with their scatter, one pass over the windows, some lines at a time. */
#include "moments.h"

/* A window counts as excited at a line down to this share of the largest power seen: above the rounding of the DFT,
 * below any intended excitation. */
static const double excited_share = 1e-12;
/* Σv − Σv²/Σv is exactly 0 for one window, except for rounding. */
static const double several = 1e-9;

static const union {
    uint64_t bits;
    double value;
} not_a_number = {0x7ff8000000000000u}, infinite = {0x7ff0000000000000u};
#define NOT_A_NUMBER (not_a_number.value)

/* What the lines of a row have in common. */
typedef struct {
    size_t row;
    size_t place;
    int usable, seen, moving;
    double share;         /* of the window in the mean */
    double of_mean;       /* variance of the mean over that of one window; 1 where there is no average */
    double variance;      /* times a scatter: variance of one window */
    double dof;           /* of the variance, from the scatter or the detection lines */
    double dof_scatter;   /* NaN for fewer than two windows */
    double bias;          /* times 1 − γ²: the share without the bias of the coherence */
    double excited_above; /* power of the reference */
    double least_dof;     /* of lines with errors that repeat */
    int is_widened;       /* by errors that repeat, at some line */
} row_facts;

/* Some lines of a row. */
typedef struct {
    double re[LB_TOGETHER], im[LB_TOGETHER], inverse[LB_TOGETHER]; /* the value, and 1/|denominator|² */
    double variance[LB_TOGETHER], distortion[LB_TOGETHER];
    uint8_t valid[LB_TOGETHER];
} estimates;

typedef struct {
    const lb_line_weights *weights;
    const lb_line_moments *m;
    const lb_line_settings *s;
    const lb_line_windows *in;
    const lb_line_rows *out;
} job;

static double power_at(const double *spectrum) { return spectrum[0] * spectrum[0] + spectrum[1] * spectrum[1]; }

static const double *row_of(const lb_line_windows *in, const double *spectra, size_t row)
{
    return spectra + 2u * row * in->stride;
}

/* The largest power of the reference so far, and whether the window has excitation at a line. */
static int is_excited(const job *j, size_t row, double *largest)
{
    const double *reference = row_of(j->in, j->in->reference, row);
    double level = power_at(reference);
    for (size_t i = 1; i < j->m->lines; ++i) {
        level = lb_maximum(level, power_at(reference + 2u * i));
    }
    *largest = lb_maximum(*largest, j->in->whole[row] ? level : 0.0);
    int found = 0;
    for (size_t i = 0; i < j->m->lines; ++i) {
        const double power = power_at(reference + 2u * i);
        found |= power > excited_share * *largest && power > 0.0;
    }
    return found;
}

static void multiply_conjugate(const double *one, const double *other, size_t count, double *re, double *im)
{
    for (size_t i = 0; i < count; ++i) {
        const double a = one[2u * i], b = one[2u * i + 1u], c = other[2u * i], d = other[2u * i + 1u];
        re[i] = a * c + b * d;
        im[i] = b * c - a * d;
    }
}

static void read_window(const job *j, size_t row, size_t first, size_t count, lb_window *now)
{
    const double *output = row_of(j->in, j->in->output, row) + 2u * first;
    const double *denominator = row_of(j->in, j->in->denominator, row) + 2u * first;
    const double *reference = row_of(j->in, j->in->reference, row) + 2u * first;
    multiply_conjugate(output, reference, count, now->of[NUM_RE], now->of[NUM_IM]);
    multiply_conjugate(denominator, reference, count, now->of[DEN_RE], now->of[DEN_IM]);
    for (size_t i = 0; i < count; ++i) {
        now->of[REF_RE][i] = reference[2u * i];
        now->of[REF_IM][i] = reference[2u * i + 1u];
        now->of[REF_POWER][i] = power_at(reference + 2u * i);
        now->of[OUT_POWER][i] = power_at(output + 2u * i);
        now->of[NOISE_POWER][i] = j->in->noise ? j->in->noise[row * j->m->lines + first + i] : 0.0;
        now->of[DEN_POWER][i] = power_at(denominator + 2u * i);
    }
}

/* Value from numerator and denominator, which are `step` numbers apart. */
static void divide(const double *pair, size_t step, size_t count, double *re, double *im, double *inverse)
{
    const double *nr = pair, *ni = nr + step, *dr = ni + step, *di = dr + step;
    for (size_t i = 0; i < count; ++i) {
        inverse[i] = 1.0 / (dr[i] * dr[i] + di[i] * di[i]);
        re[i] = (nr[i] * dr[i] + ni[i] * di[i]) * inverse[i];
        im[i] = (ni[i] * dr[i] - nr[i] * di[i]) * inverse[i];
    }
}

/* Variance of numerator − ratio·denominator over the periods, for one window. */
static void unexplained(const job *j, size_t at, const row_facts *f, size_t count, const double *re, const double *im,
                        double *noise)
{
    const size_t step = lb_step(j->m);
    const double *num = j->m->scatter + at, *den = num + step, *sr = den + step, *si = sr + step;
    for (size_t i = 0; i < count; ++i) {
        const double shared = re[i] * sr[i] + im[i] * si[i];
        const double total = num[i] - 2.0 * shared + (re[i] * re[i] + im[i] * im[i]) * den[i];
        noise[i] = lb_maximum(total, 0.0) * f->variance; /* rounding can make it negative */
    }
}

/* With detection lines: `noise`, from the scatter, is replaced by theirs where that is wanted. */
static void select_noise(const job *j, const row_facts *f, const double *remembered, const double *now, size_t count,
                         double *noise)
{
    const double *beside = j->s->averages ? remembered : now;
    for (size_t i = 0; i < count; ++i) {
        if (f->moving) {
            noise[i] = beside[i];
        } else if (j->s->noise == LB_NOISE_LARGER) {
            noise[i] = lb_fmax(noise[i], lb_is_finite(noise[i]) ? remembered[i] : beside[i]);
        }
    }
}

/* Adds errors that repeat to the variance; the degrees of freedom are matched in two moments (Satterthwaite 1946). */
static void widen(const job *j, row_facts *f, size_t first, size_t count, estimates *e)
{
    const double *known = j->in->distortion + f->row * j->m->lines + first;
    const double noise_share = 1.0 / f->dof, added_share = 1.0 / j->s->dof_repeating;
    for (size_t i = 0; i < count; ++i) {
        const double distortion = f->moving ? NOT_A_NUMBER : known[i];
        const double noise = e->variance[i], added = lb_is_finite(distortion) ? distortion * distortion : 0.0;
        const double together = noise + added;
        const double dof = together * together / (noise * noise * noise_share + added * added * added_share);
        e->distortion[i] = distortion;
        e->variance[i] = together;
        f->least_dof = lb_is_finite(dof) && dof < f->least_dof ? dof : f->least_dof;
        f->is_widened |= added > 0.0;
    }
}

static void estimate(const job *j, row_facts *f, size_t first, size_t count, const lb_window *now, estimates *e)
{
    const size_t step = lb_step(j->m), at = lb_place(j->m, f->place, first);
    const double *means = j->m->means + at;
    double noise[LB_TOGETHER];
    if (j->s->averages) {
        divide(means, step, count, e->re, e->im, e->inverse);
        unexplained(j, at, f, count, e->re, e->im, noise);
    } else {
        double re[LB_TOGETHER], im[LB_TOGETHER];
        divide(means, step, count, re, im, e->inverse);
        unexplained(j, at, f, count, re, im, noise);
        divide(now->of[NUM_RE], LB_TOGETHER, count, e->re, e->im, e->inverse);
    }
    if (j->s->noise != LB_NOISE_SCATTER) {
        select_noise(j, f, means + NOISE_POWER * step, now->of[NOISE_POWER], count, noise);
    }
    for (size_t i = 0; i < count; ++i) {
        const double power = now->of[REF_POWER][i];
        const int excited = power > f->excited_above && power > 0.0;
        e->variance[i] = noise[i] * f->of_mean * e->inverse[i];
        e->distortion[i] = NOT_A_NUMBER;
        e->valid[i] = (uint8_t)(f->seen && excited && lb_is_finite(e->re[i]) && lb_is_finite(e->im[i]));
    }
    if (j->in->distortion) {
        widen(j, f, first, count, e);
    }
}

/* γ² of the reference and another signal, S_rx/(S_rr·S_xx), Nevaranta 2016, eq. (18), without its bias of (1 − γ²)/m
 * over m periods. */
static void write_coherence(const double *cross, size_t step, const double *reference, const double *other,
                            const row_facts *f, const estimates *e, size_t count, double *out)
{
    const int known = lb_is_finite(f->dof_scatter);
    for (size_t i = 0; i < count; ++i) {
        const double squared = cross[i] * cross[i] + cross[step + i] * cross[step + i];
        const double coherence = squared / (reference[i] * other[i]);
        const double found = lb_maximum(1.0 - (1.0 - coherence) * f->bias, 0.0);
        out[i] = known && e->valid[i] ? found : NOT_A_NUMBER;
    }
}

/* Weight of a response in a mean, so that the mean is a ratio of averages: U/W, for the direct estimator |U|². */
static void write_weight(const job *j, size_t at, const lb_window *now, const estimates *e, size_t count, double *out)
{
    const size_t step = j->s->averages ? lb_step(j->m) : LB_TOGETHER;
    const double *pair = j->s->averages ? j->m->means + at : now->of[NUM_RE];
    const double *re = pair + DEN_RE * step, *im = pair + DEN_IM * step, *excitation = pair + REF_POWER * step;
    for (size_t i = 0; i < count; ++i) {
        const double x = j->s->direct ? now->of[REF_POWER][i] : re[i] / excitation[i];
        const double y = j->s->direct ? 0.0 : im[i] / excitation[i];
        out[2u * i] = e->valid[i] ? x : NOT_A_NUMBER;
        out[2u * i + 1u] = e->valid[i] ? y : NOT_A_NUMBER;
    }
}

/* A line that is invalid because of an error that repeats has an infinite one. */
static void write_verdicts(const job *j, const row_facts *f, size_t to, size_t count, estimates *e)
{
    const uint8_t *invalid = j->in->invalid ? j->in->invalid + to : 0;
    for (size_t i = 0; i < count; ++i) {
        const int against = invalid && invalid[i] && !f->moving;
        const double distortion = e->valid[i] ? e->distortion[i] : NOT_A_NUMBER;
        j->out->distortion[to + i] = e->valid[i] && against ? infinite.value : distortion;
        e->valid[i] = (uint8_t)(e->valid[i] && !against);
        j->out->valid[to + i] = e->valid[i];
    }
}

static void write(const job *j, const row_facts *f, size_t first, size_t count, const lb_window *now, estimates *e)
{
    const lb_line_rows *out = j->out;
    const size_t to = f->row * j->m->lines + first, at = lb_place(j->m, f->place, first), step = lb_step(j->m);
    const double *means = j->m->means + at, *reference = means + REF_POWER * step;
    write_verdicts(j, f, to, count, e);
    for (size_t i = 0; i < count; ++i) {
        out->value[2u * (to + i)] = e->valid[i] ? e->re[i] : NOT_A_NUMBER;
        out->value[2u * (to + i) + 1u] = e->valid[i] ? e->im[i] : NOT_A_NUMBER;
        out->variance[to + i] = e->valid[i] ? e->variance[i] : NOT_A_NUMBER;
        out->input_coherence[to + i] = NOT_A_NUMBER;
    }
    write_weight(j, at, now, e, count, out->weight + 2u * to);
    write_coherence(means + NUM_RE * step, step, reference, means + OUT_POWER * step, f, e, count, out->coherence + to);
    if (!j->s->direct) {
        write_coherence(means + DEN_RE * step, step, reference, means + DEN_POWER * step, f, e, count,
                        out->input_coherence + to);
    }
}

/* Means of time and schedule, and the oldest sample. */
static void average_moment(const job *j, const row_facts *f)
{
    const size_t rows = j->in->rows, places = j->m->places;
    double *mean = j->m->moment + f->place;
    const double *now = j->in->moment + f->row;
    if (!f->usable) {
        return;
    }
    mean[2u * places] = f->share < 1.0 ? mean[2u * places] : now[2u * rows];
    for (size_t i = 0; i < 2u; ++i) {
        mean[i * places] += (now[i * rows] - mean[i * places]) * f->share;
    }
}

static void write_moment(const job *j, const row_facts *f, int has_begun)
{
    for (size_t i = 0; i < 3u; ++i) {
        const size_t to = i * j->in->rows + f->row;
        j->out->moment[to] = has_begun ? j->m->moment[i * j->m->places + f->place] : j->in->moment[to];
    }
}

/* What follows from the number of windows in the moments. */
static void set_weights(const job *j, int64_t count, row_facts *f)
{
    const lb_weight_sums w = lb_sums_of(j->weights, count);
    const double rest = w.one - w.two / w.one, unbiased = rest > several ? rest : NOT_A_NUMBER;
    const double ratio = w.two / w.one, of_mean = w.two / (w.one * w.one);
    f->dof_scatter = unbiased * unbiased / (w.two - 2.0 * w.three / w.one + ratio * ratio);
    f->variance = 1.0 / unbiased;
    f->of_mean = j->s->averages ? of_mean : 1.0;
    f->bias = 1.0 / (1.0 - of_mean);
    f->dof = f->dof_scatter;
    if (j->s->noise == LB_NOISE_LARGER && !lb_is_finite(f->dof)) {
        f->dof = j->s->noise_dof;
    }
    if (j->s->noise != LB_NOISE_SCATTER && f->moving) {
        f->dof = j->s->noise_dof / f->of_mean;
    }
}

static void process_lines(const job *j, row_facts *f, size_t first, size_t count)
{
    const size_t at = lb_place(j->m, f->place, first);
    lb_window now;
    estimates e;
    read_window(j, f->row, first, count, &now);
    if (f->usable && j->s->averages) {
        lb_moments_add(j->m, at, j->weights->forgetting, f->share, count, &now);
    }
    estimate(j, f, first, count, &now, &e);
    write(j, f, first, count, &now, &e);
    if (f->usable && !j->s->averages) {
        lb_moments_add(j->m, at, j->weights->forgetting, f->share, count, &now);
    }
}

static void process_row(const job *j, size_t row, size_t place, double *largest)
{
    const lb_line_windows *in = j->in;
    int64_t *counted = j->m->count + place;
    row_facts f = {.row = row, .place = place, .least_dof = infinite.value};
    f.usable = is_excited(j, row, largest) && in->clean[row] && !(in->aside && in->aside[row]);
    f.seen = j->s->averages ? in->whole[row] : in->clean[row]; /* an average continues through what it excludes */
    f.moving = in->moving && in->moving[row];
    f.excited_above = excited_share * *largest;
    f.share = 1.0 / lb_sums_of(j->weights, *counted + 1).one;
    set_weights(j, j->s->averages ? *counted + f.usable : *counted, &f);
    *counted += f.usable;
    for (size_t first = 0; first < j->m->lines; first += LB_TOGETHER) {
        process_lines(j, &f, first, j->m->lines - first < LB_TOGETHER ? j->m->lines - first : LB_TOGETHER);
    }
    j->out->dof[row] = f.is_widened ? lb_fmin(f.dof, f.least_dof) : f.dof;
    j->out->usable[row] = (uint8_t)f.usable;
    if (j->s->averages) {
        average_moment(j, &f);
    }
    write_moment(j, &f, j->s->averages && *counted > 0);
}

static int is_missing(const lb_line_windows *in, const lb_line_rows *out)
{
    const int inputs = in->output && in->denominator && in->reference && in->whole && in->clean && in->moment;
    const int outputs = out->value && out->variance && out->coherence && out->input_coherence && out->weight &&
                        out->distortion && out->valid && out->dof && out->moment && out->usable;
    return in->rows && !(inputs && outputs);
}

lb_status lb_lines_process(const lb_line_weights *weights, const lb_line_moments *moments, double *largest,
                           const lb_line_settings *settings, const lb_line_windows *in, const lb_line_rows *out)
{
    if (!weights || !moments || !largest || !settings || !in || !out || is_missing(in, out)) {
        return LB_ERROR_NULL;
    }
    if (!moments->count || !moments->means || !moments->scatter || !moments->moment) {
        return LB_ERROR_NULL;
    }
    if (in->place >= moments->places || !moments->lines || in->stride < moments->lines ||
        (weights->forgetting != 1.0 && !(weights->table && weights->length))) {
        return LB_ERROR_SIZE;
    }
    const job j = {weights, moments, settings, in, out};
    size_t place = in->place;
    for (size_t row = 0; row < in->rows; ++row) {
        process_row(&j, row, place, largest);
        place = place + 1u < moments->places ? place + 1u : 0u;
    }
    return LB_OK;
}
