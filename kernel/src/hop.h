/* Rows at a hop, by one matrix product. Private.
 *
 * The window has N/H hops of H samples. The spectrum of a hop is referred to its centre, where the twiddle factors of
 * two samples at equal distances are conjugates of each other:
 *
 *   P_k = Σ over pairs of (x_before + x_after)·cos θ + j·(x_before − x_after)·sin θ,   θ = 2πk·distance/2N
 *
 * which takes one multiplication per bin and sample. One turn by the place of the centre refers it to the fixed grid:
 * Q_k = P_k·e^(−j2πk·(2mH + H − 1)/2N), where m is the hop's place in its period. S gains what is new, Q − Q a window
 * before; F gains Q, and replaces S at the end of a period. All angles are from integers, in units of a turn/2N.
 *
 * Pairs are in the order of their distance, the smallest first, so that a machine without vectors can add each pair
 * when its second sample comes. For odd H the middle sample is a pair with itself, of weight 1/2. */
#ifndef LB_HOP_H
#define LB_HOP_H

#include "real.h"

/* At most so many hops at once, and so many pairs of each. */
#define LB_COLUMNS 8
#define LB_PAIRS 64

/* Whole hops of one channel. */
typedef struct {
    const real *samples; /* [hops][hop] */
    size_t hops, hop, pairs, blocks, bins;
    const real *weights; /* [blocks][pairs][2][LB_BLOCK]: cos, sin */
    const real *turns;   /* [places][blocks][2][LB_BLOCK] */
    const real *ahead;   /* null: fixed phase; else [blocks][2][LB_BLOCK]: from the centre to the next hop */
    size_t place, places;
    real *ring;          /* [places][blocks][2][LB_BLOCK]: Q of the last window */
    real *sums;          /* [blocks][4][LB_BLOCK] */
    real *work;          /* [blocks][LB_COLUMNS][2][LB_BLOCK]: P, of longer hops */
    size_t first, every; /* hops before the first after which a row is due, and from row to row */
    real *out;           /* the first row due */
    const real *out_end;
} lb_hops;

typedef void lb_run_hops(const lb_hops *hops);

#endif
