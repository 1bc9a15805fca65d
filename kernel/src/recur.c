/* The variants for comparison that never renew their sums. */
#include "state.h"

/* X_k(n) = (r·X_k(n−1) + x(n) − r^N·x(n−N))·e^(j2πk/N); r = 1 is Nevaranta 2016, eq. (4). */
void LB(recur)(const LB_DFT *t, size_t channel, const real *delta, size_t length)
{
    real *sums = lb_sums(t, channel);
    const real *row = lb_table_row(t, 1u);
    LB_ASSERT(!lb_renews(t->variant));
    LB_ASSERT(lb_apart(delta, length * sizeof(real), sums, t->blocks * 4 * LB_BLOCK * sizeof(real)));
    for (size_t i = 0; i < length; ++i) {
        for (size_t b = 0; b < t->inner_count; ++b) {
            real *x = sums + lb_sum_at(b);
            const real c = row[lb_cos_at(b)], s = row[lb_cos_at(b) + LB_BLOCK];
            const real re = t->radius * x[0] + delta[i], im = t->radius * x[LB_BLOCK];
            x[0] = re * c - im * s;
            x[LB_BLOCK] = im * c + re * s;
        }
    }
}
