/* Update of the sums by one sample, bin after bin, for machines without vectors. Private; the bits are those of the
 * tiles, and tile.h explains S, F and the images. */
#ifndef LB_ONE_H
#define LB_ONE_H

#include "state.h"

/* Often: inlined with constants of the compile time. Rarely: not inlined, so that it uses no registers of the step. */
#if defined(__GNUC__) || defined(__clang__)
#define LB_OFTEN static inline __attribute__((always_inline))
#define LB_RARELY __attribute__((noinline)) static
#else
#define LB_OFTEN static inline
#define LB_RARELY static
#endif

/* A table row's cos and sin for one bin, and that bin's sums. */
LB_OFTEN void out_one(real *a, real c, real s, real d)
{
    a[0] += c * d;
    a[1] -= s * d;
}

/* The sample into the delay line; returns its difference to the one a window before. */
LB_OFTEN real taken_in(real *line, real x)
{
    const real delta = x - *line;
    *line = x;
    return delta;
}

/* The twiddles of one table row, bin by bin. */
typedef struct {
    const real *at;
    const uint32_t *bin;
    uint32_t number;
} twiddles;

LB_OFTEN twiddles first_of(const LB_DFT *t, uint32_t number, int compact)
{
    const twiddles w = {compact ? t->table : lb_table_row(t, number), t->bins, number};
    return w;
}

/* cos, sin of the next bin. */
LB_OFTEN const real *next_of(twiddles *w, const real *table, uint32_t window, int compact)
{
    LB_ASSERT(!compact || *w->bin < window);
    if (compact) {
        return table + 2u * (*w->bin++ * w->number % window);
    }
    w->at += 2;
    return w->at - 2;
}

/* First half of a period. Two channels at a time share the loaded part of the row. */
LB_OFTEN void go_out(const LB_DFT *t, const real *samples, ptrdiff_t stride, int compact)
{
    LB_ASSERT(t->index < t->half && (t->compact || !compact));
    const twiddles row = first_of(t, t->index, compact);
    const uint32_t N = t->window;
    const real *table = t->table;
    const size_t own = 4u * t->blocks;
    real *line = t->line + t->index, *sums = t->sums;
    uint32_t left = t->channels;
    for (; left >= 2u; left -= 2u, line += t->line_length, sums += own, samples += stride) {
        const real x = taken_in(line, *samples);
        line += t->line_length;
        samples += stride;
        const real y = taken_in(line, *samples);
        twiddles w = row;
        for (real *end = sums + own, *other = end; sums != end; sums += 4, other += 4) {
            const real *turn = next_of(&w, table, N, compact), c = turn[0], s = turn[1];
            out_one(sums, c, s, x);
            out_one(other, c, s, y);
        }
    }
    if (left) {
        const real x = taken_in(line, *samples);
        twiddles w = row;
        for (const real *end = sums + own; sums != end; sums += 4) {
            const real *turn = next_of(&w, table, N, compact), c = turn[0], s = turn[1];
            out_one(sums, c, s, x);
        }
    }
}

/* Second half: with the images of the first. Where it begins, F begins with x_0, which has no image. */
typedef struct {
    real x, even, odd, first;
} brought;

LB_OFTEN brought brought_back(real *line, ptrdiff_t image, real x, const real *first)
{
    brought b;
    b.even = image ? x + line[image] : x; /* its own image is added once */
    b.odd = image ? x - line[image] : x;
    b.first = *first;
    b.x = taken_in(line, x);
    return b;
}

LB_OFTEN void back_one(real *a, real c, real s, brought b, int begins)
{
    const real re = begins ? b.first : a[2], im = begins ? 0 : a[3];
    a[0] += c * b.x;
    a[1] += s * b.x;
    a[2] = re + c * b.even;
    a[3] = im + s * b.odd;
}

LB_OFTEN void go_back(const LB_DFT *t, const real *samples, ptrdiff_t stride, int compact, int begins)
{
    const uint32_t opposite = t->window - t->index, N = t->window;
    const twiddles row = first_of(t, opposite, compact);
    const real *table = t->table;
    const size_t own = 4u * t->blocks;
    LB_ASSERT(begins ? t->index == t->half : t->index > t->half && (t->compact || !compact));
    LB_ASSERT(opposite >= 1u && opposite <= t->index);
    const ptrdiff_t image = (ptrdiff_t)opposite - (ptrdiff_t)t->index;
    real *line = t->line + t->index, *sums = t->sums;
    uint32_t left = t->channels;
    for (; left >= 2u; left -= 2u, line += t->line_length, sums += own, samples += stride) {
        const brought x = brought_back(line, image, *samples, line - t->index);
        line += t->line_length;
        samples += stride;
        const brought y = brought_back(line, image, *samples, line - t->index);
        twiddles w = row;
        for (real *end = sums + own, *other = end; sums != end; sums += 4, other += 4) {
            const real *turn = next_of(&w, table, N, compact), c = turn[0], s = turn[1];
            back_one(sums, c, s, x, begins);
            back_one(other, c, s, y, begins);
        }
    }
    if (left) {
        const brought x = brought_back(line, image, *samples, line - t->index);
        twiddles w = row;
        for (const real *end = sums + own; sums != end; sums += 4) {
            const real *turn = next_of(&w, table, N, compact), c = turn[0], s = turn[1];
            back_one(sums, c, s, x, begins);
        }
    }
}

#endif
