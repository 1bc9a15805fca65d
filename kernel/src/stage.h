/* Rows past the caches. Private.
 *
 * A tile's rows are written block after block, a few lines of each row at a time. In a cache that costs nothing; from
 * memory the processor would have to fetch every line before it changes a part of it, at a third of the speed. Where
 * the rows of a call exceed the caches, a few rows are completed in a stage within the first-level cache instead, and
 * written in whole lines that are not fetched, while the next rows are computed in the stage's other half. */
#ifndef LB_STAGE_H
#define LB_STAGE_H

#include "state.h"

/* From here on this is faster (python -m bench.large_rows). */
#ifndef LB_STAGED_BYTES
#define LB_STAGED_BYTES (12u << 20)
#endif

#define LB_LINE (64u / sizeof(real))           /* reals of a line */
#define LB_STAGE_REALS (32768u / sizeof(real)) /* of half a stage */
#define LB_STAGE_FULL (24576u / sizeof(real))  /* used of it, as the first-level cache has other data too, except by */
#define LB_STAGE_ROWS 4u                       /* so many wide rows */

struct LB_STAGE {
    real halves[2][LB_STAGE_REALS + LB_LINE];
    unsigned half; /* where the next rows go */
    lb_move move;  /* what is left of the other half */
};

/* Samples of a tile whose rows fit: a power of two, so that tiles are divided without a rest. */
uint32_t LB(staged_length)(const LB_DFT *t);

/* A tile whose rows follow those that are in the stage. */
void LB(run_staged)(const LB_DFT *t, const lb_tile *tile, struct LB_STAGE *stage);

#endif
