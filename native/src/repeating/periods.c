/* Periods one after the other: which of them have excitation, their mean, and the verdicts on lines. */
#include "repeating.h"

static const double excited_share = 1e-12; /* of the largest power of the reference */
static const double other = 0.1;           /* of the excitation's power: from where on a period is of another phase */
static const double several = 1e-9;        /* Σv − Σv²/Σv is 0 for one period, except for rounding */
static const double distorted = 0.5;       /* of |G|: from where on the value is not that of a linear machine */
static const double steps_least = 0.5;     /* amplitude in steps of the sensor; below, a line may not be seen at all */
#define PERIODS_MIN 2

enum { OUTPUT, DENOMINATOR, REFERENCE };

typedef struct {
    const lb_repeating_plan *plan;
    lb_repeating_state *state;
    const lb_periods *in;
    const lb_verdicts *out;
    lb_scratch scratch;
} job;

/* Every period counts equally. */
static const lb_line_weights equal_weights = {1.0, 0, 0};

static size_t bins_of(const lb_repeating_plan *plan) { return plan->lines + plan->distortion.bins; }

size_t lb_repeating_scratch(const lb_repeating_plan *plan)
{
    return 6u * bins_of(plan) + plan->mains.bins + 3u * plan->lines + 5u * plan->distortion.bins;
}

static lb_scratch scratch_of(const lb_repeating_plan *plan, double *numbers)
{
    lb_scratch s;
    s.spectra = numbers;
    s.powers = s.spectra + 6u * bins_of(plan);
    s.ratio = s.powers + plan->mains.bins;
    s.line = s.ratio + 2u * plan->lines;
    s.model = s.line + plan->lines;
    s.mean = s.model + 2u * plan->distortion.bins;
    s.noise = s.mean + plan->distortion.bins;
    s.beside = s.noise + plan->distortion.bins;
    return s;
}

static const double *spectrum_of(const job *j, size_t signal, size_t period)
{
    return j->in->spectra + 2u * (signal * j->in->count + period) * (j->plan->window / 2u + 1u);
}

/* The three signals of the estimate at the bins. */
static void read_spectra(const job *j, size_t period)
{
    const size_t bins = bins_of(j->plan);
    for (size_t s = 0; s < 3u; ++s) {
        const double *from = spectrum_of(j, j->plan->of_signal[s], period);
        double *to = j->scratch.spectra + 2u * s * bins;
        for (size_t i = 0; i < bins; ++i) {
            to[2u * i] = from[2 * j->plan->bin[i]];
            to[2u * i + 1u] = from[2 * j->plan->bin[i] + 1];
            if (j->plan->after) {
                lb_times(to + 2u * i, j->plan->after + 2u * (s * bins + i), to + 2u * i);
            }
        }
    }
}

static const double *reference_of(const job *j) { return j->scratch.spectra + 2u * REFERENCE * bins_of(j->plan); }

static int is_paused(const job *j)
{
    const double *reference = reference_of(j);
    double level = lb_power(reference);
    for (size_t i = 1; i < j->plan->lines; ++i) {
        level = lb_maximum(level, lb_power(reference + 2u * i));
    }
    j->state->largest = lb_fmax(j->state->largest, level);
    return level <= excited_share * j->state->largest;
}

static void fill(double *to, size_t count, double value)
{
    for (size_t i = 0; i < count; ++i) {
        to[i] = value;
    }
}

/* Begins another mean. */
static void forget(const job *j, size_t period)
{
    const lb_line_moments *m = &j->state->moments;
    if (*m->count) {
        *m->count = 0;
        fill(m->means, LB_LINE_MEANS * m->lines, 0.0);
        fill(m->scatter, LB_LINE_SCATTER * m->lines, 0.0);
        fill(j->state->output, 2u * j->plan->mains.bins, 0.0);
    }
    j->out->happened[period] |= LB_PERIOD_FORGOTTEN;
}

/* Whether the excitation, at the lines, is not that of the mean. */
static int is_another(const job *j)
{
    const lb_line_moments *m = &j->state->moments;
    const double *re = m->means + REF_RE * m->lines, *im = m->means + REF_IM * m->lines, *now = reference_of(j);
    double *powers = j->scratch.line;
    if (!j->plan->instrument || !*m->count) {
        return 0;
    }
    for (size_t i = 0; i < j->plan->lines; ++i) {
        const double apart[2] = {now[2u * i] - re[i], now[2u * i + 1u] - im[i]};
        powers[i] = lb_power(apart);
    }
    const double apart = lb_sum(powers, j->plan->lines);
    for (size_t i = 0; i < j->plan->lines; ++i) {
        powers[i] = re[i] * re[i] + im[i] * im[i];
    }
    return apart > other * lb_sum(powers, j->plan->lines);
}

/* Adds the period to the moments of output, denominator and reference. */
static void add_moments(const job *j)
{
    const lb_line_moments *m = &j->state->moments;
    const double share = 1.0 / (double)*m->count;
    for (size_t first = 0; first < m->lines; first += LB_LANES) {
        const size_t count = m->lines - first < LB_LANES ? m->lines - first : LB_LANES;
        lb_some_moments some = lb_load_moments(m, first, count);
        lb_window now;
        for (size_t s = 0; s < 3u; ++s) {
            const double *from = j->scratch.spectra + 2u * (s * m->lines + first);
            lb_load_pairs(from, count, &now.of[2u * s], &now.of[2u * s + 1u]);
        }
        now.of[REF_POWER] = now.of[REF_RE] * now.of[REF_RE] + now.of[REF_IM] * now.of[REF_IM];
        now.of[OUT_POWER] = now.of[NUM_RE] * now.of[NUM_RE] + now.of[NUM_IM] * now.of[NUM_IM];
        now.of[NOISE_POWER] = now.of[DEN_POWER] = lb_all(0.0);
        lb_add_window(&some, equal_weights.forgetting, share, &now);
        lb_store_moments(m, first, count, &some);
    }
}

/* Adds the period to the mean output at the bins of the mains. */
static void add_output(const job *j, size_t period)
{
    const double *output = spectrum_of(j, j->plan->of_signal[OUTPUT], period);
    const double share = 1.0 / (double)*j->state->moments.count;
    for (size_t i = 0; i < j->plan->mains.bins; ++i) {
        const double *now = output + 2 * j->plan->mains.bin[i];
        double *mean = j->state->output + 2u * i;
        mean[0] += (now[0] - mean[0]) * share;
        mean[1] += (now[1] - mean[1]) * share;
    }
}

static int is_power_of_two(int64_t count) { return (count & (count - 1)) == 0; }

/* Where the first period shows no step, few others do: the search takes as long as the rest of a period. */
static void search_step(const job *j, size_t period)
{
    const int64_t count = *j->state->moments.count;
    if (count == 1 || (j->state->step == 0.0 && is_power_of_two(count))) {
        j->state->step = j->in->rare.step_of(j->in->rare.context, period);
    }
}

static size_t row_of(const job *j, size_t row) { return row * LB_VERDICT_KINDS * j->plan->lines; }

/* The verdict before a period, until there is another. */
static void copy_verdict(const job *j, size_t period)
{
    const size_t lines = j->plan->lines;
    const double *distortion = period ? j->out->distortion + (period - 1u) * lines : j->in->distortion;
    const uint8_t *against = period ? j->out->against + row_of(j, period - 1u) : j->in->against;
    for (size_t i = 0; i < lines; ++i) {
        j->out->distortion[period * lines + i] = distortion[i];
    }
    for (size_t i = 0; i < LB_VERDICT_KINDS * lines; ++i) {
        j->out->against[row_of(j, period) + i] = against[i];
    }
}

static void write_invalid(const job *j, size_t row)
{
    const size_t lines = j->plan->lines;
    const uint8_t *against = j->out->against + row_of(j, row);
    for (size_t i = 0; i < lines; ++i) {
        j->out->invalid[row * lines + i] = against[i] | against[lines + i] | against[2u * lines + i];
    }
}

/* Means of numerator and denominator, their quotient, and the power of the mean output. */
static void read_means(const job *j, double *pair)
{
    const lb_line_moments *m = &j->state->moments;
    for (size_t i = 0; i < j->plan->lines; ++i) {
        double *numerator = pair + 2u * i, *denominator = pair + 2u * (j->plan->lines + i);
        numerator[0] = m->means[NUM_RE * m->lines + i];
        numerator[1] = m->means[NUM_IM * m->lines + i];
        denominator[0] = m->means[DEN_RE * m->lines + i];
        denominator[1] = m->means[DEN_IM * m->lines + i];
        lb_divide(numerator, denominator, j->scratch.ratio + 2u * i);
    }
    for (size_t i = 0; i < j->plan->mains.bins; ++i) {
        j->scratch.powers[i] = lb_power(j->state->output + 2u * i);
    }
}

static lb_verdict_facts facts_of(const job *j, const double *pair)
{
    const lb_weight_sums w = lb_sums_of(&equal_weights, *j->state->moments.count);
    const double rest = w.one - w.two / w.one;
    const lb_verdict_facts f = {.plan = j->plan,
                                .state = j->state,
                                .scratch = &j->scratch,
                                .pair = pair,
                                .weights = w,
                                .unbiased = rest > several ? rest : lb_not_a_number(),
                                .of_mean = w.two / (w.one * w.one)};
    return f;
}

static int is_significant(const job *j, const lb_verdict_facts *f, const lb_repeats *repeats)
{
    const double ratio = f->weights.two / f->weights.one;
    const double dof =
        f->unbiased * f->unbiased / (f->weights.two - 2.0 * f->weights.three / f->weights.one + ratio * ratio);
    return repeats->over_noise > j->in->rare.by_chance(j->in->rare.context, repeats->known, dof);
}

/* Lines whose distortion is too large. Of a mean that was restarted it has little significance: the previous verdict
 * applies. */
static void judge_distortion(const job *j, const lb_verdict_facts *f, double *distortion, uint8_t *against)
{
    const size_t lines = j->plan->lines;
    uint8_t any = 0;
    if (!j->plan->distortion.bins) {
        for (size_t i = 0; i < lines; ++i) {
            distortion[i] = lb_not_a_number();
            against[i] = 0;
        }
        return;
    }
    const uint8_t *before = against - LB_VERDICT_KINDS * lines;
    const lb_repeats repeats = lb_distortion_variance(f, distortion);
    for (size_t i = 0; i < lines; ++i) {
        distortion[i] = lb_root(distortion[i]) / lb_root(lb_power(f->pair + 2u * (lines + i)));
        against[i] = distortion[i] > distorted * lb_root(lb_power(j->scratch.ratio + 2u * i));
        any |= against[i];
    }
    if (any && !is_significant(j, f, &repeats)) {
        for (size_t i = 0; i < lines; ++i) {
            against[i] &= before[i];
        }
    }
}

/* Lines that are too weak for the steps of the sensor; noise larger than the steps carries any amplitude over them. */
static void judge_steps(const job *j, const lb_verdict_facts *f, double *steps, uint8_t *against)
{
    for (size_t i = 0; i < j->plan->lines; ++i) {
        const double amplitude = 2.0 * lb_root(lb_power(f->pair + 2u * i)) / (double)j->plan->window;
        const double noise = j->state->moments.scatter[i] / f->unbiased;
        steps[i] = amplitude / lb_step_at(f, i);
        against[i] = steps[i] < steps_least && noise < lb_variance_of_steps(f, i);
    }
}

/* Marks the lines that were not known to be invalid. */
static void report(const job *j, size_t period)
{
    const uint8_t *against = j->out->against + row_of(j, period + 1u);
    for (size_t i = 0; i < LB_VERDICT_KINDS * j->plan->lines; ++i) {
        if (against[i] && !j->state->told[i]) {
            j->state->told[i] = 1;
            j->out->news[row_of(j, period) + i] = LB_NEWS_INVALID;
            j->out->happened[period] |= LB_PERIOD_NEWS;
        }
    }
}

static void judge(const job *j, size_t period)
{
    const size_t lines = j->plan->lines;
    uint8_t *against = j->out->against + row_of(j, period + 1u);
    double *pair = j->out->pair + 4u * period * lines;
    read_means(j, pair);
    const lb_verdict_facts f = facts_of(j, pair);
    judge_distortion(j, &f, j->out->distortion + (period + 1u) * lines, against + LB_DISTORTED * lines);
    lb_mains_seen(j->plan, &j->scratch, against + LB_HUM * lines);
    for (size_t i = 0; i < lines; ++i) {
        against[LB_HUM * lines + i] |= j->state->hum[i] > 0.0;
    }
    judge_steps(j, &f, j->out->steps + period * lines, against + LB_STEPS * lines);
    report(j, period);
    j->out->happened[period] |= LB_PERIOD_JUDGED;
}

/* A period without excitation, after which it may begin at another phase. */
static void pause_at(const job *j, size_t period)
{
    const size_t lines = j->plan->lines;
    const double *output = spectrum_of(j, j->plan->of_signal[OUTPUT], period);
    uint8_t *news = j->out->news + row_of(j, period) + LB_HUM * lines, *told = j->state->told + LB_HUM * lines;
    uint8_t *against = j->out->against + row_of(j, period + 1u) + LB_HUM * lines;
    forget(j, period);
    for (size_t i = 0; i < j->plan->mains.bins; ++i) {
        j->scratch.powers[i] = lb_power(output + 2 * j->plan->mains.bin[i]);
    }
    if (!lb_silence_take(j->plan, j->state, j->scratch.powers, news)) {
        return;
    }
    for (size_t i = 0; i < lines; ++i) {
        const int is_gone = news[i];
        against[i] = is_gone ? 0 : against[i];
        news[i] = is_gone && told[i] ? LB_NEWS_GONE : LB_NEWS_NONE;
        told[i] = is_gone ? 0 : told[i];
        j->out->happened[period] |= news[i] ? LB_PERIOD_NEWS : 0;
    }
}

static void excite(const job *j, size_t period)
{
    int64_t *count = j->state->moments.count;
    lb_silence_end(j->plan, j->state);
    if (is_another(j)) {
        forget(j, period);
    }
    *count += 1;
    add_moments(j);
    add_output(j, period);
    search_step(j, period);
    j->out->happened[period] |= LB_PERIOD_ADDED;
    if (*count >= PERIODS_MIN && (size_t)(*count - PERIODS_MIN) % j->plan->judged_every == 0) {
        judge(j, period);
    }
}

/* Nothing is known where the machine moves. */
static void move(const job *j, size_t period)
{
    forget(j, period);
    fill(j->out->distortion + (period + 1u) * j->plan->lines, j->plan->lines, lb_not_a_number());
    for (size_t i = 0; i < LB_VERDICT_KINDS * j->plan->lines; ++i) {
        j->out->against[row_of(j, period + 1u) + i] = 0;
    }
}

static void process_period(const job *j, size_t period)
{
    j->out->happened[period] = 0;
    for (size_t i = 0; i < LB_VERDICT_KINDS * j->plan->lines; ++i) {
        j->out->news[row_of(j, period) + i] = LB_NEWS_NONE;
    }
    copy_verdict(j, period + 1u);
    if (j->in->moves[period]) {
        move(j, period);
    } else if (j->in->usable[period]) {
        read_spectra(j, period);
        if (is_paused(j)) {
            pause_at(j, period);
        } else {
            excite(j, period);
        }
    }
    write_invalid(j, period + 1u);
}

static int is_missing(const lb_repeating_plan *plan, const lb_repeating_state *s, const lb_periods *in,
                      const lb_verdicts *out)
{
    const int state = s->moments.count && s->moments.means && s->moments.scatter && s->silent_power && s->hum &&
                      s->low && s->counts && s->told && (s->output || !plan->mains.bins);
    const int before = in->distortion && in->against && in->scratch && in->rare.step_of && in->rare.by_chance;
    const int after = out->distortion && out->against && out->invalid;
    const int of_periods =
        in->spectra && in->usable && in->moves && out->happened && out->news && out->pair && out->steps;
    return !(plan->bin && plan->of_step && state && before && after && (of_periods || !in->count));
}

static int has_too_many_neighbours(const lb_mains *mains)
{
    int found = mains->excited.beside > LB_NEIGHBOURS_MAX;
    for (size_t i = 0; i < LB_MAINS; ++i) {
        found |= mains->free[i].beside > LB_NEIGHBOURS_MAX;
    }
    return found;
}

lb_status lb_repeating_process(const lb_repeating_plan *plan, lb_repeating_state *state, const lb_periods *periods,
                               const lb_verdicts *out)
{
    if (!plan || !state || !periods || !out || is_missing(plan, state, periods, out)) {
        return LB_ERROR_NULL;
    }
    if (!plan->lines || !plan->judged_every || state->moments.places != 1u || state->moments.lines != bins_of(plan)) {
        return LB_ERROR_SIZE;
    }
    if (has_too_many_neighbours(&plan->mains)) {
        return LB_ERROR_SIZE;
    }
    const job j = {plan, state, periods, out, scratch_of(plan, periods->scratch)};
    copy_verdict(&j, 0);
    write_invalid(&j, 0);
    for (size_t period = 0; period < periods->count; ++period) {
        process_period(&j, period);
    }
    return LB_OK;
}
