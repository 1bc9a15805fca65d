/* Blocks of samples in, rows out. */
#include "state.h"

lb_status LB(rows)(const LB_DFT *t, size_t length, size_t hop, size_t *rows)
{
    if (!t || !rows) {
        return LB_ERROR_NULL;
    }
    LB_ASSERT(lb_sound(t));
    if (t->hop && hop % t->hop) {
        return LB_ERROR_HOP;
    }
    *rows = hop ? (size_t)(((t->count + t->queued) % hop + length) / hop) : 0;
    return LB_OK;
}

/* Rows read one by one. */
static void read_rows(LB_DFT *t, lb_input *in, size_t length, lb_rows_due due)
{
    LB_ASSERT(!t->queued && due.hop);
    while (due.first < length) {
        LB(skip)(t, in, due.first + 1);
        length -= due.first + 1;
        due.first = due.hop - 1;
        for (size_t c = 0; c < t->channels; ++c) {
            LB(emit)(t, c, due.phase, due.out + c * due.channel_reals);
        }
        due.out += 2 * t->bin_count;
        LB_ASSERT(due.out <= due.end);
    }
    LB_ASSERT(due.out == due.end);
    LB(skip)(t, in, length);
}

lb_status LB(process)(LB_DFT *t, const real *samples, ptrdiff_t channel_stride, ptrdiff_t sample_stride, size_t length,
                      size_t hop, lb_phase phase, real *out, size_t rows)
{
    size_t expected;
    const lb_status status = LB(rows)(t, length, hop, &expected);
    if (status != LB_OK) {
        return status;
    }
    if ((!samples && length) || (!out && rows)) {
        return LB_ERROR_NULL;
    }
    if (phase != LB_PHASE_WINDOW && phase != LB_PHASE_FIXED) {
        return LB_ERROR_PHASE;
    }
    if (rows != expected) {
        return LB_ERROR_ROWS;
    }
    lb_input in = {samples, channel_stride, sample_stride};
    LB_ASSERT(lb_sound(t));
    LB(catch_up)(t);
    if (!rows) {
        LB(skip)(t, &in, length);
        return LB_OK;
    }
    lb_rows_due due;
    due.first = hop - 1 - (size_t)(t->count % hop);
    due.hop = hop;
    due.phase = phase;
    due.out = out;
    due.channel_reals = rows * 2 * t->bin_count;
    due.end = out + due.channel_reals;
    LB_ASSERT(due.first < length);
    LB_ASSERT(lb_apart((void *)lb_region_of(t, &in, length).first, lb_region_of(t, &in, length).bytes, out,
                       t->channels * due.channel_reals * sizeof(real)));
#ifndef LB_SCALAR
    if (t->hop) {
        LB(hop_samples)(t, &in, length, due);
        return LB_OK;
    }
    if (t->variant == LB_MODULATED) {
        LB(fused_rows)(t, &in, length, due);
        return LB_OK;
    }
#endif
    read_rows(t, &in, length, due);
    return LB_OK;
}
