/* Recursive least squares with 6 parameters: ARX, y(n) from y(n−1 … n−3) and u(n−1 … n−3), as bench/native/rls.c. */
#ifndef RLS_H
#define RLS_H

#if LB_BITS == 64
typedef double rls_real;
#else
typedef float rls_real;
#endif

enum { RLS_PARAMETERS = 6, RLS_TRIANGLE = 21 };

typedef struct {
    rls_real covariance[RLS_TRIANGLE]; /* the upper triangle, row after row */
    rls_real theta[RLS_PARAMETERS], phi[RLS_PARAMETERS];
    rls_real forgetting, kept; /* λ, 1/λ */
} rls;

void rls_begin(rls *r, rls_real forgetting);
void rls_push(rls *r, rls_real u, rls_real y);

#endif
