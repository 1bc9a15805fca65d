/* What depends on the instruction set. Private. */
#ifndef LB_LINE_ROWS_H
#define LB_LINE_ROWS_H

#include "livebode/lines.h"

typedef struct {
    const lb_line_weights *weights;
    const lb_line_moments *m;
    const lb_line_settings *s;
    const lb_line_windows *in;
    const lb_line_rows *out;
} lb_line_job;

typedef void lb_line_kernel(const lb_line_job *job, double *largest);

lb_line_kernel lb_lines_baseline, lb_lines_avx2, lb_lines_avx512;

#endif
