/* An object inside the caller's memory. Private. */
#ifndef LB_STATE_H
#define LB_STATE_H

#include "hop.h"
#include "tile.h"

struct LB_DFT {
    const lb_kernel *kernel;
    lb_run_hops *run_hops;
    lb_instruction_set set;
    lb_variant variant;
    double damping;
    uint32_t window, channels, bin_count;
    uint32_t hop;         /* 0: rows after any sample */
    uint32_t inner_count; /* the requested bins, then the neighbours that a window's taps need */
    uint32_t half;        /* ⌈N/2⌉: from this index on the table is read backwards */
    size_t blocks;        /* of inner bins */
    size_t row_length;    /* reals per table row */
    size_t line_length;   /* reals per channel's delay line */
    real radius;          /* LB_DAMPED: r; else 1 */
    real radius_window;   /* r^N */
    uint64_t count;       /* samples that the sums contain */
    uint32_t index;       /* of the next sample in its period: count mod N */
    uint32_t queued;      /* newer waiting samples, < LB_TILE */
    int compact;          /* the table is [window][2]: cos, sin of 2πr/N */
    real *table;          /* else [half + 1][blocks][2][LB_BLOCK]: cos, sin; with a hop its weights: hop.h */
    real *rows;           /* compact: [LB_TILE + 1][blocks][2][LB_BLOCK], gathered from the table */
    real *sums;           /* [channels][blocks][4][LB_BLOCK] */
    real *line;     /* [channels][line_length], the newest N samples, by index; with a hop those of the last one */
    real *delta;    /* [channels][3][LB_TILE], of the tile at work: see tile.h */
    real *queue;    /* [channels][LB_TILE] */
    real *spectrum; /* [inner_count][2], scratch of the windows */
    real *turns, *ahead, *ring, *work; /* with a hop: hop.h; ring of each channel, and where no sample waits work */
    uint32_t *bins;                    /* [inner_count] */
    uint32_t *taps;                    /* [bin_count][4]: places among the inner bins of k−1, k+1, k−2, k+2 */
};

static inline int lb_renews(lb_variant v) { return v != LB_PLAIN && v != LB_DAMPED; }
/* With a hop: its pairs of samples, and the hops of a window. */
static inline uint32_t lb_pairs(const LB_DFT *t) { return (t->hop + 1u) / 2u; }
static inline uint32_t lb_places(const LB_DFT *t) { return t->window / t->hop; }

static inline int lb_is_windowed(lb_variant v) { return v > LB_DAMPED; }

/* Whether the parts of the memory agree with each other: what init laid out and nothing changes. */
static inline int lb_laid_out(const LB_DFT *t)
{
    const int limited = t->window >= 1u && t->window <= LB_WINDOW_MAX && t->half == (t->window + 1u) / 2u &&
                        t->channels >= 1u && t->channels <= LB_CHANNELS_MAX;
    const int lengths = t->bin_count >= 1u && t->bin_count <= t->inner_count && t->inner_count <= t->window &&
                        t->blocks == (t->inner_count + LB_BLOCK - 1u) / LB_BLOCK &&
                        t->row_length == t->blocks * 2u * LB_BLOCK && t->line_length >= (t->hop ? t->hop : t->window);
    const int divided = !t->hop || (t->window % t->hop == 0 && t->turns && t->ahead && t->ring && t->work);
    return limited && lengths && divided && t->table && t->sums && t->line && t->delta && t->queue && t->bins;
}

/* Whether an object is as every call leaves it. */
static inline int lb_sound(const LB_DFT *t)
{
    const uint32_t waiting_max = LB_TILE ? LB_TILE - 1u : 0u;
    return lb_laid_out(t) && t->index == t->count % t->window && t->queued <= waiting_max &&
           (unsigned)t->variant <= LB_BLACKMAN && t->radius >= 0 && t->radius <= 1 && t->radius_window <= t->radius;
}

static inline size_t lb_smaller(size_t a, size_t b) { return a < b ? a : b; }

/* Whether two regions have no byte in common. */
static inline int lb_apart(const void *a, size_t a_bytes, const void *b, size_t b_bytes)
{
    const uintptr_t first = (uintptr_t)a, second = (uintptr_t)b;
    return !a_bytes || !b_bytes || (first < second ? second - first >= a_bytes : first - second >= b_bytes);
}

/* Neighbours on each side that a variant's taps need. */
static inline uint32_t lb_reach(lb_variant v) { return v == LB_BLACKMAN ? 2u : lb_is_windowed(v) ? 1u : 0u; }

/* Place of a bin's S_re among the channel's sums; S_im, F_re, F_im follow at LB_BLOCK each. */
static inline size_t lb_sum_at(size_t bin) { return bin / LB_BLOCK * 4 * LB_BLOCK + lb_slot(bin % LB_BLOCK); }

/* Place of a bin's cos in a table row; sin follows at LB_BLOCK. */
static inline size_t lb_cos_at(size_t bin) { return bin / LB_BLOCK * 2 * LB_BLOCK + lb_slot(bin % LB_BLOCK); }

void LB(fill_table)(LB_DFT *t);

/* With a hop: tables, the state after init, what is not in a snapshot, and one channel's row after the last whole hop.
 */
void LB(fill_hops)(LB_DFT *t);
void LB(reset_hops)(LB_DFT *t);
void LB(resume_hops)(LB_DFT *t);
void LB(hop_row)(const LB_DFT *t, size_t channel, lb_phase phase, real *out);

/* Row `number` of a compact table, gathered at `place` among the rows. */
const real *LB(gathered)(const LB_DFT *t, uint32_t number, size_t place);

static inline const real *lb_table_row(const LB_DFT *t, uint32_t number)
{
    LB_ASSERT(number <= t->half);
    return t->compact ? LB(gathered)(t, number, 0) : t->table + (size_t)number * t->row_length;
}

/* The table row of the index, and whether it must be conjugated. */
static inline const real *lb_row(const LB_DFT *t, uint32_t index, int *backwards)
{
    LB_ASSERT(index < t->window);
    *backwards = index >= t->half;
    return lb_table_row(t, *backwards ? t->window - index : index);
}

/* The row that demodulates the present sums: that of the next sample in the direction of the last one. Where the
 * directions meet it is the same row as lb_row's, but with another sign of its zeros. */
static inline const real *lb_next_row(const LB_DFT *t, int *backwards)
{
    LB_ASSERT(t->index < t->window);
    const uint32_t last = (t->index ? t->index : t->window) - 1u;
    *backwards = last >= t->half;
    return lb_table_row(t, *backwards ? t->window - last - 1u : last + 1u);
}

static inline real *lb_sums(const LB_DFT *t, size_t channel)
{
    LB_ASSERT(channel < t->channels);
    return t->sums + channel * t->blocks * 4 * LB_BLOCK;
}

/* The instruction set, where this machine and this build have it. */
lb_status LB(choose)(LB_DFT *t, lb_instruction_set set);

/* Source of samples. */
typedef struct {
    const real *samples;
    ptrdiff_t channel_stride, sample_stride;
} lb_input;

/* Where samples are: the lowest address and the number of bytes. */
typedef struct {
    uintptr_t first, bytes;
} lb_region;

static inline lb_region lb_region_of(const LB_DFT *t, const lb_input *in, size_t length)
{
    const ptrdiff_t steps[2] = {in->channel_stride * (ptrdiff_t)(t->channels - 1u),
                                in->sample_stride * (ptrdiff_t)(length - 1u)};
    lb_region r = {(uintptr_t)in->samples, sizeof(real)};
    for (int i = 0; i < 2; ++i) {
        const uintptr_t reach = (uintptr_t)(steps[i] < 0 ? -steps[i] : steps[i]) * sizeof(real);
        r.first -= steps[i] < 0 ? reach : 0u;
        r.bytes += reach;
    }
    return r;
}

/* Rows that are due. */
typedef struct {
    size_t first, hop;
    lb_phase phase;
    real *out;            /* next row of channel 0 */
    size_t channel_reals; /* from channel to channel */
    const real *end;      /* of channel 0's rows */
} lb_rows_due;

/* `length` samples without rows. */
void LB(skip)(LB_DFT *t, lb_input *in, size_t length);

#ifdef LB_SCALAR
/* One sample of each channel, with a hop. */
void LB(hop_step)(LB_DFT *t, const real *samples, ptrdiff_t stride);
#else
/* Samples and rows, with a hop. */
void LB(hop_samples)(LB_DFT *t, lb_input *in, size_t length, lb_rows_due due);

/* The same with rows, which the inner kernels write themselves; LB_MODULATED only. */
void LB(fused_rows)(LB_DFT *t, lb_input *in, size_t length, lb_rows_due due);
#endif

/* Updates the sums with the waiting samples. */
void LB(catch_up)(LB_DFT *t);

/* The unrenewed variants' recursion over a tile. */
void LB(recur)(const LB_DFT *t, size_t channel, const real *delta, size_t length);

/* One channel's inner bins: S, or in the window's phase. out[inner_count][2] */
void LB(row)(const LB_DFT *t, size_t channel, lb_phase phase, real *out);

/* One channel's spectrum; nothing may wait. out[bin_count][2] */
void LB(emit)(const LB_DFT *t, size_t channel, lb_phase phase, real *out);

#endif
