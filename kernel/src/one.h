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

/* A table row's cos and sin for one bin. */
typedef struct {
    real c, s;
} turn;

/* A Cortex-M4F loads and stores consecutive numbers by one instruction, which takes less than two of one number each,
 * but compilers do not form it. The arithmetic remains theirs. */
#if LB_BITS == 32 && defined(__thumb2__) && defined(__ARM_FP) && (defined(__GNUC__) || defined(__clang__))
#define LB_SEVERAL 1
#else
#define LB_SEVERAL 0
#endif

LB_OFTEN turn take_turn(const real **at)
{
#if LB_SEVERAL
    register real c __asm__("s0"), s __asm__("s1");
    __asm__ volatile("vldmia %0!, {s0, s1}" : "+r"(*at), "=t"(c), "=t"(s)::"memory");
    const turn w = {c, s};
#else
    const turn w = {(*at)[0], (*at)[1]};
    *at += 2;
#endif
    return w;
}

/* One bin's sums, in the first half; returns the next bin's. */
LB_OFTEN real *out_one(real *a, turn w, real d)
{
#if LB_SEVERAL
    register real re __asm__("s4"), im __asm__("s5");
    __asm__ volatile("vldmia %2, {s4, s5}" : "=t"(re), "=t"(im) : "r"(a) : "memory");
    re += w.c * d;
    im -= w.s * d;
    __asm__ volatile("vstmia %0, {s4, s5}" ::"r"(a), "t"(re), "t"(im) : "memory");
#else
    a[0] += w.c * d;
    a[1] -= w.s * d;
#endif
    return a + 4;
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
LB_OFTEN turn next_of(twiddles *w, const real *table, uint32_t window, int compact)
{
    LB_ASSERT(!compact || *w->bin < window);
    if (compact) {
        const real *at = table + 2u * (*w->bin++ * w->number % window);
        return take_turn(&at);
    }
    return take_turn(&w->at);
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
        for (real *end = sums + own, *other = end; sums != end;) {
            const turn now = next_of(&w, table, N, compact);
            sums = out_one(sums, now, x);
            other = out_one(other, now, y);
        }
    }
    if (left) {
        const real x = taken_in(line, *samples);
        twiddles w = row;
        for (const real *end = sums + own; sums != end;) {
            sums = out_one(sums, next_of(&w, table, N, compact), x);
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

LB_OFTEN real *back_one(real *a, turn w, brought b, int begins)
{
#if LB_SEVERAL
    register real re __asm__("s4"), im __asm__("s5"), f_re __asm__("s6"), f_im __asm__("s7");
    __asm__ volatile("vldmia %4, {s4-s7}" : "=t"(re), "=t"(im), "=t"(f_re), "=t"(f_im) : "r"(a) : "memory");
    re += w.c * b.x;
    im += w.s * b.x;
    f_re = (begins ? b.first : f_re) + w.c * b.even;
    f_im = (begins ? 0 : f_im) + w.s * b.odd;
    __asm__ volatile("vstmia %0!, {s4-s7}" : "+r"(a) : "t"(re), "t"(im), "t"(f_re), "t"(f_im) : "memory");
    return a;
#else
    const real re = begins ? b.first : a[2], im = begins ? 0 : a[3];
    a[0] += w.c * b.x;
    a[1] += w.s * b.x;
    a[2] = re + w.c * b.even;
    a[3] = im + w.s * b.odd;
    return a + 4;
#endif
}

/* One bin's sums at the last sample: S = F. */
LB_OFTEN real *end_one(real *a, turn w, real even, real odd)
{
#if LB_SEVERAL
    register real re __asm__("s4"), im __asm__("s5"), f_re __asm__("s6"), f_im __asm__("s7");
    __asm__ volatile("vldmia %4, {s4-s7}" : "=t"(re), "=t"(im), "=t"(f_re), "=t"(f_im) : "r"(a) : "memory");
    re = f_re += w.c * even;
    im = f_im += w.s * odd;
    __asm__ volatile("vstmia %0!, {s4-s7}" : "+r"(a) : "t"(re), "t"(im), "t"(f_re), "t"(f_im) : "memory");
    return a;
#else
    a[0] = a[2] += w.c * even;
    a[1] = a[3] += w.s * odd;
    return a + 4;
#endif
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
        for (real *end = sums + own, *other = end; sums != end;) {
            const turn now = next_of(&w, table, N, compact);
            sums = back_one(sums, now, x, begins);
            other = back_one(other, now, y, begins);
        }
    }
    if (left) {
        const brought x = brought_back(line, image, *samples, line - t->index);
        twiddles w = row;
        for (const real *end = sums + own; sums != end;) {
            sums = back_one(sums, next_of(&w, table, N, compact), x, begins);
        }
    }
}

#endif
