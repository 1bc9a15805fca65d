/* The table of twiddles, in rows or compact, and its rows. */
#include "state.h"
#include "twiddle.h"

static void fill_rows(LB_DFT *t)
{
    for (size_t i = 0; i < t->blocks * LB_BLOCK; ++i) {
        const uint32_t k = i < t->inner_count ? t->bins[i] : 0u;
        real *at = t->table + lb_cos_at(i);
        LB_ASSERT(k < t->window);
        uint32_t r = 0; /* k·j mod N, without the product */
        for (uint32_t j = 0; j <= t->half; ++j, at += t->row_length) {
            double cosine, sine;
            LB_ASSERT(r == (uint64_t)k * j % t->window);
            lb_twiddle(r, t->window, &cosine, &sine);
            at[0] = (real)cosine;
            at[LB_BLOCK] = (real)sine;
            r = r < t->window - k ? r + k : r - (t->window - k);
        }
    }
}

static void fill_compact(LB_DFT *t)
{
    LB_ASSERT(t->window <= LB_COMPACT_WINDOW_MAX && t->rows);
    for (uint32_t r = 0; r < t->window; ++r) {
        double cosine, sine;
        lb_twiddle(r, t->window, &cosine, &sine);
        t->table[2u * r] = (real)cosine;
        t->table[2u * r + 1u] = (real)sine;
    }
    for (size_t i = 0; i < (LB_TILE + 1u) * t->row_length; ++i) {
        t->rows[i] = 0; /* places without a bin are never gathered */
    }
}

void LB(fill_table)(LB_DFT *t)
{
    LB_ASSERT(lb_laid_out(t));
    if (t->compact) {
        fill_compact(t);
    } else {
        fill_rows(t);
    }
}

const real *LB(gathered)(const LB_DFT *t, uint32_t number, size_t place)
{
    real *row = t->rows + place * t->row_length;
    const uint32_t N = t->window, *k = t->bins;
    LB_ASSERT(t->compact && number <= t->half && place <= LB_TILE);
    const real *table = t->table;
    for (size_t b = 0; b < t->inner_count; ++b) {
        const real *twiddle = table + 2u * (k[b] * number % N); /* < LB_COMPACT_WINDOW_MAX², halved */
        LB_ASSERT(twiddle[0] >= -1 && twiddle[0] <= 1 && twiddle[1] >= -1 && twiddle[1] <= 1);
        row[lb_cos_at(b)] = twiddle[0];
        row[lb_cos_at(b) + LB_BLOCK] = twiddle[1];
    }
    return row;
}
