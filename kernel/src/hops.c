/* Samples by the hop: tables, part-hops and rows of hop.h. */
#include "hop.h"
#include "state.h"
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
    const size_t pairs = lb_pairs(t), step = pairs * 2 * LB_BLOCK;
    LB_ASSERT(t->hop && t->window % t->hop == 0);
    for (size_t i = 0; i < pairs; ++i) {
        fill(t, t->table + i * 2 * LB_BLOCK, step, 2u * i + (t->hop % 2u ? 0u : 1u));
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
}

void LB(hop_row)(const LB_DFT *t, size_t channel, lb_phase phase, real *out)
{
    const uint32_t hops = t->index / t->hop;
    const real *turn = t->turns + (size_t)((hops ? hops : lb_places(t)) - 1u) * t->row_length;
    for (size_t b = 0; b < t->bin_count; ++b, out += 2) {
        const real *sum = lb_sums(t, channel) + lb_sum_at(b), re = sum[0], im = sum[LB_BLOCK];
        const real *v = turn + lb_cos_at(b), *a = t->ahead + lb_cos_at(b);
        const real cosine = v[0] * a[0] - v[LB_BLOCK] * a[LB_BLOCK];
        const real sine = v[0] * a[LB_BLOCK] + v[LB_BLOCK] * a[0];
        out[0] = phase == LB_PHASE_FIXED ? re : re * cosine - im * sine;
        out[1] = phase == LB_PHASE_FIXED ? im : re * sine + im * cosine;
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

/* A channel's sample makes a pair with an earlier one of its hop; P of the hop begins with the pair at its centre. */
static void pair(const LB_DFT *t, uint32_t channel, uint32_t place)
{
    const uint32_t number = place - (t->hop - lb_pairs(t)), step = 2u * lb_pairs(t);
    const real *line = t->line + channel * t->line_length;
    const real even = line[t->hop - 1u - place] + line[place], odd = line[t->hop - 1u - place] - line[place];
    const real *w = t->table + 2u * number;
    real *p = t->work + channel * 2u * t->blocks, *end = p + 2u * t->blocks;
    for (; p != end; p += 2, w += step) {
        p[0] = (number ? p[0] : 0) + w[0] * even;
        p[1] = (number ? p[1] : 0) + w[1] * odd;
    }
}

/* The end of a hop. */
static void add(const LB_DFT *t, uint32_t channel)
{
    const uint32_t place = t->index / t->hop, places = lb_places(t);
    const real *turn = t->turns + place * t->row_length, *p = t->work + channel * t->row_length;
    real *ring = t->ring + ((size_t)channel * places + place) * t->row_length;
    real *a = lb_sums(t, channel), *end = a + 4u * t->blocks;
    for (; a != end; a += 4, p += 2, turn += 2, ring += 2) {
        const real re = p[0] * turn[0] + p[1] * turn[1], im = p[1] * turn[0] - p[0] * turn[1];
        a[0] += re - ring[0];
        a[1] += im - ring[1];
        a[2] += re;
        a[3] += im;
        ring[0] = re;
        ring[1] = im;
        if (place + 1u == places) {
            a[0] = a[2];
            a[1] = a[3];
            a[2] = a[3] = 0;
        }
    }
}

void LB(resume_hops)(LB_DFT *t)
{
    for (uint32_t c = 0; c < t->channels; ++c) {
        for (uint32_t place = t->hop - lb_pairs(t); place < t->index % t->hop; ++place) {
            pair(t, c, place);
        }
    }
}

void LB(hop_step)(LB_DFT *t, const real *samples, ptrdiff_t stride)
{
    const uint32_t place = t->index % t->hop;
    LB_ASSERT(lb_sound(t));
    for (uint32_t c = 0; c < t->channels; ++c, samples += stride) {
        t->line[c * t->line_length + place] = *samples;
        if (place >= t->hop - lb_pairs(t)) {
            pair(t, c, place);
        }
        if (place + 1u == t->hop) {
            add(t, c);
        }
    }
    ++t->count;
    t->index = t->index + 1u < t->window ? t->index + 1u : 0u;
}
#endif
