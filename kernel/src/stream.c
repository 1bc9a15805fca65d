/* push, queue, process: samples in, rows out. */
#include "state.h"

static size_t smaller(size_t a, size_t b) { return a < b ? a : b; }

/* Samples that may still become pending: up to a tile, within one half of the period. */
static size_t room(const LB_DFT *t)
{
    const uint32_t end = t->index - t->pending < t->half ? t->half : t->window;
    return smaller(LB_TILE - t->pending, end - t->index);
}

/* Sets the differences and the delay line of one channel's next samples. */
static void take_in(LB_DFT *t, size_t channel, const real *samples, ptrdiff_t stride, size_t length)
{
    real *line = t->line + channel * t->line_length + t->index;
    real *delta = t->delta + channel * LB_TILE + t->pending;
    for (size_t i = 0; i < length; ++i, samples += stride) {
        const real x = *samples;
        delta[i] = x - t->radius_window * line[i];
        line[i] = x;
    }
}

static void counted(LB_DFT *t, size_t length)
{
    t->count += length;
    t->pending += (uint32_t)length;
    t->index += (uint32_t)length;
}

/* Rows that a tile is to make. */
typedef struct {
    size_t first, hop;
    lb_phase phase;
    real *out;            /* next row of channel 0 */
    size_t channel_reals; /* from channel to channel */
    const real *end;      /* of channel 0's rows */
} rows_due;

/* The sums of the pending samples, and the rows due among them. */
static void run_tiles(LB_DFT *t, rows_due due)
{
    const uint32_t start = t->index - t->pending;
    lb_tile tile;
    tile.row = lb_row(t, start, &tile.backwards);
    tile.row_step = tile.backwards ? -(ptrdiff_t)t->row_length : (ptrdiff_t)t->row_length;
    tile.blocks = t->blocks;
    tile.length = t->pending;
    tile.swap = t->index == t->window;
    tile.first = due.first;
    tile.hop = due.hop;
    tile.phase = due.phase;
    tile.bins = t->inner_count;
    for (size_t c = 0; c < t->channels; ++c) {
        tile.sums = lb_sums(t, c);
        tile.delta = t->delta + c * LB_TILE;
        tile.samples = t->line + c * t->line_length + start;
        tile.out = due.out ? due.out + c * due.channel_reals : due.out;
        tile.out_end = due.end ? due.end + c * due.channel_reals : due.end;
        t->tile(&tile);
    }
    t->pending = 0;
    t->index = tile.swap ? 0 : t->index;
}

void LB(catch_up)(LB_DFT *t)
{
    if (!t->pending) {
        return;
    }
    if (lb_renews(t->variant)) {
        const rows_due none = {LB_TILE, LB_TILE, LB_PHASE_FIXED, 0, 0, 0};
        run_tiles(t, none);
        return;
    }
    for (size_t c = 0; c < t->channels; ++c) {
        LB(recur)(t, c, t->delta + c * LB_TILE, t->pending);
    }
    t->pending = 0;
    t->index = t->index == t->window ? 0 : t->index;
}

lb_status LB(queue)(LB_DFT *t, const real *samples)
{
    if (!t || !samples) {
        return LB_ERROR_NULL;
    }
    for (size_t c = 0; c < t->channels; ++c) {
        take_in(t, c, samples + c, 1, 1);
    }
    counted(t, 1);
    if (!room(t)) {
        LB(catch_up)(t);
    }
    return LB_OK;
}

lb_status LB(push)(LB_DFT *t, const real *samples)
{
    const lb_status status = LB(queue)(t, samples);
    if (status == LB_OK) {
        LB(catch_up)(t);
    }
    return status;
}

lb_status LB(rows)(const LB_DFT *t, size_t length, size_t hop, size_t *rows)
{
    if (!t || !rows) {
        return LB_ERROR_NULL;
    }
    *rows = hop ? (size_t)((t->count % hop + length) / hop) : 0;
    return LB_OK;
}

/* Where the next samples come from. */
typedef struct {
    const real *samples;
    ptrdiff_t channel_stride, sample_stride;
} input;

/* As many of the samples as make one tile; the sums are left to the caller. */
static size_t next_tile(LB_DFT *t, input *in, size_t length)
{
    const size_t n = smaller(length, room(t));
    for (size_t c = 0; c < t->channels; ++c) {
        take_in(t, c, in->samples + (ptrdiff_t)c * in->channel_stride, in->sample_stride, n);
    }
    counted(t, n);
    in->samples += (ptrdiff_t)n * in->sample_stride;
    return n;
}

static void skip(LB_DFT *t, input *in, size_t length)
{
    while (length) {
        length -= next_tile(t, in, length);
        LB(catch_up)(t);
    }
}

/* Rows written by the inner kernels themselves. */
static void fused_rows(LB_DFT *t, input *in, size_t length, rows_due due)
{
    const size_t hop = due.hop;
    due.hop = smaller(hop, LB_TILE); /* beyond a tile all hops are one; a sum with them cannot overflow */
    while (length) {
        const size_t n = next_tile(t, in, length);
        length -= n;
        const size_t first = due.first;
        due.first = smaller(first, LB_TILE);
        run_tiles(t, due);
        due.first = first;
        if (due.first >= n) {
            due.first -= n;
            continue;
        }
        const size_t rows = hop == 1 ? n : 1 + (n - 1 - due.first) / hop;
        due.out += rows * 2 * t->bin_count;
        due.first += rows * hop - n;
    }
}

/* Rows read one by one: for the variants to compare with. */
static void read_rows(LB_DFT *t, input *in, size_t length, rows_due due)
{
    while (due.first < length) {
        skip(t, in, due.first + 1);
        length -= due.first + 1;
        due.first = due.hop - 1;
        for (size_t c = 0; c < t->channels; ++c) {
            LB(emit)(t, c, due.phase, due.out + c * due.channel_reals);
        }
        due.out += 2 * t->bin_count;
    }
    skip(t, in, length);
}

lb_status LB(process)(LB_DFT *t, const real *samples, ptrdiff_t channel_stride, ptrdiff_t sample_stride,
                      size_t length, size_t hop, lb_phase phase, real *out, size_t rows)
{
    size_t expected;
    const lb_status status = LB(rows)(t, length, hop, &expected);
    if (status != LB_OK || (!samples && length) || (!out && rows)) {
        return LB_ERROR_NULL;
    }
    if (phase != LB_PHASE_WINDOW && phase != LB_PHASE_FIXED) {
        return LB_ERROR_PHASE;
    }
    if (rows != expected) {
        return LB_ERROR_ROWS;
    }
    input in = {samples, channel_stride, sample_stride};
    LB(catch_up)(t);
    if (!rows) {
        skip(t, &in, length);
        return LB_OK;
    }
    rows_due due;
    due.first = hop - 1 - (size_t)(t->count % hop);
    due.hop = hop;
    due.phase = phase;
    due.out = out;
    due.channel_reals = rows * 2 * t->bin_count;
    due.end = out + due.channel_reals;
    if (t->variant == LB_MODULATED) {
        fused_rows(t, &in, length, due);
    } else {
        read_rows(t, &in, length, due);
    }
    return LB_OK;
}
