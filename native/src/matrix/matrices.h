/* What depends on the instruction set. Private. */
#ifndef LB_MATRIX_MATRICES_H
#define LB_MATRIX_MATRICES_H

#include "livebode/matrix.h"

typedef struct {
    const lb_matrix_settings *s;
    const lb_matrix_history *h;
    const lb_matrix_windows *in;
    const lb_matrix_rows *out;
} lb_matrix_job;

typedef void lb_matrix_kernel(const lb_matrix_job *job);

lb_matrix_kernel lb_matrix_baseline, lb_matrix_avx2, lb_matrix_avx512;

#endif
