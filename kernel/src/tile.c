/* Compiled once per number type and instruction set, always with -ffp-contract=off: products are rounded before
 * they are added, on every machine, so every object makes the same bits. */
#include "tile.h"
#include "vec.h"

#ifndef LB_TILE_NAME
#define LB_TILE_NAME LB(tile_baseline)
#endif

#define LB_UNIT (LB_LANES * LB_ABREAST) /* bins worked on at once */
#define LB_UNITS (LB_BLOCK / LB_UNIT)   /* per block */

typedef struct {
    vec s_re[LB_ABREAST], s_im[LB_ABREAST], f_re[LB_ABREAST], f_im[LB_ABREAST];
} unit_sums;

typedef struct {
    vec cosine[LB_ABREAST], sine[LB_ABREAST];
} unit_row;

LB_INLINE unit_sums load_sums(const real *p)
{
    unit_sums a;
    for (int v = 0; v < LB_ABREAST; ++v) {
        a.s_re[v] = lb_load(p + v * LB_LANES);
        a.s_im[v] = lb_load(p + v * LB_LANES + LB_BLOCK);
        a.f_re[v] = lb_load(p + v * LB_LANES + 2 * LB_BLOCK);
        a.f_im[v] = lb_load(p + v * LB_LANES + 3 * LB_BLOCK);
    }
    return a;
}

LB_INLINE void store_sums(real *p, unit_sums a)
{
    for (int v = 0; v < LB_ABREAST; ++v) {
        lb_store(p + v * LB_LANES, a.s_re[v]);
        lb_store(p + v * LB_LANES + LB_BLOCK, a.s_im[v]);
        lb_store(p + v * LB_LANES + 2 * LB_BLOCK, a.f_re[v]);
        lb_store(p + v * LB_LANES + 3 * LB_BLOCK, a.f_im[v]);
    }
}

LB_INLINE unit_row load_row(const real *p)
{
    unit_row t;
    for (int v = 0; v < LB_ABREAST; ++v) {
        t.cosine[v] = lb_load(p + v * LB_LANES);
        t.sine[v] = lb_load(p + v * LB_LANES + LB_BLOCK);
    }
    return t;
}

/* S += d·e^(−jθ), F += x·e^(−jθ); on the way back the table holds e^(+jθ). */
LB_INLINE unit_sums step(unit_sums a, unit_row t, real d, real x, int backwards)
{
    for (int v = 0; v < LB_ABREAST; ++v) {
        a.s_re[v] += t.cosine[v] * d;
        a.f_re[v] += t.cosine[v] * x;
        if (backwards) {
            a.s_im[v] += t.sine[v] * d;
            a.f_im[v] += t.sine[v] * x;
        } else {
            a.s_im[v] -= t.sine[v] * d;
            a.f_im[v] -= t.sine[v] * x;
        }
    }
    return a;
}

LB_INLINE unit_sums swap_sums(unit_sums a)
{
    for (int v = 0; v < LB_ABREAST; ++v) {
        a.s_re[v] = a.f_re[v];
        a.s_im[v] = a.f_im[v];
        a.f_re[v] = a.f_im[v] = (vec){0};
    }
    return a;
}

/* One row of this unit's bins: S itself, or S·e^(+jθ) with θ of the next sample (the window's oldest). */
LB_INLINE void emit(real *out, unit_sums a, unit_row next, lb_phase phase, int backwards)
{
    for (int v = 0; v < LB_ABREAST; ++v) {
        const vec re = a.s_re[v], im = a.s_im[v], c = next.cosine[v], s = next.sine[v];
        if (phase == LB_PHASE_FIXED) {
            lb_store_pairs(out + v * LB_LANES, re, im);
        } else if (backwards) {
            lb_store_pairs(out + v * LB_LANES, re * c + im * s, im * c - re * s);
        } else {
            lb_store_pairs(out + v * LB_LANES, re * c - im * s, im * c + re * s);
        }
    }
}

/* Where a unit's work lies. */
typedef struct {
    real *sums;
    const real *row;
    real *out;     /* the block's place in the first row due */
    size_t offset; /* of the unit in its block, in reals */
    size_t valid;  /* reals of the block's rows that exist: 2·LB_BLOCK but in the last block */
} unit;

/* A row of the last block. What it writes too much, the next rows overwrite; where there are none, or where
 * another unit has written them already, only what exists is changed. */
LB_INLINE void emit_tail(const lb_tile *t, unit u, unit_sums a, unit_row next, lb_phase phase, int backwards)
{
    if (LB_UNITS == 1 && t->out_end - u.out >= 2 * LB_BLOCK) {
        emit(u.out, a, next, phase, backwards);
        return;
    }
    real whole[2 * LB_BLOCK];
    for (size_t i = 0; i < u.valid; ++i) {
        whole[i] = u.out[i];
    }
    emit(whole + u.offset, a, next, phase, backwards);
    for (size_t i = 0; i < u.valid; ++i) {
        u.out[i] = whole[i];
    }
}

LB_INLINE unit emit_row(const lb_tile *t, unit u, unit_sums a, unit_row next, lb_phase phase, int backwards,
                        int tail)
{
    if (tail) {
        emit_tail(t, u, a, next, phase, backwards);
    } else {
        emit(u.out + u.offset, a, next, phase, backwards);
    }
    u.out += 2 * t->bins;
    return u;
}

/* A row after every sample. The next sample's table row demodulates this one's, so each is loaded once. */
LB_INLINE void run_dense(const lb_tile *t, unit u, lb_phase phase, int backwards, int tail)
{
    const size_t before_swap = t->length - (size_t)t->swap;
    unit_sums a = load_sums(u.sums);
    unit_row row = load_row(u.row), next;
    size_t i = 0;
    for (; i < before_swap; ++i, row = next) {
        u.row += t->row_step;
        next = load_row(u.row);
        a = step(a, row, t->delta[i], t->samples[i], backwards);
        u = emit_row(t, u, a, next, phase, backwards, tail);
    }
    if (t->swap) {
        a = swap_sums(step(a, row, t->delta[i], t->samples[i], backwards));
        (void)emit_row(t, u, a, load_row(u.row + t->row_step), phase, backwards, tail);
    }
    store_sums(u.sums, a);
}

/* A row after every hop-th sample, or none. */
LB_INLINE void run_sparse(const lb_tile *t, unit u, lb_phase phase, int backwards, int tail)
{
    const size_t before_swap = t->length - (size_t)t->swap;
    unit_sums a = load_sums(u.sums);
    size_t due = t->first, i = 0;
    for (;;) {
        const size_t stop = due < before_swap ? due + 1 : before_swap;
        LB_UNROLL_4
        for (; i < stop; ++i, u.row += t->row_step) {
            a = step(a, load_row(u.row), t->delta[i], t->samples[i], backwards);
        }
        if (due >= before_swap) {
            break;
        }
        u = emit_row(t, u, a, load_row(u.row), phase, backwards, tail);
        due += t->hop;
    }
    if (t->swap) {
        a = swap_sums(step(a, load_row(u.row), t->delta[i], t->samples[i], backwards));
        if (due == i) {
            (void)emit_row(t, u, a, load_row(u.row + t->row_step), phase, backwards, tail);
        }
    }
    store_sums(u.sums, a);
}

LB_INLINE void run_block(const lb_tile *t, size_t block, int backwards, int tail)
{
    for (size_t i = 0; i < LB_UNITS; ++i) {
        unit u;
        u.offset = i * LB_UNIT;
        u.sums = t->sums + block * 4 * LB_BLOCK + u.offset;
        u.row = t->row + block * 2 * LB_BLOCK + u.offset;
        u.out = t->out ? t->out + block * 2 * LB_BLOCK : t->out;
        u.valid = tail ? 2 * (t->bins - block * LB_BLOCK) : 2 * LB_BLOCK;
        if (t->hop != 1) {
            run_sparse(t, u, t->phase, backwards, tail);
        } else if (t->phase == LB_PHASE_FIXED) {
            run_dense(t, u, LB_PHASE_FIXED, backwards, tail);
        } else {
            run_dense(t, u, LB_PHASE_WINDOW, backwards, tail);
        }
    }
}

LB_INLINE void run(const lb_tile *t, int backwards)
{
    /* The last block first: what it writes too much belongs to the others. */
    const size_t whole = t->bins / LB_BLOCK;
    if (whole < t->blocks) {
        run_block(t, whole, backwards, 1);
    }
    for (size_t block = 0; block < whole; ++block) {
        run_block(t, block, backwards, 0);
    }
}

void LB_TILE_NAME(const lb_tile *t)
{
    if (t->backwards) {
        run(t, 1);
    } else {
        run(t, 0);
    }
}
