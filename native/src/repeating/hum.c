/* Mains hum: tones at other multiples of the mains, and tones in periods without excitation that do not decay. */
#include "repeating.h"

/* Of the strongest line's power: hum below a ten-thousandth of the response, and rounding, do not matter. */
static const double matters = 1e-8;
/* Periods of silence before the first excitation: thirds that a tone can decay over. */
#define PERIODS_FIRST 3u
/* Of the power in the first third of the periods: in the last third a tone that does not decay has more. */
static const double steady = 0.9;
/* Of the previous power of the hum: below this, and without a tone, so many periods in a row, it has disappeared. */
static const double gone_below = 0.25;
static const double gone_periods = 2.0;

int lb_stands_out(const lb_tones *t, const double *powers, size_t tone)
{
    double beside[LB_NEIGHBOURS_MAX];
    LB_ASSERT(tone < t->count && t->beside <= LB_NEIGHBOURS_MAX);
    for (size_t i = 0; i < t->beside; ++i) {
        const size_t at = tone * t->beside + i;
        beside[i] = t->usable[at] ? powers[t->neighbours[at]] : 0.0;
    }
    const double level = lb_sum(beside, t->beside) / t->known[tone];
    return t->enough[tone] && powers[t->tones[tone]] > t->times[tone] * level;
}

static int has_tone(const lb_tones *t, const double *powers, double least)
{
    for (size_t i = 0; i < t->count; ++i) {
        if (powers[t->tones[i]] > least && lb_stands_out(t, powers, i)) {
            return 1;
        }
    }
    return 0;
}

void lb_mains_seen(const lb_repeating_plan *plan, const lb_scratch *scratch, uint8_t *seen)
{
    const lb_mains *m = &plan->mains;
    const double *powers = scratch->powers;
    for (size_t i = 0; i < plan->lines; ++i) {
        seen[i] = 0;
    }
    if (!m->bins) {
        return;
    }
    double largest = powers[m->excited.tones[0]];
    for (size_t i = 1; i < m->excited.count; ++i) {
        largest = lb_maximum(largest, powers[m->excited.tones[i]]);
    }
    for (size_t k = 0; k < LB_MAINS; ++k) {
        const int found = has_tone(&m->free[k], powers, matters * largest);
        for (size_t i = 0; i < plan->lines; ++i) {
            seen[i] |= (uint8_t)(found && m->multiples[k * plan->lines + i]);
        }
    }
}

/* Hum is what is a tone in all of the newest periods, and does not decay over them. */
static void find(const lb_repeating_plan *plan, const lb_repeating_state *s, size_t periods)
{
    const size_t third = periods / 3u;
    for (size_t i = 0; i < plan->lines; ++i) {
        const double *power = s->silent_power + (LB_SILENT_PERIODS - periods) * plan->lines + i;
        double first = 0.0, last = 0.0;
        int known = 1;
        for (size_t p = 0; p < periods; ++p) {
            const double now = power[p * plan->lines];
            known &= lb_is_finite(now);
            first += p < third ? now : 0.0;
            last += p >= periods - third ? now : 0.0;
        }
        first /= (double)third;
        last /= (double)third;
        if (known && last >= steady * first && s->hum[i] == 0.0) {
            s->hum[i] = last;
        }
    }
}

static int is_at_mains(const lb_repeating_plan *plan, size_t line)
{
    return plan->mains.multiples[line] || plan->mains.multiples[plan->lines + line];
}

int lb_silence_take(const lb_repeating_plan *plan, const lb_repeating_state *s, const double *powers, uint8_t *gone)
{
    const lb_tones *lines = &plan->mains.excited;
    const size_t newest = (LB_SILENT_PERIODS - 1u) * plan->lines;
    int any = 0;
    for (size_t i = 0; i < newest; ++i) {
        s->silent_power[i] = s->silent_power[i + plan->lines];
    }
    for (size_t i = 0; i < plan->lines; ++i) {
        const int is_prominent = plan->mains.bins && is_at_mains(plan, i) && lb_stands_out(lines, powers, i);
        const double power = plan->mains.bins ? powers[lines->tones[i]] : 0.0;
        s->silent_power[newest + i] = is_prominent ? power : lb_not_a_number();
    }
    s->counts[0] += 1.0;
    if (s->counts[0] >= (double)LB_SILENT_PERIODS) {
        find(plan, s, LB_SILENT_PERIODS);
    }
    for (size_t i = 0; i < plan->lines; ++i) {
        const double now = s->silent_power[newest + i], power = plan->mains.bins ? powers[lines->tones[i]] : 0.0;
        const int is_prominent = now == now;
        s->low[i] = power < gone_below * s->hum[i] && !is_prominent ? s->low[i] + 1.0 : 0.0;
        gone[i] = s->low[i] >= gone_periods;
        s->hum[i] = gone[i] ? 0.0 : s->hum[i];
        any |= gone[i];
    }
    return any;
}

void lb_silence_end(const lb_repeating_plan *plan, const lb_repeating_state *s)
{
    const double silent = s->counts[0], excited = s->counts[1];
    if (excited == 0.0 && silent >= (double)PERIODS_FIRST && silent < (double)LB_SILENT_PERIODS) {
        find(plan, s, (size_t)silent);
    }
    s->counts[0] = 0.0;
    s->counts[1] = 1.0;
    if (silent > 0.0) {
        for (size_t i = 0; i < LB_SILENT_PERIODS * plan->lines; ++i) {
            s->silent_power[i] = lb_not_a_number();
        }
    }
}
