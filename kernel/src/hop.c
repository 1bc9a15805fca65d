/* The matrix product of hop.h. Compiled once per number type and instruction set, as tile.c is. */
#include "hop.h"
#ifndef LB_SCALAR
#include "vec.h"

#ifndef LB_HOPS_NAME
#define LB_HOPS_NAME LB(hops_baseline)
#endif

extern lb_run_hops LB_HOPS_NAME;

#define LB_PARTS (LB_BLOCK / LB_LANES) /* vectors per block */

/* Hops whose P are in registers at once: they share each loaded weight, and their additions hide the adder's latency.
 */
#if LB_BLOCK == LB_LANES
#define LB_HOPS_ABREAST LB_COLUMNS
#elif 2 * LB_LANES == LB_BLOCK
#define LB_HOPS_ABREAST 3
#elif LB_MANY_REGISTERS
#define LB_HOPS_ABREAST 2
#else
#define LB_HOPS_ABREAST 1
#endif

#define LB_MOST (LB_PARTS * LB_HOPS_ABREAST)

/* Sums and differences of the samples of up to LB_PAIRS pairs of each hop. */
typedef struct {
    real even[LB_HOPS_ABREAST][LB_PAIRS], odd[LB_HOPS_ABREAST][LB_PAIRS];
} __attribute__((aligned(64))) folded;

/* P of a block for each hop: re and im, part by part. */
typedef struct {
    vec re[LB_MOST], im[LB_MOST];
} transforms;

LB_INLINE void fold_vector(const real *before, const real *after, real *even, real *odd)
{
    const vec ordered = (vec) * (const loose_vec *)(const void *)(before - (LB_LANES - 1));
    const vec a = LB_SHUFFLE(ordered, ordered, LB_REVERSED), b = (vec) * (const loose_vec *)(const void *)after;
    *(loose_vec *)(void *)even = (loose_vec)(a + b);
    *(loose_vec *)(void *)odd = (loose_vec)(a - b);
}

/* `count` pairs of a hop: `before` goes away from the centre as `after` does. */
static void fold(const real *before, const real *after, real *even, real *odd, size_t count)
{
    size_t i = 0;
    if (count < LB_LANES) {
        for (; i < count; ++i) {
            even[i] = before[-(ptrdiff_t)i] + after[i];
            odd[i] = before[-(ptrdiff_t)i] - after[i];
        }
        return;
    }
    for (; i + LB_LANES < count; i += LB_LANES) {
        fold_vector(before - i, after + i, even + i, odd + i);
    }
    i = count - LB_LANES; /* some of them twice */
    fold_vector(before - i, after + i, even + i, odd + i);
}

/* One row's values of a block: S, or S·e^(+jψ)·e^(+jα) with the turn ψ of the hop's centre. The next rows overwrite the
 * surplus of the last block; where there are none, only existing values are written. */
LB_INLINE void emit(const lb_hops *h, real *out, const vec *re, const vec *im, const real *turn, const real *ahead)
{
    real whole[2 * LB_BLOCK];
    const int fits = h->out_end - out >= 2 * LB_BLOCK;
    real *to = fits ? out : whole;
    for (int v = 0; v < LB_PARTS; ++v) {
        if (!ahead) {
            lb_store_pairs(to + v * LB_LANES, re[v], im[v]);
            continue;
        }
        const vec c = lb_load(turn + v * LB_LANES), s = lb_load(turn + v * LB_LANES + LB_BLOCK);
        const vec a = lb_load(ahead + v * LB_LANES), b = lb_load(ahead + v * LB_LANES + LB_BLOCK);
        const vec cosine = c * a - s * b, sine = c * b + s * a;
        lb_store_pairs(to + v * LB_LANES, re[v] * cosine - im[v] * sine, re[v] * sine + im[v] * cosine);
    }
    for (ptrdiff_t i = 0; !fits && i < h->out_end - out; ++i) {
        out[i] = whole[i];
    }
}

/* S and F of a block gain `hops` hops; its part of the rows that are due. */
LB_INLINE void add(const lb_hops *h, size_t block, const transforms *p, int hops)
{
    const size_t row = h->blocks * 2 * LB_BLOCK;
    const real *ahead = h->ahead ? h->ahead + block * 2 * LB_BLOCK : 0;
    real *sums = h->sums + block * 4 * LB_BLOCK, *out = h->out ? h->out + block * 2 * LB_BLOCK : 0;
    size_t place = h->place, due = h->first;
    vec s_re[LB_PARTS], s_im[LB_PARTS], f_re[LB_PARTS], f_im[LB_PARTS];
    for (int v = 0; v < LB_PARTS; ++v) {
        s_re[v] = lb_load(sums + v * LB_LANES);
        s_im[v] = lb_load(sums + v * LB_LANES + LB_BLOCK);
        f_re[v] = lb_load(sums + v * LB_LANES + 2 * LB_BLOCK);
        f_im[v] = lb_load(sums + v * LB_LANES + 3 * LB_BLOCK);
    }
    LB_UNROLL_8
    for (int i = 0; i < hops; ++i) {
        const real *turn = h->turns + place * row + block * 2 * LB_BLOCK;
        real *ring = h->ring + place * row + block * 2 * LB_BLOCK;
        const int ends = ++place == h->places;
        place = ends ? 0 : place;
        for (int v = 0; v < LB_PARTS; ++v) {
            const vec c = lb_load(turn + v * LB_LANES), s = lb_load(turn + v * LB_LANES + LB_BLOCK);
            const vec a = p->re[i * LB_PARTS + v], b = p->im[i * LB_PARTS + v];
            const vec re = a * c + b * s, im = b * c - a * s;
            s_re[v] += re - lb_load(ring + v * LB_LANES);
            s_im[v] += im - lb_load(ring + v * LB_LANES + LB_BLOCK);
            lb_store(ring + v * LB_LANES, re);
            lb_store(ring + v * LB_LANES + LB_BLOCK, im);
            f_re[v] += re;
            f_im[v] += im;
            if (ends) {
                s_re[v] = f_re[v];
                s_im[v] = f_im[v];
                f_re[v] = f_im[v] = (vec){0};
            }
        }
        if (!due) {
            emit(h, out, s_re, s_im, turn, ahead);
            out += 2 * h->bins;
            due = h->every;
        }
        --due;
    }
    for (int v = 0; v < LB_PARTS; ++v) {
        lb_store(sums + v * LB_LANES, s_re[v]);
        lb_store(sums + v * LB_LANES + LB_BLOCK, s_im[v]);
        lb_store(sums + v * LB_LANES + 2 * LB_BLOCK, f_re[v]);
        lb_store(sums + v * LB_LANES + 3 * LB_BLOCK, f_im[v]);
    }
}

/* P of a block gains `count` pairs of each hop, the first of which is `first`. */
LB_INLINE transforms multiply(const lb_hops *h, size_t block, const folded *f, size_t first, size_t count, int hops)
{
    const real *w = h->weights + (block * h->pairs + first) * 2 * LB_BLOCK;
    const real *before = h->work + block * LB_COLUMNS * 2 * LB_BLOCK;
    transforms p;
    for (int i = 0; i < hops * LB_PARTS; ++i) {
        p.re[i] = first ? lb_load(before + 2 * i * LB_LANES) : (vec){0};
        p.im[i] = first ? lb_load(before + (2 * i + 1) * LB_LANES) : (vec){0};
    }
    for (size_t n = 0; n < count; ++n, w += 2 * LB_BLOCK) {
        for (int v = 0; v < LB_PARTS; ++v) {
            const vec cosine = lb_load(w + v * LB_LANES), sine = lb_load(w + v * LB_LANES + LB_BLOCK);
            for (int i = 0; i < hops; ++i) {
                p.re[i * LB_PARTS + v] += cosine * f->even[i][n];
                p.im[i * LB_PARTS + v] += sine * f->odd[i][n];
            }
        }
    }
    return p;
}

/* The next `hops` hops: sums and rows. Blocks begin with the last, whose surplus belongs to the others. */
LB_INLINE void run(const lb_hops *h, int hops)
{
    folded f;
    for (size_t first = 0; first < h->pairs; first += LB_PAIRS) {
        const size_t rest = h->pairs - first, count = rest < LB_PAIRS ? rest : LB_PAIRS;
        for (int i = 0; i < hops; ++i) {
            const real *hop = h->samples + (size_t)i * h->hop;
            fold(hop + h->pairs - 1 - first, hop + h->hop - h->pairs + first, f.even[i], f.odd[i], count);
        }
        for (size_t block = h->blocks; block-- > 0;) {
            const transforms p = multiply(h, block, &f, first, count, hops);
            if (count == rest) {
                add(h, block, &p, hops);
                continue;
            }
            real *work = h->work + block * LB_COLUMNS * 2 * LB_BLOCK;
            for (int i = 0; i < hops * LB_PARTS; ++i) {
                lb_store(work + 2 * i * LB_LANES, p.re[i]);
                lb_store(work + (2 * i + 1) * LB_LANES, p.im[i]);
            }
        }
    }
}

/* After `hops` hops. */
static lb_hops passed(lb_hops h, size_t hops)
{
    h.samples += hops * h.hop;
    h.hops -= hops;
    h.place = (h.place + hops) % h.places;
    if (h.first >= hops) {
        h.first -= hops;
        return h;
    }
    const size_t rows = 1 + (hops - 1 - h.first) / h.every;
    h.first += rows * h.every - hops;
    h.out += rows * 2 * h.bins;
    return h;
}

void LB_HOPS_NAME(const lb_hops *hops)
{
    lb_hops h = *hops;
    LB_ASSERT(h.pairs == (h.hop + 1) / 2 && h.place < h.places && h.every);
    for (; h.hops >= LB_HOPS_ABREAST; h = passed(h, LB_HOPS_ABREAST)) {
        run(&h, LB_HOPS_ABREAST);
    }
    for (; LB_HOPS_ABREAST > 1 && h.hops; h = passed(h, 1)) {
        run(&h, 1);
    }
}

#endif
