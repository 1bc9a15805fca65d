/* Prints a hash of the verdicts on lines over many periods, the same on every machine and compiler; every NaN counts as
 * the same. Buffers have their exact size, so that sanitizers see what is beyond them. Exit code 1 if periods one by
 * one give other bits than all at once, or a wrong call is not refused. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arrays.h"
#include "livebode/repeating.h"

#define LINES 3u
#define BESIDE 4u
#define BINS (LINES + BESIDE)
#define WINDOW 24u
#define SPECTRUM (WINDOW / 2u + 1u)
#define MAINS_BINS 5u
#define PERIODS 60u

/* From integers alone, |x| < 4, and rarely not finite. */
static double noise(uint32_t *state)
{
    static const double zero = 0.0;
    *state = *state * 1664525u + 1013904223u;
    const double x = (double)((int32_t)(*state >> 12) - (1 << 19)) / 131072.0;
    return *state % 4999u == 0u ? x / zero : x;
}

static uint64_t hashed(uint64_t hash, const double *data, size_t count)
{
    for (size_t i = 0; i < count; ++i) {
        uint64_t bits = 1;
        if (data[i] == data[i]) {
            memcpy(&bits, data + i, sizeof bits);
        }
        hash = (hash ^ bits) * 1099511628211u;
    }
    return hash;
}

static uint64_t hashed_bytes(uint64_t hash, const uint8_t *data, size_t count)
{
    for (size_t i = 0; i < count; ++i) {
        hash = (hash ^ data[i]) * 1099511628211u;
    }
    return hash;
}

static const int64_t bins[BINS] = {3, 5, 9, 1, 7, 11, 10}, mains_bins[MAINS_BINS] = {3, 4, 6, 7, 8};
static const int64_t tone[1] = {2}, beside_tone[2] = {1, 4}, lines_at[LINES] = {0, 3, 4},
                     beside_lines[6] = {1, 2, 1, 2, 1, 3};
static const uint8_t yes[24] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
static const uint8_t multiples[LB_MAINS * LINES] = {1, 0, 1, 0, 0, 0};
static const double two[LINES] = {2, 2, 2}, times[LINES] = {3, 4, 3}, of_step[LINES] = {0.7, 1.2, 1.8};
static const int64_t left[BESIDE] = {0, 1, 2, 2}, right[BESIDE] = {0, 2, 2, 2};
static const double share[BESIDE] = {0, 0.5, 0, 0}, position[LINES] = {0.25, 0.5, 0.75};
static const int64_t beside[2 * LINES * LB_BESIDE] = {0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0,
                                                      1, 2, 3, 3, 1, 2, 3, 3, 2, 3, 2, 3};

static lb_repeating_plan plan_of(int instrument)
{
    const lb_tones free_tone = {1, 2, tone, beside_tone, yes, two, yes, times},
                   none = {0, 2, tone, tone, yes, two, yes, times};
    const lb_tones excited = {LINES, 2, lines_at, beside_lines, yes, two, yes, times};
    const lb_mains mains = {MAINS_BINS, mains_bins, multiples, {free_tone, none}, excited};
    const lb_distortion distortion = {BESIDE, left, right, share, beside, yes, position};
    const lb_repeating_plan plan = {WINDOW, LINES, 3, {0, 1, 2}, bins, NULL, instrument, 2, of_step, mains, distortion};
    return plan;
}

/* Everything that changes, in memory of its own. */
typedef struct {
    lb_repeating_state state;
    lb_verdicts out;
} job;

static job job_of(size_t count)
{
    job j;
    j.state.largest = j.state.step = 0.0;
    const lb_line_moments m = {
        1,    BINS, (int64_t *)claim(1, sizeof(int64_t)), reals(LB_LINE_MEANS * BINS), reals(LB_LINE_SCATTER * BINS),
        NULL, NULL};
    j.state.moments = m;
    j.state.output = reals(2 * MAINS_BINS);
    j.state.silent_power = reals(LB_SILENT_PERIODS * LINES);
    j.state.hum = reals(LINES);
    j.state.low = reals(LINES);
    j.state.counts = reals(2);
    j.state.told = flags(LB_VERDICT_KINDS * LINES);
    const lb_verdicts out = {reals((count + 1) * LINES),
                             flags((count + 1) * LB_VERDICT_KINDS * LINES),
                             flags((count + 1) * LINES),
                             flags(count),
                             flags(count * LB_VERDICT_KINDS * LINES),
                             reals(count * 4 * LINES),
                             reals(count * LINES)};
    j.out = out;
    return j;
}

static void release(job *j)
{
    void *every[] = {j->state.moments.count,
                     j->state.moments.means,
                     j->state.moments.scatter,
                     j->state.output,
                     j->state.silent_power,
                     j->state.hum,
                     j->state.low,
                     j->state.counts,
                     j->state.told,
                     j->out.distortion,
                     j->out.against,
                     j->out.invalid,
                     j->out.happened,
                     j->out.news,
                     j->out.pair,
                     j->out.steps};
    for (size_t i = 0; i < sizeof every / sizeof *every; ++i) {
        free(every[i]);
    }
}

static uint64_t hash_of_state(uint64_t hash, const lb_repeating_state *s)
{
    hash = hashed(hash, &s->largest, 1);
    hash = hashed(hash, s->moments.means, LB_LINE_MEANS * BINS);
    hash = hashed(hash, s->moments.scatter, LB_LINE_SCATTER * BINS);
    hash = hashed(hash, s->output, 2 * MAINS_BINS);
    hash = hashed(hash, s->silent_power, LB_SILENT_PERIODS * LINES);
    hash = hashed(hash, s->hum, LINES);
    return hashed_bytes(hash, s->told, LB_VERDICT_KINDS * LINES);
}

static double step_of(void *context, size_t period)
{
    (void)period;
    return *(const double *)context;
}

static double by_chance(void *context, size_t known, double dof)
{
    (void)context;
    return 1.0 + (double)known / dof;
}

/* Spectra with pauses, in which the lines at the mains have hum for a while. */
static double *spectra_of(uint32_t seed)
{
    double *found = reals(3 * PERIODS * SPECTRUM * 2);
    for (size_t i = 0; i < 3 * PERIODS * SPECTRUM * 2; ++i) {
        const size_t signal = i / (PERIODS * SPECTRUM * 2), period = i / (SPECTRUM * 2) % PERIODS,
                     bin = i / 2 % SPECTRUM;
        const int is_line = bin == 3 || bin == 5 || bin == 9, is_paused = period / 12 % 2 == 1;
        const double x = noise(&seed);
        found[i] = signal == 0 ? x / 8 : is_paused ? 0.0 : x / 64;
        found[i] += is_line && !is_paused ? 1.0 + (double)bin / 8 : 0.0;
        found[i] += signal == 0 && period < 40 && (bin == 3 || bin == 6) ? 9.0 : 0.0;
    }
    return found;
}

static lb_periods periods_of(const double *spectra, const uint8_t *usable, const uint8_t *moves, const job *before,
                             size_t row, double *scratch, double *step)
{
    const lb_periods in = {PERIODS,
                           spectra,
                           usable,
                           moves,
                           before->out.distortion + row * LINES,
                           before->out.against + row * LB_VERDICT_KINDS * LINES,
                           scratch,
                           {step, step_of, by_chance}};
    return in;
}

/* One period after the other must change the state as all at once do. */
static void demand_one_by_one(const lb_repeating_plan *plan, const double *spectra, const lb_periods *every,
                              const job *after)
{
    job j = job_of(1);
    double *one = reals(3 * SPECTRUM * 2);
    for (size_t period = 0; period < PERIODS; ++period) {
        for (size_t signal = 0; signal < 3; ++signal) {
            memcpy(one + signal * SPECTRUM * 2, spectra + (signal * PERIODS + period) * SPECTRUM * 2,
                   SPECTRUM * 2 * sizeof(double));
        }
        lb_periods in = *every;
        double distortion[LINES];
        uint8_t against[LB_VERDICT_KINDS * LINES];
        memcpy(distortion, j.out.distortion + LINES, sizeof distortion);
        memcpy(against, j.out.against + LB_VERDICT_KINDS * LINES, sizeof against);
        in.count = 1, in.spectra = one, in.usable += period, in.moves += period;
        in.distortion = distortion, in.against = against;
        DEMAND(lb_repeating_process(plan, &j.state, &in, &j.out) == LB_OK);
        DEMAND(hashed(0, j.out.distortion + LINES, LINES) ==
               hashed(0, after->out.distortion + (period + 1) * LINES, LINES));
    }
    DEMAND(hash_of_state(0, &j.state) == hash_of_state(0, &after->state));
    free(one);
    release(&j);
}

static uint64_t run(uint32_t seed, uint64_t hash)
{
    const lb_repeating_plan plan = plan_of(seed % 2u == 0u);
    double *spectra = spectra_of(seed), *scratch = reals(lb_repeating_scratch(&plan)), step = seed % 3u ? 0.5 : 0.0;
    uint8_t *usable = flags(PERIODS), *moves = flags(PERIODS);
    for (size_t i = 0; i < PERIODS; ++i) {
        usable[i] = i % 11 != 5;
        moves[i] = seed % 5u == 0u && i % 23 == 9;
    }
    job none = job_of(1), j = job_of(PERIODS);
    const lb_periods in = periods_of(spectra, usable, moves, &none, 0, scratch, &step);
    DEMAND(lb_repeating_process(&plan, &j.state, &in, &j.out) == LB_OK);
    hash = hash_of_state(hashed(hash, j.out.distortion, (PERIODS + 1) * LINES), &j.state);
    hash = hashed_bytes(hash, j.out.invalid, (PERIODS + 1) * LINES);
    hash = hashed_bytes(hash, j.out.happened, PERIODS);
    hash = hashed_bytes(hash, j.out.news, PERIODS * LB_VERDICT_KINDS * LINES);
    demand_one_by_one(&plan, spectra, &in, &j);
    free(spectra), free(scratch), free(usable), free(moves);
    release(&none);
    release(&j);
    return hash;
}

static void refuse_misuse(void)
{
    const lb_repeating_plan plan = plan_of(1);
    lb_repeating_plan wrong = plan;
    job j = job_of(1), partial = j;
    double spectra[3 * SPECTRUM * 2] = {0}, *scratch = reals(lb_repeating_scratch(&plan)), step = 0;
    lb_periods in = periods_of(spectra, yes, yes, &j, 0, scratch, &step), missing;
    in.count = 1;
    DEMAND(lb_repeating_process(NULL, &j.state, &in, &j.out) == LB_ERROR_NULL);
    DEMAND(lb_repeating_process(&plan, &j.state, &in, NULL) == LB_ERROR_NULL);
    missing = in, missing.spectra = NULL;
    DEMAND(lb_repeating_process(&plan, &j.state, &missing, &j.out) == LB_ERROR_NULL);
    missing = in, missing.rare.step_of = NULL;
    DEMAND(lb_repeating_process(&plan, &j.state, &missing, &j.out) == LB_ERROR_NULL);
    partial.state.hum = NULL;
    DEMAND(lb_repeating_process(&plan, &partial.state, &in, &j.out) == LB_ERROR_NULL);
    partial = j, partial.state.moments.lines = BINS + 1u;
    DEMAND(lb_repeating_process(&plan, &partial.state, &in, &j.out) == LB_ERROR_SIZE);
    wrong.judged_every = 0;
    DEMAND(lb_repeating_process(&wrong, &j.state, &in, &j.out) == LB_ERROR_SIZE);
    wrong = plan, wrong.mains.excited.beside = LB_NEIGHBOURS_MAX + 1u;
    DEMAND(lb_repeating_process(&wrong, &j.state, &in, &j.out) == LB_ERROR_SIZE);
    free(scratch);
    release(&j);
}

int main(void)
{
    uint64_t total = 14695981039346656037u;
    refuse_misuse();
    for (uint32_t seed = 0; seed < 40; ++seed) {
        total = run(seed, total);
    }
    printf("%016" PRIx64 "\n", total);
    return 0;
}
