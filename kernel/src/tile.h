/* The inner kernel: the sums of all channels over one tile of samples. Private.
 *
 * Table row r holds, per block of LB_BLOCK bins, cos then sin of 2πkr/N. Only r = 0 … ⌈N/2⌉ are stored: row N − r
 * is the conjugate of row r, so the second half of a period reads the rows backwards with an inverted sine.
 *
 * The same symmetry halves the work of the second sum F: sample j of the second half meets its mirror image N − j of
 * the first, and both share a row: x_j·e^(+jθ) + x_(N−j)·e^(−jθ) = (x_j + x_(N−j))·cos θ + j·(x_j − x_(N−j))·sin θ.
 * So F is constant in the first half; x_0, which has no image, is its seed.
 *
 * Sums are, per channel and block, S_re, S_im, F_re, F_im. */
#ifndef LB_TILE_H
#define LB_TILE_H

#include "real.h"

typedef struct {
    size_t channels, blocks;
    real *sums;         /* [channels][blocks][4][LB_BLOCK] */
    const real *line;   /* channel 0's first sample of the tile; its image is `image` reals further, and they move */
    ptrdiff_t image;    /* towards and away from each other */
    size_t line_step;   /* reals from channel to channel */
    int middle;         /* the first sample is its own image */
    const real *row;    /* table row of the first sample */
    ptrdiff_t row_step; /* reals to the next sample's row; negative when reading backwards */
    real *delta;        /* [channels][3][LB_TILE]: x(n) − x(n−N); room for the even and the odd part, */
                        /* x_j + x_(N−j) and x_j − x_(N−j) */
    size_t length;      /* 1 … LB_TILE, within one half of the period */
    int backwards;      /* in the second half */
    int swap;           /* the last sample ends the period: S = F after it */
    size_t first;       /* offset of the first sample after which a row is due; ≥ length: none */
    size_t hop;
    lb_phase phase;
    size_t bins;
    real *out;           /* channel 0's first row due, [rows][bins][2] */
    const real *out_end; /* end of channel 0's rows: nothing is written from here on */
    size_t out_step;     /* reals from channel to channel */
} lb_tile;

typedef struct {
    /* delta[i] = samples[i·stride] − line[i]; line[i] = samples[i·stride] */
    void (*take_in)(real *delta, real *line, const real *samples, ptrdiff_t stride, size_t length);
    void (*run)(const lb_tile *tile);
    /* channel 0's row now; uses sums, row, backwards, blocks, phase, bins, out, out_end */
    void (*read)(const lb_tile *tile);
} lb_kernel;

/* Position of bin b in a block, so that interleaving re and im within 128-bit lanes puts the bins in order. */
static inline size_t lb_slot(size_t b)
{
#if LB_BLOCK == 1
    return b;
#elif LB_BITS == 64
    return (b % 4u) * 2u + b / 4u;
#else
    return (b % 8u) / 2u * 4u + b / 8u * 2u + b % 2u;
#endif
}

#endif
