/* Compiled once per number type and instruction set, always with -ffp-contract=off: products are rounded before
 * they are added, on every machine, so every object gives the same bits. */
#include "tile.h"
#ifndef LB_SCALAR
#include "vec.h"

#ifndef LB_KERNEL_NAME
#define LB_KERNEL_NAME LB(kernel_baseline)
#endif

extern const lb_kernel LB_KERNEL_NAME;

#define LB_PARTS (LB_BLOCK / LB_LANES) /* vectors per block */
#define LB_MOST (LB_PARTS * LB_ABREAST)

/* Vector v of a unit: which block of the unit, and where in it. */
#define LB_PLACE(v, block_reals) ((v) / LB_PARTS * (block_reals) + (v) % LB_PARTS * LB_LANES)

/* A unit is processed at once: `n` vectors, one block or LB_ABREAST of them. n is always known where these
 * are inlined, so that all of this is in registers. */
typedef struct {
    vec s_re[LB_MOST], s_im[LB_MOST], f_re[LB_MOST], f_im[LB_MOST];
} unit_sums;

typedef struct {
    vec cosine[LB_MOST], sine[LB_MOST];
} unit_row;

LB_INLINE void load_s(unit_sums *a, const real *p, int n)
{
    for (int v = 0; v < n; ++v) {
        a->s_re[v] = lb_load(p + LB_PLACE(v, 4 * LB_BLOCK));
        a->s_im[v] = lb_load(p + LB_PLACE(v, 4 * LB_BLOCK) + LB_BLOCK);
    }
}

LB_INLINE void load_f(unit_sums *a, const real *p, int n)
{
    for (int v = 0; v < n; ++v) {
        a->f_re[v] = lb_load(p + LB_PLACE(v, 4 * LB_BLOCK) + 2 * LB_BLOCK);
        a->f_im[v] = lb_load(p + LB_PLACE(v, 4 * LB_BLOCK) + 3 * LB_BLOCK);
    }
}

LB_INLINE void store_s(real *p, unit_sums a, int n)
{
    for (int v = 0; v < n; ++v) {
        lb_store(p + LB_PLACE(v, 4 * LB_BLOCK), a.s_re[v]);
        lb_store(p + LB_PLACE(v, 4 * LB_BLOCK) + LB_BLOCK, a.s_im[v]);
    }
}

LB_INLINE void store_f(real *p, unit_sums a, int n)
{
    for (int v = 0; v < n; ++v) {
        lb_store(p + LB_PLACE(v, 4 * LB_BLOCK) + 2 * LB_BLOCK, a.f_re[v]);
        lb_store(p + LB_PLACE(v, 4 * LB_BLOCK) + 3 * LB_BLOCK, a.f_im[v]);
    }
}

LB_INLINE unit_row load_row(const real *p, int n)
{
    unit_row t;
    for (int v = 0; v < n; ++v) {
        t.cosine[v] = lb_load(p + LB_PLACE(v, 2 * LB_BLOCK));
        t.sine[v] = lb_load(p + LB_PLACE(v, 2 * LB_BLOCK) + LB_BLOCK);
    }
    return t;
}

/* S += d·e^(−jθ) in the forward direction, d·e^(+jθ) in the return direction. */
LB_INLINE unit_sums step_s(unit_sums a, unit_row t, const real *delta, int backwards, int n)
{
    for (int v = 0; v < n; ++v) {
        a.s_re[v] += t.cosine[v] * delta[0];
        if (backwards) {
            a.s_im[v] += t.sine[v] * delta[0];
        } else {
            a.s_im[v] -= t.sine[v] * delta[0];
        }
    }
    return a;
}

/* F, in the return direction only: by the even and the odd part. */
LB_INLINE unit_sums step_f(unit_sums a, unit_row t, const real *delta, int n)
{
    for (int v = 0; v < n; ++v) {
        a.f_re[v] += t.cosine[v] * delta[LB_TILE];
        a.f_im[v] += t.sine[v] * delta[2 * LB_TILE];
    }
    return a;
}

/* One row of this unit's bins: S itself, or S·e^(+jθ) with θ of the next sample (the window's oldest). */
LB_INLINE void emit(real *out, unit_sums a, unit_row next, lb_phase phase, int backwards, int n)
{
    for (int v = 0; v < n; ++v) {
        const vec re = a.s_re[v], im = a.s_im[v], c = next.cosine[v], s = next.sine[v];
        real *at = out + LB_PLACE(v, 2 * LB_BLOCK);
        if (phase == LB_PHASE_FIXED) {
            lb_store_pairs(at, re, im);
        } else if (backwards) {
            lb_store_pairs(at, re * c + im * s, im * c - re * s);
        } else {
            lb_store_pairs(at, re * c - im * s, im * c + re * s);
        }
    }
}

/* Data of a unit, and how it is processed. */
typedef struct {
    real *sums;
    const real *row;
    const real *delta;
    real *out; /* place in the first row due */
    const real *out_end;
    lb_phase phase;
    int backwards;
    int n;        /* vectors */
    size_t valid; /* of the last block: reals of its rows that exist; else 0 */
} unit;

/* A row of the last block: the next rows overwrite its surplus; where there are none, only existing values
 * are written. */
LB_INLINE void emit_tail(unit u, unit_sums a, unit_row next)
{
    if (u.out_end - u.out >= 2 * LB_BLOCK) {
        emit(u.out, a, next, u.phase, u.backwards, u.n);
        return;
    }
    real whole[2 * LB_BLOCK];
    emit(whole, a, next, u.phase, u.backwards, u.n);
    LB_ASSERT(u.valid <= 2 * LB_BLOCK && u.out_end - u.out >= (ptrdiff_t)u.valid);
    for (size_t i = 0; i < u.valid; ++i) {
        u.out[i] = whole[i];
    }
}

LB_INLINE unit emit_row(const lb_tile *t, unit u, unit_sums a, unit_row next)
{
    LB_ASSERT(u.out < u.out_end);
    if (u.valid) {
        emit_tail(u, a, next);
    } else {
        emit(u.out, a, next, u.phase, u.backwards, u.n);
    }
    u.out += 2 * t->bins;
    return u;
}

/* The end of a period: S = F. Returns S to be stored; F is final in memory. */
LB_INLINE unit_sums swapped(unit_sums a, const real *sums, int n)
{
    load_f(&a, sums, n);
    for (int v = 0; v < n; ++v) {
        a.s_re[v] = a.f_re[v];
        a.s_im[v] = a.f_im[v];
    }
    return a;
}

/* A row after every hop-th sample, or none. */
LB_INLINE void run_unit(const lb_tile *t, unit u)
{
    const size_t before_swap = t->length - (size_t)t->swap;
    size_t due = t->first, i = 0;
    unit_sums a;
    load_s(&a, u.sums, u.n);
    if (u.backwards) {
        load_f(&a, u.sums, u.n);
    }
    for (;;) {
        const size_t stop = due < before_swap ? due + 1 : before_swap;
        LB_UNROLL_4
        for (; i < stop; ++i, u.row += t->row_step) {
            const unit_row row = load_row(u.row, u.n);
            a = step_s(a, row, u.delta + i, u.backwards, u.n);
            if (u.backwards) {
                a = step_f(a, row, u.delta + i, u.n);
            }
        }
        if (due >= before_swap) {
            break;
        }
        u = emit_row(t, u, a, load_row(u.row, u.n));
        due = t->hop > before_swap ? SIZE_MAX : due + t->hop;
    }
    if (u.backwards) {
        a = t->swap ? step_f(a, load_row(u.row, u.n), u.delta + i, u.n) : a;
        store_f(u.sums, a, u.n);
    }
    if (t->swap) {
        a = swapped(a, u.sums, u.n);
        if (due == i) {
            (void)emit_row(t, u, a, load_row(u.row + t->row_step, u.n));
        }
    }
    store_s(u.sums, a, u.n);
}

LB_INLINE void run_blocks(const lb_tile *t, size_t block, int backwards, int blocks, int tail)
{
    /* Channels within blocks: the table's rows are slow to load, and in the cache for the second channel. */
    for (size_t c = 0; c < t->channels; ++c) {
        unit u;
        u.sums = t->sums + (c * t->blocks + block) * 4 * LB_BLOCK;
        u.row = t->row + block * 2 * LB_BLOCK;
        u.delta = t->delta + c * 3 * LB_TILE;
        u.out = t->out ? t->out + c * t->out_step + block * 2 * LB_BLOCK : t->out;
        u.out_end = t->out ? t->out_end + c * t->out_step : t->out;
        u.backwards = backwards;
        u.n = blocks * LB_PARTS;
        u.valid = tail ? 2 * (t->bins - block * LB_BLOCK) : 0;
        u.phase = t->phase;
        run_unit(t, u);
    }
}

LB_INLINE void run(const lb_tile *t, int backwards)
{
    /* The last block first: its surplus belongs to the others. */
    const size_t whole = t->bins / LB_BLOCK;
    LB_ASSERT(t->length >= 1 && t->length <= LB_TILE);
    LB_ASSERT(t->blocks - whole <= 1);
    size_t block = 0;
    if (whole < t->blocks) {
        run_blocks(t, whole, backwards, 1, 1);
    }
    for (; block + LB_ABREAST <= whole; block += LB_ABREAST) {
        run_blocks(t, block, backwards, LB_ABREAST, 0);
    }
    for (; LB_ABREAST > 1 && block < whole; ++block) {
        run_blocks(t, block, backwards, 1, 0);
    }
}

/* Even and odd parts of a tile in the second half; all images are in the line. */
static void fold(const lb_tile *t, size_t channel)
{
    const real *restrict here = t->line + channel * t->line_step;
    const real *restrict image = here + t->image;
    real *restrict even = t->delta + (channel * 3 + 1) * LB_TILE;
    real *restrict odd = even + LB_TILE;
    const ptrdiff_t length = (ptrdiff_t)t->length;
    LB_ASSERT(t->backwards && t->image <= 0 && t->middle == (t->image == 0));
    for (ptrdiff_t i = 0; i < length; ++i) {
        even[i] = here[i] + image[-i];
        odd[i] = here[i] - image[-i];
    }
    if (t->middle) { /* added only once */
        even[0] = odd[0] = here[0];
    }
}

static void run_tile(const lb_tile *t)
{
    if (!t->backwards) {
        run(t, 0);
        return;
    }
    for (size_t c = 0; c < t->channels; ++c) {
        fold(t, c);
    }
    run(t, 1);
}

static void read_row(const lb_tile *t)
{
    for (size_t block = t->blocks; block-- > 0;) {
        unit u;
        unit_sums a;
        u.out = t->out + block * 2 * LB_BLOCK;
        u.out_end = t->out_end;
        u.phase = t->phase;
        u.backwards = t->backwards;
        u.n = LB_PARTS;
        u.valid = 2 * (t->bins - block * LB_BLOCK);
        load_s(&a, t->sums + block * 4 * LB_BLOCK, LB_PARTS);
        emit_tail(u, a, load_row(t->row + block * 2 * LB_BLOCK, LB_PARTS));
    }
}

static void take_in(real *restrict delta, real *restrict line, const real *restrict samples, ptrdiff_t stride,
                    size_t length)
{
    LB_ASSERT(length && length <= LB_TILE);
    LB_ASSERT(delta + length <= line || line + length <= delta);
    LB_ASSERT(stride != 1 || samples + length <= line || line + length <= samples);
    if (stride == 1) { /* a separate loop, so that it is vectorised */
        for (size_t i = 0; i < length; ++i) {
            delta[i] = samples[i] - line[i];
            line[i] = samples[i];
        }
        return;
    }
    for (size_t i = 0; i < length; ++i, samples += stride) {
        delta[i] = *samples - line[i];
        line[i] = *samples;
    }
}

const lb_kernel LB_KERNEL_NAME = {take_in, run_tile, read_row};

#endif
