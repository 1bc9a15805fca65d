#include "rls.h"

#define P RLS_PARAMETERS

/* Place of (i, j), i ≤ j, in the triangle. */
static inline int at(int i, int j) { return i * P - i * (i + 1) / 2 + j; }

void rls_begin(rls *r, rls_real forgetting)
{
    for (int i = 0; i < P; ++i) {
        for (int j = i; j < P; ++j) {
            r->covariance[at(i, j)] = i == j ? (rls_real)1000 : (rls_real)0;
        }
        r->theta[i] = r->phi[i] = 0;
    }
    r->forgetting = forgetting;
    r->kept = 1 / forgetting;
}

/* All loops unrolled: places are constants. g_i·g_j is formed before it is scaled, so that the covariance does not
 * explode within 3e4 samples. */
void rls_push(rls *r, rls_real u, rls_real y)
{
    rls_real g[P], against = r->forgetting, error = y;
    _Pragma("GCC unroll 6")
    for (int i = 0; i < P; ++i) {
        rls_real sum = 0;
        _Pragma("GCC unroll 6")
        for (int j = 0; j < P; ++j) {
            sum += r->covariance[i < j ? at(i, j) : at(j, i)] * r->phi[j];
        }
        g[i] = sum;
        against += sum * r->phi[i];
        error -= r->theta[i] * r->phi[i];
    }
    const rls_real scale = 1 / against, gain = error * scale;
    _Pragma("GCC unroll 6")
    for (int i = 0; i < P; ++i) {
        r->theta[i] += g[i] * gain;
        _Pragma("GCC unroll 6")
        for (int j = i; j < P; ++j) {
            r->covariance[at(i, j)] = (r->covariance[at(i, j)] - (g[i] * g[j]) * scale) * r->kept;
        }
    }
    r->phi[2] = r->phi[1], r->phi[1] = r->phi[0], r->phi[0] = -y;
    r->phi[5] = r->phi[4], r->phi[4] = r->phi[3], r->phi[3] = u;
}
