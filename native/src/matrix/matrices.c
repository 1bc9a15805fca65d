/* Matrices of responses: neighbouring lines are lanes, and each lane computes as a number alone would. Compiled once
 * for each instruction set. */
#include "matrices.h"

#include "lb_assert.h"
#include "lines/lanes.h"

#ifndef LB_MATRIX_NAME
#define LB_MATRIX_NAME lb_matrix_baseline
#endif

#define MOST LB_MATRIX_MOST
#define CHUNK 8u /* windows at once, so that their sums stay in registers */

/* An input moves by itself where the smallest singular value is this many times what noise alone has. */
static const double above_noise = 3.0;
/* Condition number up to which the inverse of S_dd, whose own is the square, has eight digits. */
static const double condition_known = 1e4;
/* Relative size of singular values that are zero but for rounding. */
static const double rank_share = 1e-10;

static const union {
    uint64_t bits;
    double value;
} not_a_number = {0x7ff8000000000000u};
#define NOT_A_NUMBER (not_a_number.value)

typedef lb_matrix_job job;

typedef struct {
    lb_lanes re, im;
} number;

/* Signals of one window, outputs first. */
typedef struct {
    number of[2u * MOST];
} window;

/* What the lines of a row have in common. */
typedef struct {
    const job *j;
    size_t row, newest;                             /* of the results, and of the ring */
    size_t outputs, signals, used, judged, skipped; /* repetitions of G, of the noise, and those before the latter */
    double dof;
} row_facts;

/* Results at some lines. */
typedef struct {
    number value[MOST][MOST];
    number inverse[MOST][MOST]; /* of S_dd, which it is at first */
    number noise[MOST][MOST];
    lb_lanes signal[MOST]; /* power of G·d */
    lb_lanes size[MOST];   /* power of the mean of each input over the experiments */
    lb_lanes moved[MOST];  /* Σ|δd|² between the repetitions */
} results;

LB_INLINE number times(number a, number b) { return (number){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }

/* a·conj(b) */
LB_INLINE number against(number a, number b) { return (number){a.re * b.re + a.im * b.im, a.im * b.re - a.re * b.im}; }

LB_INLINE number plus(number a, number b) { return (number){a.re + b.re, a.im + b.im}; }
LB_INLINE number minus(number a, number b) { return (number){a.re - b.re, a.im - b.im}; }
LB_INLINE number scaled(number a, lb_lanes by) { return (number){a.re * by, a.im * by}; }
LB_INLINE number conjugate(number a) { return (number){a.re, -a.im}; }
LB_INLINE lb_lanes power_of(number a) { return a.re * a.re + a.im * a.im; }
LB_INLINE number zero(void) { return (number){lb_all(0.0), lb_all(0.0)}; }

/* Row of the ring with the window of an experiment of a repetition, both counted back from the newest. */
LB_INLINE size_t ring_row(const row_facts *f, size_t repetition, size_t experiment)
{
    const lb_matrix_settings *s = f->j->s;
    const size_t back = s->places * (repetition * s->experiments + experiment);
    LB_ASSERT(back < f->j->h->length && f->newest < f->j->h->length);
    return f->newest >= back ? f->newest - back : f->newest + f->j->h->length - back;
}

LB_INLINE void read_window(const row_facts *f, size_t repetition, size_t experiment, size_t first, size_t count,
                           window *x)
{
    const size_t lines = f->j->s->lines;
    const size_t row = ring_row(f, repetition, experiment) * (f->signals + f->j->s->beside);
    const double *p = f->j->h->spectrum + 2u * lines * row + first;
    for (size_t i = 0; i < f->signals; ++i, p += 2u * lines) {
        x->of[i] = (number){lb_load(p, count), lb_load(p + lines, count)};
    }
}

/* Mean of an experiment over the repetitions of G. */
LB_INLINE void read_mean(const row_facts *f, size_t experiment, size_t first, size_t count, window *x)
{
    window next;
    read_window(f, 0, experiment, first, count, x);
    for (size_t i = 1; i < f->used; ++i) {
        read_window(f, i, experiment, first, count, &next);
        for (size_t k = 0; k < f->signals; ++k) {
            x->of[k] = plus(x->of[k], next.of[k]);
        }
    }
    for (size_t k = 0; f->used > 1u && k < f->signals; ++k) {
        x->of[k] = scaled(x->of[k], lb_all(1.0 / (double)f->used));
    }
}

/* S_yd and the lower triangle of S_dd, with some windows more. */
LB_INLINE void add_products(const row_facts *f, const window *x, size_t windows, results *r)
{
    for (size_t i = f->outputs; i < f->signals; ++i) {
        for (size_t k = 0; k < f->signals && k <= i; ++k) {
            number *sum = k < f->outputs ? &r->value[k][i - f->outputs] : &r->inverse[i - f->outputs][k - f->outputs];
            number now = *sum;
            for (size_t n = 0; n < windows; ++n) {
                const number one = k < f->outputs ? against(x[n].of[k], x[n].of[i]) : against(x[n].of[i], x[n].of[k]);
                now = plus(now, one);
            }
            *sum = now;
        }
    }
}

LB_INLINE void correlate(const row_facts *f, size_t first, size_t count, results *r)
{
    LB_ASSERT(f->used > 0 && f->used <= f->j->s->repetitions);
    window x[CHUNK];
    const size_t experiments = f->j->s->experiments, each = f->j->s->means ? 1u : f->used;
    size_t filled = 0;
    for (size_t i = 0; i < each; ++i) {
        for (size_t e = 0; e < experiments; ++e) {
            if (f->j->s->means) {
                read_mean(f, e, first, count, &x[filled++]);
            } else {
                read_window(f, i, e, first, count, &x[filled++]);
            }
            if (filled == CHUNK) {
                add_products(f, x, filled, r);
                filled = 0;
            }
        }
    }
    add_products(f, x, filled, r);
}

/* The inverse of a Hermitian matrix, of which the lower triangle is given: L·P·L*, then L⁻*·P⁻¹·L⁻¹. Not finite where a
 * pivot is zero. */
LB_INLINE void invert(number a[MOST][MOST], size_t size)
{
    lb_lanes pivot[MOST];
    for (size_t j = 0; j < size; ++j) {
        number column[MOST];
        pivot[j] = 1.0 / a[j][j].re;
        for (size_t i = j + 1u; i < size; ++i) {
            column[i] = a[i][j];
            a[i][j] = scaled(a[i][j], pivot[j]);
            for (size_t k = j + 1u; k <= i; ++k) {
                a[i][k] = minus(a[i][k], against(a[i][j], column[k]));
            }
        }
    }
    for (size_t j = 0; j < size; ++j) {
        for (size_t i = j + 1u; i < size; ++i) {
            number sum = a[i][j];
            for (size_t k = j + 1u; k < i; ++k) {
                sum = plus(sum, times(a[i][k], a[k][j]));
            }
            a[i][j] = minus(zero(), sum);
        }
    }
    for (size_t i = 0; i < size; ++i) {
        for (size_t j = 0; j <= i; ++j) {
            number sum = i == j ? (number){pivot[i], lb_all(0.0)} : scaled(a[i][j], pivot[i]);
            for (size_t k = i + 1u; k < size; ++k) {
                sum = plus(sum, scaled(against(a[k][j], a[k][i]), pivot[k]));
            }
            a[i][j] = sum;
            a[j][i] = conjugate(sum);
        }
    }
}

/* G = S_yd·S_dd⁻¹, and the power of G·d, which is the diagonal of G·S_dy. */
LB_INLINE void solve(const row_facts *f, results *r)
{
    const size_t inputs = f->signals - f->outputs;
    const double windows = (double)(f->j->s->experiments * (f->j->s->means ? 1u : f->used));
    for (size_t o = 0; o < f->outputs; ++o) {
        number row[MOST];
        r->signal[o] = lb_all(0.0);
        for (size_t i = 0; i < inputs; ++i) {
            number sum = zero();
            for (size_t k = 0; k < inputs; ++k) {
                sum = plus(sum, times(r->value[o][k], r->inverse[k][i]));
            }
            row[i] = sum;
            r->signal[o] += against(r->value[o][i], sum).re;
        }
        for (size_t i = 0; i < inputs; ++i) {
            r->value[o][i] = row[i];
        }
        r->signal[o] = lb_at_least(0.0, r->signal[o] * (1.0 / windows));
    }
}

/* Of windows x, as deviations: y becomes y − G·d. */
LB_INLINE void subtract_response(const row_facts *f, const results *r, window *x)
{
    for (size_t o = 0; o < f->outputs; ++o) {
        number rest = x->of[o];
        for (size_t i = f->outputs; i < f->signals; ++i) {
            rest = minus(rest, times(r->value[o][i - f->outputs], x->of[i]));
        }
        x->of[o] = rest;
    }
}

LB_INLINE void add_scatter(const row_facts *f, const window *x, size_t windows, window *sums, results *r)
{
    for (size_t k = 0; k < f->signals; ++k) {
        for (size_t n = 0; n < windows; ++n) {
            sums->of[k] = plus(sums->of[k], x[n].of[k]);
        }
    }
    for (size_t i = f->outputs; i < f->signals; ++i) {
        for (size_t n = 0; n < windows; ++n) {
            r->moved[i - f->outputs] += power_of(x[n].of[i]);
        }
    }
    for (size_t o = 0; o < f->outputs; ++o) {
        for (size_t p = 0; p <= o; ++p) {
            number now = r->noise[o][p];
            for (size_t n = 0; n < windows; ++n) {
                now = plus(now, against(x[n].of[o], x[n].of[p]));
            }
            r->noise[o][p] = now;
        }
    }
}

/* Σ|Σδ|²/m of an experiment is that of its mean. */
LB_INLINE void subtract_mean(const row_facts *f, const window *sums, results *r)
{
    LB_ASSERT(f->judged > 1u && f->skipped + f->judged <= f->j->s->repetitions);
    const lb_lanes share = lb_all(1.0 / (double)f->judged);
    for (size_t i = f->outputs; i < f->signals; ++i) {
        r->moved[i - f->outputs] -= power_of(sums->of[i]) * share;
    }
    for (size_t o = 0; o < f->outputs; ++o) {
        for (size_t p = 0; p <= o; ++p) {
            r->noise[o][p] = minus(r->noise[o][p], scaled(against(sums->of[o], sums->of[p]), share));
        }
    }
}

/* Deviations from the first window that is judged, so that rounding of the excitation does not enter. */
LB_INLINE void scatter(const row_facts *f, size_t first, size_t count, results *r)
{
    window x[CHUNK], begin, sums;
    for (size_t e = 0; f->judged > 1u && e < f->j->s->experiments; ++e) {
        read_window(f, f->skipped, e, first, count, &begin);
        for (size_t k = 0; k < f->signals; ++k) {
            sums.of[k] = zero();
        }
        for (size_t i = 1; i < f->judged;) {
            size_t filled = 0;
            for (; filled < CHUNK && i < f->judged; ++filled, ++i) {
                read_window(f, f->skipped + i, e, first, count, &x[filled]);
                for (size_t k = 0; k < f->signals; ++k) {
                    x[filled].of[k] = minus(x[filled].of[k], begin.of[k]);
                }
                subtract_response(f, r, &x[filled]);
            }
            add_scatter(f, x, filled, &sums, r);
        }
        subtract_mean(f, &sums, r);
    }
}

/* A matrix of each line, from lanes that are lines. */
LB_INLINE void write_matrix(const number a[MOST][MOST], size_t rows, size_t columns, lb_lanes by, double *out,
                            size_t count)
{
    for (size_t i = 0; i < rows; ++i) {
        for (size_t k = 0; k < columns; ++k) {
            const number x = scaled(a[i][k], by);
            double *to = out + 2u * (i * columns + k);
            for (size_t n = 0; n < LB_LANES && n < count; ++n, to += 2u * rows * columns) {
                to[0] = lb_lane(&x.re, n);
                to[1] = lb_lane(&x.im, n);
            }
        }
    }
}

LB_INLINE void write_noise(const row_facts *f, size_t at, size_t count, results *r)
{
    const lb_matrix_rows *out = f->j->out;
    const lb_lanes share = lb_all(f->dof > 0.0 ? 1.0 / f->dof : NOT_A_NUMBER);
    for (size_t o = 0; o < f->outputs; ++o) {
        r->noise[o][o] = (number){lb_at_least(0.0, r->noise[o][o].re), lb_all(0.0)};
        for (size_t p = 0; p < o; ++p) {
            r->noise[p][o] = conjugate(r->noise[o][p]);
        }
        const lb_lanes coherence = r->signal[o] / (r->signal[o] + r->noise[o][o].re * share);
        for (size_t n = 0; n < LB_LANES && n < count; ++n) {
            out->coherence[(at + n) * f->outputs + o] = lb_lane(&coherence, n);
        }
    }
    write_matrix((const number(*)[MOST])r->noise, f->outputs, f->outputs, share,
                 out->noise + 2u * at * f->outputs * f->outputs, count);
}

/* The mean of the inputs over the repetitions has a product of its own where G is not of means. */
LB_INLINE void measure_inputs(const row_facts *f, size_t first, size_t count, results *r)
{
    const size_t inputs = f->signals - f->outputs, lines = f->j->s->lines;
    number gram[MOST][MOST];
    const number(*inverse)[MOST] = (const number(*)[MOST])r->inverse;
    if (f->used > 1u && !f->j->s->means) {
        for (size_t i = 0; i < inputs; ++i) {
            for (size_t k = 0; k <= i; ++k) {
                gram[i][k] = zero();
            }
        }
        for (size_t e = 0; e < f->j->s->experiments; ++e) {
            window x;
            read_mean(f, e, first, count, &x);
            for (size_t i = 0; i < inputs; ++i) {
                for (size_t k = 0; k <= i; ++k) {
                    gram[i][k] = plus(gram[i][k], against(x.of[f->outputs + i], x.of[f->outputs + k]));
                }
            }
        }
        for (size_t i = 0; i < inputs; ++i) {
            r->size[i] = gram[i][i].re;
        }
        invert(gram, inputs);
        inverse = (const number(*)[MOST])gram;
    }
    for (size_t i = 0; i < inputs; ++i) {
        double *to = f->j->h->work + i * lines + first;
        lb_store(to, r->size[i], count);
        lb_store(to + inputs * lines, inverse[i][i].re, count);
        lb_store(to + 2u * inputs * lines, lb_at_least(0.0, r->moved[i]), count);
    }
}

LB_INLINE void begin_sums(const row_facts *f, results *r)
{
    const size_t inputs = f->signals - f->outputs;
    for (size_t i = 0; i < inputs; ++i) {
        r->moved[i] = lb_all(0.0);
        for (size_t k = 0; k <= i; ++k) {
            r->inverse[i][k] = zero();
        }
    }
    for (size_t o = 0; o < f->outputs; ++o) {
        for (size_t i = 0; i < inputs; ++i) {
            r->value[o][i] = zero();
        }
        for (size_t p = 0; p <= o; ++p) {
            r->noise[o][p] = zero();
        }
    }
}

LB_INLINE void process_lines(const row_facts *f, size_t first, size_t count)
{
    const lb_matrix_rows *out = f->j->out;
    const size_t inputs = f->signals - f->outputs, at = f->row * f->j->s->lines + first;
    results r;
    begin_sums(f, &r);
    correlate(f, first, count, &r);
    for (size_t i = 0; i < inputs; ++i) {
        r.size[i] = r.inverse[i][i].re;
    }
    invert(r.inverse, inputs);
    solve(f, &r);
    scatter(f, first, count, &r);
    measure_inputs(f, first, count, &r);
    write_matrix((const number(*)[MOST])r.value, f->outputs, inputs, lb_all(1.0),
                 out->value + 2u * at * f->outputs * inputs, count);
    write_noise(f, at, count, &r);
    /* E δ_i·conj(δ_k) is that of the rows of P = D*·S_dd⁻¹: the transpose of P*·P, which is S_dd⁻¹. */
    for (size_t i = 0; i < inputs; ++i) {
        for (size_t k = 0; k < inputs; ++k) {
            r.inverse[i][k] = conjugate(r.inverse[i][k]);
        }
    }
    const double share = f->j->s->means ? 1.0 / (double)f->used : 1.0;
    write_matrix((const number(*)[MOST])r.inverse, inputs, inputs, lb_all(share),
                 out->spread + 2u * at * inputs * inputs, count);
}

typedef struct {
    lb_lanes condition, least, most; /* of the singular values */
    lb_lanes level;                  /* what noise alone has */
} sizes;

/* Bounds of the singular values of the scaled inputs from ‖D‖² and ‖D⁻¹‖² (Frobenius). With the largest and the
 * smallest paired crosswise, Cauchy–Schwarz gives ‖D‖·‖D⁻¹‖ ≥ κ + 1/κ + n − 2; for two inputs it is an equality. */
LB_INLINE sizes sizes_at(const row_facts *f, const double *scale, size_t first, size_t count)
{
    const size_t inputs = f->signals - f->outputs, lines = f->j->s->lines;
    lb_lanes direct = lb_all(0.0), inverse = direct, moved = direct;
    for (size_t i = 0; i < inputs; ++i) {
        const double *from = f->j->h->work + i * lines + first, share = 1.0 / scale[i];
        direct += lb_load(from, count) * share;
        inverse += lb_load(from + inputs * lines, count) * scale[i];
        moved = lb_larger(moved, lb_load(from + 2u * inputs * lines, count) * share);
    }
    const lb_lanes half = lb_at_least(1.0, (lb_roots(direct * inverse) - ((double)inputs - 2.0)) * 0.5);
    sizes found = {.condition = half + lb_roots(half * half - 1.0), .most = lb_roots(direct)};
    found.least = lb_roots(direct * (1.0 / (double)inputs)) / found.condition;
    found.least = lb_larger(found.least, lb_roots(1.0 / inverse));
    const lb_lanes factor = lb_roots(lb_all((double)inputs)) + lb_roots(lb_all((double)f->j->s->experiments));
    const double windows = f->dof * (double)f->used;
    found.level = lb_all(0.0);
    if (windows > 0.0) {
        found.level = above_noise * factor * lb_roots(moved * (1.0 / windows));
    }
    return found;
}

/* Whether the inputs separate, with each input scaled to the same power over all lines. */
LB_INLINE void judge_inputs(const row_facts *f)
{
    const lb_matrix_settings *s = f->j->s;
    const lb_matrix_rows *out = f->j->out;
    const size_t inputs = s->inputs, lines = s->lines, at = f->row * lines;
    double scale[MOST];
    for (size_t i = 0; i < inputs; ++i) {
        double sum = 0.0;
        for (size_t k = 0; k < lines; ++k) {
            sum += f->j->h->work[i * lines + k];
        }
        scale[i] = sum * (1.0 / (double)(lines * s->experiments));
    }
    lb_lanes most = lb_all(0.0);
    for (size_t first = 0; first < lines; first += LB_LANES) {
        most = lb_larger(most, sizes_at(f, scale, first, lines - first).most);
    }
    const double rank = rank_share * lb_largest_lane(most);
    const double limit = s->condition_max < condition_known ? s->condition_max : condition_known;
    for (size_t first = 0; first < lines; first += LB_LANES) {
        const size_t count = lines - first;
        const sizes found = sizes_at(f, scale, first, count);
        const lb_mask sure = lb_above(lb_all(limit), found.condition) & lb_above(found.least, found.level) &
                             lb_above(found.least, lb_all(rank));
        lb_store(out->condition + at + first, found.condition, count);
        lb_store_flags(out->sure + at + first, sure, count);
    }
}

LB_INLINE void fill(double *p, size_t count)
{
    for (size_t i = 0; i < count; ++i) {
        p[i] = NOT_A_NUMBER;
    }
}

static void write_nothing(const row_facts *f)
{
    const lb_matrix_settings *s = f->j->s;
    const lb_matrix_rows *out = f->j->out;
    const size_t lines = s->lines, at = f->row * lines, o = s->outputs, i = s->inputs;
    fill(out->value + 2u * at * o * i, 2u * lines * o * i);
    fill(out->noise + 2u * at * o * o, 2u * lines * o * o);
    fill(out->spread + 2u * at * i * i, 2u * lines * i * i);
    fill(out->coherence + at * o, lines * o);
    fill(out->condition + at, lines);
    for (size_t k = 0; k < lines; ++k) {
        out->sure[at + k] = 0;
    }
}

LB_INLINE void remember(const job *j, size_t row, size_t to)
{
    const size_t lines = j->s->lines, from = (size_t)j->in->row[row];
    const size_t signals = j->s->outputs + j->s->inputs + j->s->beside;
    for (size_t i = 0; i < signals; ++i) {
        const double *x = j->in->spectrum + 2u * (i * j->in->of + from) * j->in->stride;
        double *p = j->h->spectrum + 2u * lines * (signals * to + i);
        for (size_t first = 0; first < lines; first += LB_LANES) {
            lb_lanes re, im;
            lb_load_pairs(x + 2u * first, lines - first, &re, &im);
            lb_store(p + first, re, lines - first);
            lb_store(p + lines + first, im, lines - first);
        }
    }
    j->h->complete[to] = j->in->clean[from];
}

static size_t complete_repetitions(const row_facts *f)
{
    for (size_t i = 0; i < f->j->s->repetitions; ++i) {
        for (size_t e = 0; e < f->j->s->experiments; ++e) {
            if (!f->j->h->complete[ring_row(f, i, e)]) {
                return i;
            }
        }
    }
    return f->j->s->repetitions;
}

void LB_MATRIX_NAME(const job *j)
{
    const lb_matrix_settings *s = j->s;
    for (size_t row = 0; row < j->in->rows; ++row) {
        row_facts f = {.j = j, .row = row, .newest = (j->in->first + row) % j->h->length, .outputs = s->outputs};
        f.signals = s->outputs + s->inputs;
        f.skipped = s->average ? 0u : 1u;
        remember(j, row, f.newest);
        const size_t complete = complete_repetitions(&f);
        f.used = s->average || !complete ? complete : 1u;
        f.judged = complete > f.skipped ? complete - f.skipped : 0u;
        f.dof = f.judged > 1u ? (double)((f.judged - 1u) * s->experiments) : 0.0;
        j->out->complete[row] = (int64_t)complete;
        j->out->dof[row] = f.dof;
        if (!complete) {
            write_nothing(&f);
            continue;
        }
        for (size_t first = 0; first < s->lines; first += LB_LANES) {
            process_lines(&f, first, s->lines - first);
        }
        judge_inputs(&f);
    }
}
