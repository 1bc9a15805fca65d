/* push, queue and rows one sample after the other: for machines without vectors. */
#include "one.h"
#ifdef LB_SCALAR

/* One body for each direction, so that the loop contains no branch on it. */
LB_RARELY void out_by_rows(const LB_DFT *t, const real *x, ptrdiff_t stride) { go_out(t, x, stride, 0); }
LB_RARELY void out_compact(const LB_DFT *t, const real *x, ptrdiff_t stride) { go_out(t, x, stride, 1); }
LB_RARELY void back_by_rows(const LB_DFT *t, const real *x, ptrdiff_t stride) { go_back(t, x, stride, 0, 0); }
LB_RARELY void back_compact(const LB_DFT *t, const real *x, ptrdiff_t stride) { go_back(t, x, stride, 1, 0); }
LB_RARELY void begin(const LB_DFT *t, const real *x, ptrdiff_t stride) { go_back(t, x, stride, 0, 1); }

/* The last sample of a period: S = F. */
LB_RARELY void last(const LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    const real *row = lb_table_row(t, 1u), *end = row + t->row_length;
    real *line = t->line, *sums = t->sums;
    LB_ASSERT(t->window > 3u && t->index == t->window - 1u);
    LB_ASSERT(t->row_length == 2u * t->inner_count);
    for (uint32_t c = 0; c < t->channels; ++c, line += t->line_length, samples += stride) {
        const real even = *samples + line[1], odd = *samples - line[1];
        line[t->index] = *samples;
        for (const real *r = row; r != end;) {
            const turn now = take_turn(&r);
            sums = end_one(sums, now, even, odd);
        }
    }
}

/* Windows of up to three samples, where a sample may be the first of the second half and the last. */
LB_RARELY void tiny(const LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    LB_ASSERT(t->window <= 3u && lb_renews(t->variant));
    if (t->window == 1u) {
        for (uint32_t c = 0; c < t->channels; ++c, samples += stride) {
            t->sums[4u * c + 2u] = t->line[c * t->line_length] = *samples;
            t->sums[4u * c + 3u] = 0;
        }
    } else if (t->index < t->half) {
        out_by_rows(t, samples, stride);
        return;
    } else {
        begin(t, samples, stride);
    }
    for (real *a = t->sums, *end = a + 4u * t->blocks * t->channels; a != end; a += 4) {
        a[0] = a[2];
        a[1] = a[3];
    }
}

/* The variants for comparison that never renew their sums. */
LB_RARELY void unrenewed(const LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    real *line = t->line + t->index;
    for (uint32_t c = 0; c < t->channels; ++c, line += t->line_length, samples += stride) {
        const real delta = *samples - t->radius_window * *line;
        *line = *samples;
        LB(recur)(t, c, &delta, 1);
    }
}

static void step(LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    LB_ASSERT(lb_sound(t));
    if (t->hop) {
        LB(hop_step)(t, samples, stride);
        return;
    }
    const uint32_t index = t->index, next = index + 1u < t->window ? index + 1u : 0u;
    if (!lb_renews(t->variant)) {
        unrenewed(t, samples, stride);
    } else if (t->window <= 3u) {
        tiny(t, samples, stride);
    } else if (index < t->half) {
        (t->compact ? out_compact : out_by_rows)(t, samples, stride);
    } else if (index == t->half) {
        begin(t, samples, stride);
    } else if (next) {
        (t->compact ? back_compact : back_by_rows)(t, samples, stride);
    } else {
        last(t, samples, stride);
    }
    ++t->count;
    t->index = next;
}

lb_status LB(push)(LB_DFT *t, const real *samples)
{
    if (!t || !samples) {
        return LB_ERROR_NULL;
    }
    step(t, samples, 1);
    return LB_OK;
}

/* A delay has no advantage here, so no sample waits. */
lb_status LB(queue)(LB_DFT *t, const real *samples) { return LB(push)(t, samples); }

void LB(catch_up)(LB_DFT *t) { (void)t; }

lb_status LB(choose)(LB_DFT *t, lb_instruction_set set)
{
    t->set = LB_BASELINE;
    t->kernel = 0;
    t->run_hops = 0;
    return set == LB_BEST || set == LB_BASELINE ? LB_OK : LB_ERROR_INSTRUCTION_SET;
}

void LB(skip)(LB_DFT *t, lb_input *in, size_t length)
{
    for (; length; --length, in->samples += in->sample_stride) {
        step(t, in->samples, in->channel_stride);
    }
}

void LB(row)(const LB_DFT *t, size_t channel, lb_phase phase, real *out)
{
    LB_ASSERT(lb_sound(t) && !t->queued);
    const real *sums = lb_sums(t, channel), *end = out + 2u * (size_t)t->inner_count;
    if (phase == LB_PHASE_FIXED) {
        for (; out != end; out += 2, sums += 4) {
            out[0] = sums[0];
            out[1] = sums[1];
        }
        return;
    }
    int backwards;
    const real *row = lb_next_row(t, &backwards);
    for (; out != end; out += 2, sums += 4, row += 2) {
        const real re = sums[0], im = sums[1], c = row[0], s = row[1];
        out[0] = backwards ? re * c + im * s : re * c - im * s;
        out[1] = backwards ? im * c - re * s : im * c + re * s;
    }
}

#endif
