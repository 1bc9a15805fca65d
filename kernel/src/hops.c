/* Samples by the hop: tables, part-hops and rows of hop.h. */
#include "hop.h"
#include "one.h"
#include "twiddle.h"

/* cos and sin of 2πk·number/2N at a bin's place among the blocks; `step` reals follow to those of the next block. */
static void fill(const LB_DFT *t, real *at, size_t step, uint64_t number)
{
    const uint32_t turn = 2u * t->window;
    for (size_t i = 0; i < t->blocks * LB_BLOCK; ++i) {
        const uint64_t k = i < t->inner_count ? t->bins[i] : 0u;
        double cosine, sine;
        lb_twiddle((uint32_t)(k * number % turn), turn, &cosine, &sine);
        real *place = at + i / LB_BLOCK * step + lb_slot(i % LB_BLOCK);
        place[0] = (real)cosine;
        place[LB_BLOCK] = (real)sine;
    }
}

void LB(fill_hops)(LB_DFT *t)
{
    /* Vectors go along the pairs of a block; without them every sample goes along the bins of a pair. */
    const size_t pairs = lb_pairs(t), next = LB_TILE ? 2 * LB_BLOCK : t->row_length, step = LB_TILE ? pairs * next : 2;
    LB_ASSERT(t->hop && t->window % t->hop == 0);
    for (size_t i = 0; i < pairs; ++i) {
        fill(t, t->table + i * next, step, 2u * i + (t->hop % 2u ? 0u : 1u));
    }
    for (size_t b = 0; b < t->blocks && t->hop % 2u; ++b) { /* the middle sample is its own pair */
        for (size_t i = 0; i < LB_BLOCK; ++i) {
            t->table[b * step + i] = (real)0.5;
        }
    }
    for (uint64_t m = 0; m < lb_places(t); ++m) {
        fill(t, t->turns + m * t->row_length, 2 * LB_BLOCK, 2u * m * t->hop + t->hop - 1u);
    }
    fill(t, t->ahead, 2 * LB_BLOCK, t->hop + 1u);
}

void LB(reset_hops)(LB_DFT *t)
{
    for (size_t i = 0; i < t->channels * lb_places(t) * t->row_length; ++i) {
        t->ring[i] = 0;
    }
    LB(resume_hops)(t);
}

void LB(hop_row)(const LB_DFT *t, size_t channel, lb_phase phase, real *out)
{
    const uint32_t hops = t->index / t->hop;
    const real *turn = t->turns + (size_t)((hops ? hops : lb_places(t)) - 1u) * t->row_length;
    const real *sums = lb_sums(t, channel);
    if (phase == LB_PHASE_FIXED) {
        for (size_t b = 0; b < t->bin_count; ++b, out += 2) {
            out[0] = sums[lb_sum_at(b)];
            out[1] = sums[lb_sum_at(b) + LB_BLOCK];
        }
        return;
    }
    for (size_t b = 0; b < t->bin_count; ++b, out += 2) {
        const real re = sums[lb_sum_at(b)], im = sums[lb_sum_at(b) + LB_BLOCK];
        const real *v = turn + lb_cos_at(b), *a = t->ahead + lb_cos_at(b);
        const real cosine = v[0] * a[0] - v[LB_BLOCK] * a[LB_BLOCK];
        const real sine = v[0] * a[LB_BLOCK] + v[LB_BLOCK] * a[0];
        out[0] = re * cosine - im * sine;
        out[1] = re * sine + im * cosine;
    }
}

#ifndef LB_SCALAR

/* `hops` whole hops of a channel, and its rows that are due. */
static void run(const LB_DFT *t, size_t channel, const real *samples, size_t hops, const lb_rows_due *due)
{
    const uint32_t before = t->index / t->hop;
    lb_hops h;
    h.samples = samples;
    h.hops = hops;
    h.hop = t->hop;
    h.pairs = lb_pairs(t);
    h.blocks = t->blocks;
    h.bins = t->bin_count;
    h.weights = t->table;
    h.turns = t->turns;
    h.ahead = due->phase == LB_PHASE_FIXED ? 0 : t->ahead;
    h.place = before;
    h.places = lb_places(t);
    h.ring = t->ring + channel * h.places * t->row_length;
    h.sums = lb_sums(t, channel);
    h.work = t->work;
    h.first = due->out ? due->first / t->hop : SIZE_MAX;
    h.every = due->out ? due->hop / t->hop : 1u;
    h.out = due->out ? due->out + channel * due->channel_reals : 0;
    h.out_end = due->out ? due->end + channel * due->channel_reals : 0;
    t->run_hops(&h);
}

/* Moves on by `length` samples, whose rows are written. */
static void passed(LB_DFT *t, lb_rows_due *due, size_t length)
{
    t->count += length;
    t->index = (uint32_t)(t->count % t->window);
    if (!due->out) {
        return;
    }
    if (due->first >= length) {
        due->first -= length;
        return;
    }
    const size_t rows = 1 + (length - 1 - due->first) / due->hop;
    due->out += rows * 2 * t->bin_count;
    due->first += rows * due->hop - length;
}

/* A part of a hop, or samples with a stride: into the delay line, and from there. */
static size_t wait(LB_DFT *t, const lb_input *in, size_t length, lb_rows_due *due)
{
    const size_t waiting = t->index % t->hop, n = lb_smaller(length, t->hop - waiting);
    const int ends = waiting + n == t->hop;
    for (size_t c = 0; c < t->channels; ++c) {
        const real *x = in->samples + (ptrdiff_t)c * in->channel_stride;
        real *line = t->line + c * t->line_length;
        for (size_t i = 0; i < n; ++i, x += in->sample_stride) {
            line[waiting + i] = *x;
        }
        if (ends) {
            run(t, c, line, 1, due);
        }
    }
    return n;
}

void LB(hop_samples)(LB_DFT *t, lb_input *in, size_t length, lb_rows_due due)
{
    while (length) {
        size_t n = length / t->hop * t->hop;
        LB_ASSERT(t->index == t->count % t->window);
        if (!n || t->index % t->hop || in->sample_stride != 1) {
            n = wait(t, in, length, &due);
        } else {
            for (size_t c = 0; c < t->channels; ++c) {
                run(t, c, in->samples + (ptrdiff_t)c * in->channel_stride, n / t->hop, &due);
            }
        }
        in->samples += (ptrdiff_t)n * in->sample_stride;
        length -= n;
        passed(t, &due, n);
    }
    LB_ASSERT(!due.out || due.out == due.end);
}

void LB(resume_hops)(LB_DFT *t) { (void)t; }

#else

/* P of one bin; returns the next one's. */
LB_OFTEN real *pair_one(real *p, turn w, real even, real odd)
{
#if LB_SEVERAL
    register real re __asm__("s4"), im __asm__("s5");
    __asm__ volatile("vldmia %2, {s4, s5}" : "=t"(re), "=t"(im) : "r"(p) : "memory");
    re += w.c * even;
    im += w.s * odd;
    __asm__ volatile("vstmia %0!, {s4, s5}" : "+r"(p) : "t"(re), "t"(im) : "memory");
    return p;
#else
    p[0] += w.c * even;
    p[1] += w.s * odd;
    return p + 2;
#endif
}

/* The samples at a place make pairs with earlier ones of their hop. Two channels at a time share the loaded weights. */
LB_RARELY void pair(const LB_DFT *t, uint32_t place)
{
    const uint32_t pairs = lb_pairs(t), before = t->hop - 1u - place;
    const real *weights = t->table + (place - (t->hop - pairs)) * t->row_length, *line = t->line;
    real *p = t->work;
    uint32_t left = t->channels;
    LB_ASSERT(place < t->hop && before <= place);
    for (; left >= 2u; left -= 2u, line += 2u * t->line_length) {
        const real *next = line + t->line_length, *w = weights;
        const real even = line[before] + line[place], odd = line[before] - line[place];
        const real even_next = next[before] + next[place], odd_next = next[before] - next[place];
        for (real *end = p + t->row_length, *other = end; p != end;) {
            const turn now = take_turn(&w);
            p = pair_one(p, now, even, odd);
            other = pair_one(other, now, even_next, odd_next);
        }
        p += t->row_length;
    }
    if (left) {
        const real even = line[before] + line[place], odd = line[before] - line[place];
        for (const real *w = weights, *end = p + t->row_length; p != end;) {
            p = pair_one(p, take_turn(&w), even, odd);
        }
    }
}

/* P of one bin, which begins again, as Q on the fixed grid. */
LB_OFTEN turn turned(real *p, turn w)
{
    const real a = p[0], b = p[1];
    const turn q = {a * w.c + b * w.s, b * w.c - a * w.s};
    p[0] = p[1] = 0;
    return q;
}

/* S and F of one bin gain Q, and S loses that of a window before; returns the next bin's. */
LB_OFTEN real *add_one(real *a, turn q, const real *ring, int ends)
{
#if LB_SEVERAL
    register real re __asm__("s4"), im __asm__("s5"), f_re __asm__("s6"), f_im __asm__("s7");
    __asm__ volatile("vldmia %4, {s4-s7}" : "=t"(re), "=t"(im), "=t"(f_re), "=t"(f_im) : "r"(a) : "memory");
    f_re += q.c;
    f_im += q.s;
    re = ends ? f_re : re + (q.c - ring[0]);
    im = ends ? f_im : im + (q.s - ring[1]);
    f_re = ends ? 0 : f_re;
    f_im = ends ? 0 : f_im;
    __asm__ volatile("vstmia %0!, {s4-s7}" : "+r"(a) : "t"(re), "t"(im), "t"(f_re), "t"(f_im) : "memory");
    return a;
#else
    const real f_re = a[2] + q.c, f_im = a[3] + q.s;
    a[0] = ends ? f_re : a[0] + (q.c - ring[0]);
    a[1] = ends ? f_im : a[1] + (q.s - ring[1]);
    a[2] = ends ? 0 : f_re;
    a[3] = ends ? 0 : f_im;
    return a + 4;
#endif
}

/* The end of a hop, for every channel. */
LB_OFTEN void end_hop(const LB_DFT *t, int ends)
{
    const uint32_t place = t->index / t->hop;
    const real *turns = t->turns + place * t->row_length;
    const size_t ahead = lb_places(t) * t->row_length;
    real *a = t->sums, *p = t->work, *ring = t->ring + place * t->row_length;
    for (uint32_t c = 0; c < t->channels; ++c, ring += ahead) {
        real *old = ring;
        const real *w = turns;
        for (real *end = p + t->row_length; p != end; p += 2, old += 2) {
            const turn q = turned(p, take_turn(&w));
            a = add_one(a, q, old, ends);
            old[0] = q.c;
            old[1] = q.s;
        }
    }
}

/* One body for each, so that the loop contains no branch on it. */
LB_RARELY void end_of_hop(const LB_DFT *t) { end_hop(t, 0); }
LB_RARELY void end_of_period(const LB_DFT *t) { end_hop(t, 1); }

void LB(resume_hops)(LB_DFT *t)
{
    for (size_t i = 0; i < t->channels * t->row_length; ++i) {
        t->work[i] = 0;
    }
    for (uint32_t place = t->hop - lb_pairs(t); place < t->index % t->hop; ++place) {
        pair(t, place);
    }
}

void LB(hop_step)(LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    const uint32_t place = t->index % t->hop, next = t->index + 1u;
    LB_ASSERT(lb_sound(t));
    for (uint32_t c = 0; c < t->channels; ++c, samples += stride) {
        t->line[c * t->line_length + place] = *samples;
    }
    if (place >= t->hop - lb_pairs(t)) {
        pair(t, place);
    }
    if (place + 1u == t->hop) {
        (next < t->window ? end_of_hop : end_of_period)(t);
    }
    ++t->count;
    t->index = next < t->window ? next : 0u;
}
#endif
