/* Variance that distortion adds at the lines, from the detection lines: what repeats there beyond the noise. */
#include "repeating.h"

/* A line's coherent part of a distortion over that at a detection line, as a power; livebode.estimation.verdicts
 * says why. */
static const double coherent_power = 9.0;
/* Ratio to uniform rounding that the steps of a sensor may have at a few bins. */
static const double steps_margin = 3.0;
/* Of the power at the lines: a detection line with more is excited. */
static const double powerless = 1e-4;
/* Detection lines on each side over which the noise is averaged. */
#define SMOOTH 2u

static double mean_of(const double *x, size_t count) { return lb_sum(x, count) / (double)count; }

/* The response at a detection line: between two lines linear in it where its phase rises, in its inverse where it
 * falls. */
static void interpolate(const double *left, const double *right, double share, double *out)
{
    const double falls = right[0] * -left[1] + right[1] * left[0];
    const double re = right[0] + (left[0] - right[0]) * share, im = right[1] + (left[1] - right[1]) * share;
    if (falls < 0.0) {
        const double across[2] = {re, -im}, size = 1.0 / lb_power(across);
        lb_times(left, right, out);
        lb_times(out, across, out);
        out[0] *= size;
        out[1] *= size;
    } else {
        out[0] = left[0] + (right[0] - left[0]) * share;
        out[1] = left[1] + (right[1] - left[1]) * share;
    }
}

/* Σ|δnum − model·δden|² of a bin. */
static double unexplained(const lb_line_moments *m, size_t bin, const double *model)
{
    const double *of = m->scatter + bin;
    const double shared = model[0] * of[2u * m->lines] + model[1] * of[3u * m->lines];
    const double total = of[0] - 2.0 * shared + lb_power(model) * of[m->lines];
    return lb_maximum(total, 0.0);
}

/* Power of the mean residual at each detection line, and that of the noise in it. */
static void take_residuals(const lb_verdict_facts *f)
{
    const lb_repeating_plan *p = f->plan;
    const lb_line_moments *m = &f->state->moments;
    const lb_scratch *s = f->scratch;
    const double *reference = m->means + REF_POWER * m->lines;
    const double excited_above = p->instrument ? powerless * mean_of(reference, p->lines) : 0.0;
    for (size_t i = 0; i < p->distortion.bins; ++i) {
        const size_t bin = p->lines + i;
        double *model = s->model + 2u * i, product[2];
        const double numerator[2] = {m->means[NUM_RE * m->lines + bin], m->means[NUM_IM * m->lines + bin]};
        const double denominator[2] = {m->means[DEN_RE * m->lines + bin], m->means[DEN_IM * m->lines + bin]};
        interpolate(s->ratio + 2 * p->distortion.left[i], s->ratio + 2 * p->distortion.right[i], p->distortion.share[i],
                    model);
        lb_times(model, denominator, product);
        const double rest[2] = {numerator[0] - product[0], numerator[1] - product[1]};
        s->mean[i] = p->instrument && reference[bin] > excited_above ? lb_not_a_number() : lb_power(rest);
        s->noise[i] = unexplained(m, bin, model) / f->unbiased * f->of_mean;
    }
}

/* Mean of the known powers on one side of a line; NaN where there is none. */
static double beside(const lb_distortion *d, const double *powers, size_t first)
{
    double sum = 0.0, known = 0.0;
    for (size_t i = first; i < first + LB_BESIDE; ++i) {
        const double power = powers[d->beside[i]];
        if (d->member[i] && lb_is_finite(power)) {
            sum += power;
            known += 1.0;
        }
    }
    return sum / known;
}

/* Power at a line from those at the detection lines. */
static double at_line(const lb_verdict_facts *f, const double *powers, size_t line)
{
    const lb_distortion *d = &f->plan->distortion;
    const double below = beside(d, powers, line * LB_BESIDE);
    const double above = beside(d, powers, (f->plan->lines + line) * LB_BESIDE);
    if (below != below) {
        return above;
    }
    return above != above ? below : below + (above - below) * d->position[line];
}

/* What repeats beyond the noise, as it is and divided by |Ĝ|, at each line: the larger of both. */
static void take_excess(const lb_verdict_facts *f, double *found)
{
    const lb_scratch *s = f->scratch;
    const size_t bins = f->plan->distortion.bins;
    for (size_t i = 0; i < bins; ++i) {
        s->beside[i] = s->mean[i] - s->noise[i];
    }
    for (size_t i = 0; i < f->plan->lines; ++i) {
        found[i] = at_line(f, s->beside, i);
    }
    for (size_t i = 0; i < bins; ++i) {
        s->beside[i] = s->beside[i] / lb_power(s->model + 2u * i);
    }
    for (size_t i = 0; i < f->plan->lines; ++i) {
        const double as_input = at_line(f, s->beside, i) * lb_power(s->ratio + 2u * i);
        found[i] = lb_maximum(lb_fmax(found[i], as_input), 0.0) + 0.0; /* which zero a maximum is, is not specified */
    }
}

static int is_known(const lb_scratch *s, size_t i) { return lb_is_finite(s->mean[i]) && lb_is_finite(s->noise[i]); }

/* Power that repeats over that of the noise beside it, mean over the known detection lines. */
static lb_repeats over_noise(const lb_verdict_facts *f)
{
    const lb_scratch *s = f->scratch;
    const size_t bins = f->plan->distortion.bins;
    lb_repeats found = {0.0, 0};
    for (size_t i = 0; i < bins; ++i) {
        double sum = 0.0, known = 0.0;
        for (size_t k = i < SMOOTH ? 0 : i - SMOOTH; k < bins && k <= i + SMOOTH; ++k) {
            sum += is_known(s, k) ? s->noise[k] : 0.0;
            known += is_known(s, k) ? 1.0 : 0.0;
        }
        const double smooth = sum / known;
        if (is_known(s, i)) {
            s->beside[found.known++] = smooth > 0.0 ? s->mean[i] / smooth : lb_infinite();
        }
    }
    found.over_noise = found.known ? mean_of(s->beside, found.known) : 0.0;
    return found;
}

lb_repeats lb_distortion_variance(const lb_verdict_facts *f, double *variance)
{
    const lb_scratch *s = f->scratch;
    const size_t lines = f->plan->lines;
    take_residuals(f);
    take_excess(f, variance);
    const lb_repeats repeats = over_noise(f);
    const double rest = repeats.over_noise > 0.0 ? lb_fmax(0.0, 1.0 - 1.0 / repeats.over_noise) : 0.0;
    for (size_t i = 0; i < lines; ++i) {
        s->line[i] = lb_power(f->pair + 2u * i);
    }
    const double mean = mean_of(s->line, lines);
    for (size_t i = 0; i < lines; ++i) {
        const double stronger = lb_maximum(s->line[i] / mean, 1.0), found = variance[i];
        const double above_steps = lb_maximum(found - steps_margin * lb_variance_of_steps(f, i), 0.0);
        variance[i] = rest * rest * (found + (coherent_power * stronger - 1.0) * above_steps);
    }
    return repeats;
}
