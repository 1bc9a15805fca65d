/* What depends on the instruction set. Private. */
#ifndef LB_LINE_ROWS_H
#define LB_LINE_ROWS_H

#include "livebode/lines.h"
#include "livebode/sizes.h"

typedef struct {
    const lb_line_weights *weights;
    const lb_line_moments *m;
    const lb_line_settings *s;
    const lb_line_windows *in;
    const lb_line_rows *out;
} lb_line_job;

typedef void lb_line_kernel(const lb_line_job *job, double *largest);

typedef void lb_sizes_kernel(const double *x, size_t count, size_t begun, size_t window, double *out);

lb_line_kernel lb_lines_baseline, lb_lines_avx2, lb_lines_avx512;
lb_sizes_kernel lb_sizes_baseline, lb_sizes_avx2, lb_sizes_avx512;

#endif
