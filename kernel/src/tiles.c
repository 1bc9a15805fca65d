/* Samples by the tile: store them, and let the inner kernel of the instruction set update the sums. */
#include "state.h"
#ifndef LB_SCALAR

/* The differences and the delay line of one channel's next samples. */
static void take_in(LB_DFT *t, size_t channel, const real *samples, ptrdiff_t stride, size_t length)
{
    LB_ASSERT(channel < t->channels);
    LB_ASSERT(length <= LB_TILE && t->index + length <= t->window);
    real *line = t->line + channel * t->line_length + t->index;
    real *delta = t->delta + channel * 3 * LB_TILE;
    if (t->variant != LB_DAMPED) {
        t->kernel->take_in(delta, line, samples, stride, length);
        return;
    }
    for (size_t i = 0; i < length; ++i, samples += stride) {
        delta[i] = *samples - t->radius_window * line[i];
        line[i] = *samples;
    }
}

/* F = x_0, the sample without an image. */
static void seed(LB_DFT *t, size_t channel)
{
    real *sums = lb_sums(t, channel);
    const real first = t->line[channel * t->line_length];
    for (size_t block = 0; block < t->blocks; ++block, sums += 4 * LB_BLOCK) {
        for (size_t i = 0; i < LB_BLOCK; ++i) {
            sums[2 * LB_BLOCK + i] = first;
            sums[3 * LB_BLOCK + i] = 0;
        }
    }
}

/* Positions of the table rows of the tile, one for each sample and the next one's after them. */
static void find_rows(const LB_DFT *t, uint32_t start, lb_tile *tile)
{
    LB_ASSERT(start + tile->length <= (start < t->half ? t->half : t->window));
    tile->row = lb_row(t, start, &tile->backwards);
    tile->row_step = tile->backwards ? -(ptrdiff_t)t->row_length : (ptrdiff_t)t->row_length;
    if (!t->compact) {
        return;
    }
    tile->row_step = (ptrdiff_t)t->row_length;
    for (uint32_t i = 1; i <= tile->length; ++i) {
        (void)LB(gathered)(t, tile->backwards ? t->window - start - i : start + i, i);
    }
}

/* The sums of `length` samples from `start` on, which are in one half of the period and whose differences begin at
 * `offset`, and the rows due among them. */
static void run_part(LB_DFT *t, uint32_t start, uint32_t offset, uint32_t length, const lb_rows_due *due)
{
    LB_ASSERT(length && offset + length <= LB_TILE);
    LB_ASSERT(!due->out || (due->hop && due->out <= due->end));
    lb_tile tile;
    tile.channels = t->channels;
    tile.blocks = t->blocks;
    tile.sums = t->sums;
    tile.line = t->line + start;
    tile.image = (ptrdiff_t)t->window - 2 * (ptrdiff_t)start;
    tile.line_step = t->line_length;
    tile.middle = 2 * start == t->window;
    tile.delta = t->delta + offset;
    tile.length = length;
    find_rows(t, start, &tile);
    tile.swap = start + length == t->window;
    tile.first = due->first;
    tile.hop = due->hop;
    tile.phase = due->phase;
    tile.bins = t->inner_count;
    tile.out = due->out;
    tile.out_end = due->end;
    tile.out_step = due->channel_reals;
    for (size_t c = 0; c < t->channels && (start == t->half || t->window == 1); ++c) {
        seed(t, c);
    }
    t->kernel->run(&tile);
}

/* Moves on to the rows due after `length` further samples. */
static void passed(lb_rows_due *due, size_t length, size_t row_reals)
{
    LB_ASSERT(length && due->hop);
    if (due->first >= length) {
        due->first -= length;
        return;
    }
    const uint32_t beyond = (uint32_t)(length - 1 - due->first); /* < LB_TILE */
    const uint32_t rows = due->hop > beyond ? 1u : 1u + beyond / (uint32_t)due->hop;
    due->out += rows * row_reals;
    due->first += rows * due->hop - length;
    LB_ASSERT(due->out <= due->end && due->first < due->hop);
}

/* The sums of the last `length` stored samples, which end at the index. */
static void run(LB_DFT *t, uint32_t length, lb_rows_due *due)
{
    LB_ASSERT(length <= t->index && t->index <= t->window);
    uint32_t start = t->index - length;
    if (!lb_renews(t->variant)) {
        for (size_t c = 0; c < t->channels; ++c) {
            LB(recur)(t, c, t->delta + c * 3 * LB_TILE, length);
        }
        start = t->index;
    }
    for (uint32_t offset = 0; start < t->index;) {
        const uint32_t end = start < t->half ? t->half : t->window;
        const uint32_t part = (t->index < end ? t->index : end) - start;
        run_part(t, start, offset, part, due);
        if (due->out) {
            passed(due, part, 2 * (size_t)t->bin_count);
        }
        start += part;
        offset += part;
    }
    LB_ASSERT(start == t->index);
    t->index = t->index == t->window ? 0 : t->index;
}

/* Stores the samples of one tile within the period, at most `length`; returns their number. */
static size_t next_tile(LB_DFT *t, lb_input *in, size_t length, lb_rows_due *due)
{
    const size_t n = lb_smaller(length, lb_smaller(LB_TILE, t->window - t->index));
    LB_ASSERT(n && n <= length);
    for (size_t c = 0; c < t->channels; ++c) {
        take_in(t, c, in->samples + (ptrdiff_t)c * in->channel_stride, in->sample_stride, n);
    }
    in->samples += (ptrdiff_t)n * in->sample_stride;
    t->count += n;
    t->index += (uint32_t)n;
    run(t, (uint32_t)n, due);
    LB_ASSERT(lb_laid_out(t) && t->index == t->count % t->window);
    return n;
}

/* Without rows. */
void LB(skip)(LB_DFT *t, lb_input *in, size_t length)
{
    const lb_rows_due nothing = {SIZE_MAX, SIZE_MAX, LB_PHASE_FIXED, 0, 0, 0};
    if (t->hop) {
        LB(hop_samples)(t, in, length, nothing);
        return;
    }
    lb_rows_due none = nothing;
    while (length) {
        length -= next_tile(t, in, length, &none);
    }
}

void LB(catch_up)(LB_DFT *t)
{
    if (t->queued) {
        lb_input in = {t->queue, LB_TILE, 1};
        LB(skip)(t, &in, t->queued);
        t->queued = 0;
    }
}

lb_status LB(queue)(LB_DFT *t, const real *samples)
{
    if (!t || !samples) {
        return LB_ERROR_NULL;
    }
    if (t->hop) { /* they wait for the end of the hop */
        return LB(push)(t, samples);
    }
    LB_ASSERT(lb_sound(t));
    for (size_t c = 0; c < t->channels; ++c) {
        t->queue[c * LB_TILE + t->queued] = samples[c];
    }
    if (++t->queued == LB_TILE) {
        LB(catch_up)(t);
    }
    return LB_OK;
}

lb_status LB(push)(LB_DFT *t, const real *samples)
{
    if (!t || !samples) {
        return LB_ERROR_NULL;
    }
    LB_ASSERT(lb_sound(t));
    LB(catch_up)(t);
    lb_input in = {samples, 1, 1};
    LB(skip)(t, &in, 1);
    return LB_OK;
}

/* Rows written by the inner kernels themselves. */
void LB(fused_rows)(LB_DFT *t, lb_input *in, size_t length, lb_rows_due due)
{
    while (length) {
        length -= next_tile(t, in, length, &due);
    }
    LB_ASSERT(due.out == due.end);
}

/* The same computation as the inner kernels' rows, and so the same bits. */
void LB(row)(const LB_DFT *t, size_t channel, lb_phase phase, real *out)
{
    lb_tile tile;
    tile.sums = lb_sums(t, channel);
    tile.row = lb_next_row(t, &tile.backwards);
    tile.blocks = t->blocks;
    tile.phase = phase;
    tile.bins = t->inner_count;
    tile.out = out;
    tile.out_end = out + 2 * (size_t)t->inner_count;
    t->kernel->read(&tile);
}

#endif
