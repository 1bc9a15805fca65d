/* read: the present spectra, also with the taps of a window. */
#include "state.h"

/* a0, a1/2, a2/2 of w(n) = a0 − a1·cos(2πn/N) + a2·cos(4πn/N). */
static const real window_taps[3][3] = {
    {(real)0.5, (real)0.25, (real)0},     /* Hann */
    {(real)0.54, (real)0.23, (real)0},    /* Hamming */
    {(real)0.42, (real)0.25, (real)0.04}, /* Blackman */
};

/* out *= e^(−jθ), θ of the next sample: from the window's phase to that of the fixed grid. */
static void turn_back(const LB_DFT *t, real *out)
{
    LB_ASSERT(t->variant != LB_MODULATED); /* whose rows have either phase */
    int backwards;
    const real *row = lb_next_row(t, &backwards);
    for (size_t b = 0; b < t->bin_count; ++b) {
        const real re = out[2 * b], im = out[2 * b + 1];
        const real c = row[lb_cos_at(b)], sine = row[lb_cos_at(b) + LB_BLOCK];
        const real s = backwards ? sine : -sine;
        out[2 * b] = re * c - im * s;
        out[2 * b + 1] = im * c + re * s;
    }
}

static void apply_taps(const LB_DFT *t, real *out)
{
    LB_ASSERT(lb_is_windowed(t->variant));
    LB_ASSERT(t->spectrum && t->taps && out != t->spectrum);
    const real *w = window_taps[t->variant - LB_HANN];
    for (size_t i = 0; i < 2 * (size_t)t->bin_count; ++i) {
        const uint32_t *taps = t->taps + i / 2 * 4;
        LB_ASSERT(taps[0] < t->inner_count && taps[1] < t->inner_count);
        LB_ASSERT(taps[2] < t->inner_count && taps[3] < t->inner_count);
        const real *x = t->spectrum + i % 2;
        const real near = x[2 * (size_t)taps[0]] + x[2 * (size_t)taps[1]];
        const real far = x[2 * (size_t)taps[2]] + x[2 * (size_t)taps[3]];
        out[i] = w[0] * t->spectrum[i] - w[1] * near + w[2] * far;
    }
}

void LB(emit)(const LB_DFT *t, size_t channel, lb_phase phase, real *out)
{
    LB_ASSERT(lb_sound(t) && channel < t->channels);
    LB_ASSERT(!t->queued); /* the sums contain every sample */
    if (t->hop) {
        LB(hop_row)(t, channel, phase, out);
        return;
    }
    if (t->variant == LB_MODULATED) {
        LB(row)(t, channel, phase, out);
        return;
    }
    if (lb_is_windowed(t->variant)) {
        LB(row)(t, channel, LB_PHASE_WINDOW, t->spectrum);
        apply_taps(t, out);
    } else {
        LB(row)(t, channel, LB_PHASE_FIXED, out); /* their sums already have the window's phase */
    }
    if (phase == LB_PHASE_FIXED) {
        turn_back(t, out);
    }
}

lb_status LB(read)(LB_DFT *t, lb_phase phase, real *out)
{
    if (!t || !out) {
        return LB_ERROR_NULL;
    }
    if (phase != LB_PHASE_WINDOW && phase != LB_PHASE_FIXED) {
        return LB_ERROR_PHASE;
    }
    LB_ASSERT(lb_sound(t));
    LB(catch_up)(t);
    for (size_t c = 0; c < t->channels; ++c) {
        LB(emit)(t, c, phase, out + c * 2 * t->bin_count);
    }
    return LB_OK;
}

lb_status LB(count)(const LB_DFT *t, uint64_t *count)
{
    if (!t || !count) {
        return LB_ERROR_NULL;
    }
    LB_ASSERT(lb_sound(t));
    *count = t->count + t->queued;
    return LB_OK;
}

lb_status LB(instruction_set)(const LB_DFT *t, lb_instruction_set *set)
{
    if (!t || !set) {
        return LB_ERROR_NULL;
    }
    *set = t->set;
    return LB_OK;
}
