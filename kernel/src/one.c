/* One sample after the other, one bin after the other: the step of a machine without vectors. The bits are those of
 * the tiles; tile.h explains S, F and the images. */
#include "state.h"
#ifdef LB_SCALAR

/* What one sample brings to one channel. */
typedef struct {
    real *sums;
    real delta, even, odd;
} brought;

/* A table row's cos and sin for one bin, and that bin's sums. */
static inline void out_one(real *a, real c, real s, real d)
{
    a[0] += c * d;
    a[1] -= s * d;
}

static inline void renew_one(real *a, real c, real s, real even, real odd)
{
    a[2] += c * even;
    a[3] += s * odd;
}

static inline void back_one(real *a, real c, real s, real d, real even, real odd)
{
    a[0] += c * d;
    a[1] += s * d;
    renew_one(a, c, s, even, odd);
}

/* All bins of two channels, which share what is loaded of the row; or of one. First half: */
static void out_two(const real *row, const real *end, brought x, brought y)
{
    for (; row != end; row += 2, x.sums += 4, y.sums += 4) {
        const real c = row[0], s = row[1];
        out_one(x.sums, c, s, x.delta);
        out_one(y.sums, c, s, y.delta);
    }
}

static void out(const real *row, const real *end, brought x)
{
    for (; row != end; row += 2, x.sums += 4) {
        out_one(x.sums, row[0], row[1], x.delta);
    }
}

/* Second half: */
static void back_two(const real *row, const real *end, brought x, brought y)
{
    for (; row != end; row += 2, x.sums += 4, y.sums += 4) {
        const real c = row[0], s = row[1];
        back_one(x.sums, c, s, x.delta, x.even, x.odd);
        back_one(y.sums, c, s, y.delta, y.even, y.odd);
    }
}

static void back(const real *row, const real *end, brought x)
{
    for (; row != end; row += 2, x.sums += 4) {
        back_one(x.sums, row[0], row[1], x.delta, x.even, x.odd);
    }
}

/* The first sample of the second half: F begins with x_0, which has no image. */
static void begin(const real *row, const real *end, brought x, real first)
{
    for (; row != end; row += 2, x.sums += 4) {
        x.sums[2] = first;
        x.sums[3] = 0;
        back_one(x.sums, row[0], row[1], x.delta, x.even, x.odd);
    }
}

/* The last sample of a period: S = F. */
static void renew(const real *row, const real *end, brought x)
{
    for (; row != end; row += 2, x.sums += 4) {
        renew_one(x.sums, row[0], row[1], x.even, x.odd);
    }
}

static void swap(real *sums, const real *end)
{
    for (; sums != end; sums += 4) {
        sums[0] = sums[2];
        sums[1] = sums[3];
    }
}

static inline brought take_in(const LB_DFT *t, size_t channel, real x)
{
    const uint32_t index = t->index;
    real *line = t->line + channel * t->line_length;
    const real image = line[index ? t->window - index : 0u];
    brought b;
    b.sums = lb_sums(t, channel);
    b.delta = x - t->radius_window * line[index]; /* times 1, but for LB_DAMPED */
    b.even = x + image;
    b.odd = x - image;
    if (2u * index == t->window) { /* its own image: it counts once */
        b.even = b.odd = x;
    }
    line[index] = x;
    return b;
}

/* One channel's sample where a half of the period begins or ends. */
static void turn(const LB_DFT *t, const real *row, const real *end, size_t channel, brought x)
{
    const int begins = t->index == t->half, ends = t->index + 1u == t->window;
    if (begins) {
        begin(row, end, x, t->line[channel * t->line_length]);
    } else if (ends) {
        renew(row, end, x);
    }
    if (ends) {
        swap(x.sums, x.sums + 4u * t->blocks);
    }
}

static void renewed(const LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    int backwards;
    const real *row = lb_row(t, t->index, &backwards), *end = row + t->row_length;
    const int turns = t->index == t->half || t->index + 1u == t->window;
    uint32_t c = 0;
    for (; !turns && c + 2u <= t->channels; c += 2u, samples += 2 * stride) {
        const brought x = take_in(t, c, samples[0]), y = take_in(t, c + 1u, samples[stride]);
        if (backwards) {
            back_two(row, end, x, y);
        } else {
            out_two(row, end, x, y);
        }
    }
    for (; c < t->channels; ++c, samples += stride) {
        const brought x = take_in(t, c, *samples);
        if (turns) {
            turn(t, row, end, c, x);
        } else if (backwards) {
            back(row, end, x);
        } else {
            out(row, end, x);
        }
    }
}

/* A window of one sample: S = F = x_0. */
static void hold(const LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    for (uint32_t c = 0; c < t->channels; ++c, samples += stride) {
        real *sums = lb_sums(t, c);
        t->line[c * t->line_length] = *samples;
        sums[0] = sums[2] = *samples;
        sums[1] = sums[3] = 0;
    }
}

static void step(LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    if (!lb_renews(t->variant)) {
        for (uint32_t c = 0; c < t->channels; ++c, samples += stride) {
            const brought x = take_in(t, c, *samples);
            LB(recur)(t, c, &x.delta, 1);
        }
    } else if (t->window > 1u) {
        renewed(t, samples, stride);
    } else {
        hold(t, samples, stride);
    }
    ++t->count;
    t->index = t->index + 1u < t->window ? t->index + 1u : 0u;
}

lb_status LB(push)(LB_DFT *t, const real *samples)
{
    if (!t || !samples) {
        return LB_ERROR_NULL;
    }
    step(t, samples, 1);
    return LB_OK;
}

/* Nothing is cheaper later: here nothing ever waits. */
lb_status LB(queue)(LB_DFT *t, const real *samples) { return LB(push)(t, samples); }

void LB(catch_up)(LB_DFT *t) { (void)t; }

lb_status LB(choose)(LB_DFT *t, lb_instruction_set set)
{
    t->set = LB_BASELINE;
    t->kernel = 0;
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
