/* The inner kernel: one channel's sums over one tile of samples. Private.
 *
 * Table row r holds, per block of LB_BLOCK bins, cos then sin of 2πkr/N. Only r = 0 … ⌈N/2⌉ are stored: row N − r
 * is the conjugate of row r, so the second half of a period walks the rows backwards with the sine's sign turned.
 * Sums are, per block, S_re, S_im, F_re, F_im. */
#ifndef LB_TILE_H
#define LB_TILE_H

#include "real.h"

typedef struct {
    real *sums;          /* [blocks][4][LB_BLOCK] */
    const real *row;     /* table row of the first sample, block 0 */
    ptrdiff_t row_step;  /* reals to the next sample's row; negative when walking backwards */
    size_t blocks;
    const real *delta;   /* x(n) − x(n−N), [length] */
    const real *samples; /* x(n), [length] */
    size_t length;       /* 1 … LB_TILE, within one half of the period */
    int backwards;
    int swap;            /* the last sample ends the period: S = F, F = 0 after it */
    size_t first;        /* offset of the first sample after which a row is due; ≥ length: none */
    size_t hop;
    lb_phase phase;
    size_t bins;
    real *out;           /* first row due, [rows][bins][2] */
    const real *out_end; /* end of this channel's rows: nothing is written from here on */
} lb_tile;

typedef void (*lb_tile_function)(const lb_tile *tile);

/* Where bin b of a block lies: so that interleaving re and im within 128-bit lanes puts the bins in order. */
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
