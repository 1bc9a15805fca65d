/* The stage of rows that go past the caches: stage.h. */
#include "stage.h"
#ifndef LB_SCALAR

uint32_t LB(staged_length)(const LB_DFT *t)
{
    uint32_t rows = LB_DENSE_TILE;
    while (rows > LB_STAGE_ROWS && rows * 2u * (size_t)t->inner_count > LB_STAGE_FULL) {
        rows /= 2u;
    }
    return rows;
}

int LB(staged)(const LB_DFT *t, const lb_rows_due *due)
{
#ifdef __SSE2__
    return due->hop == 1 && t->channels * due->channel_reals >= LB_STAGED_BYTES / sizeof(real) &&
           LB_STAGE_ROWS * 2u * (size_t)t->inner_count <= LB_STAGE_REALS;
#else
    (void)t;
    (void)due;
    return 0; /* a compiler that has no such stores */
#endif
}

/* The rows of one channel that are complete in the stage: lines that begin or end among other rows at once, the others
 * while the next tile is computed. */
static void leave(struct LB_STAGE *s, real *out, const real *rows, size_t length)
{
    const size_t before = (LB_LINE - (uintptr_t)out / sizeof(real) % LB_LINE) % LB_LINE;
    const size_t head = lb_smaller(before, length), whole = (length - head) / LB_LINE * LB_LINE;
    for (size_t i = 0; i < head; ++i) {
        out[i] = rows[i];
    }
    for (size_t i = head + whole; i < length; ++i) {
        out[i] = rows[i];
    }
    s->move.from = rows + head;
    s->move.end = rows + head + whole;
    s->move.to = out + head;
}

void LB(run_staged)(const LB_DFT *t, const lb_tile *tile, struct LB_STAGE *s)
{
    const size_t length = tile->length * 2 * tile->bins;
    LB_ASSERT(tile->hop == 1 && tile->length <= LB(staged_length)(t) && length <= LB_STAGE_REALS);
    for (size_t c = 0; c < tile->channels; ++c) {
        real *out = tile->out + c * tile->out_step;
        lb_tile one = *tile;
        one.channels = 1;
        one.sums += c * tile->blocks * 4 * LB_BLOCK;
        one.line += c * tile->line_step;
        one.delta += c * 3 * LB_TILE;
        one.out = s->halves[s->half] + (uintptr_t)out / sizeof(real) % LB_LINE; /* lines as in the rows */
        one.out_end = one.out + length;
        one.move = &s->move;
        __builtin_prefetch(out + length - 1, 1); /* the last line, which is not written as a whole */
        t->kernel->run(&one);
        t->kernel->finish(&s->move);
        leave(s, out, one.out, length);
        s->half ^= 1u;
    }
}

void LB(staged_rows)(LB_DFT *t, lb_input *in, size_t length, lb_rows_due due)
{
    struct LB_STAGE stage __attribute__((aligned(64)));
    stage.half = 0;
    stage.move.from = stage.move.end = stage.halves[1];
    stage.move.to = 0;
    due.stage = &stage;
    LB(fused_rows)(t, in, length, due);
    t->kernel->finish(&stage.move);
#ifdef __SSE2__
    __builtin_ia32_sfence(); /* before what another thread is told about these rows */
#endif
}

#endif
