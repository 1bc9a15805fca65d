/* Checks the arguments, and selects the functions of the machine's instruction set. */
#include "rows.h"

typedef struct {
    lb_line_kernel *lines;
    lb_sizes_kernel *sizes;
} kernels;

static kernels kernels_of(lb_instruction_set set)
{
    const lb_instruction_set best = lb_best_instruction_set();
    const lb_instruction_set chosen = set == LB_BEST ? best : set;
    const kernels baseline = {lb_lines_baseline, lb_sizes_baseline}, none = {0, 0};
#ifdef LB_DISPATCH
    const kernels avx2 = {lb_lines_avx2, lb_sizes_avx2}, avx512 = {lb_lines_avx512, lb_sizes_avx512};
    if (chosen == LB_AVX512 && best >= LB_AVX512) {
        return avx512;
    }
    if (chosen == LB_AVX2 && best >= LB_AVX2) {
        return avx2;
    }
#endif
    return chosen == LB_BASELINE ? baseline : none;
}

static int is_missing(const lb_line_windows *in, const lb_line_rows *out)
{
    const int inputs = in->output && in->denominator && in->reference && in->whole && in->clean && in->moment;
    const int errors = in->distortion ? in->verdict != 0 : !in->invalid;
    const int outputs = out->value && out->sigma && out->coherence && out->input_coherence && out->weight &&
                        out->distortion && out->valid && out->dof && out->moment && out->usable;
    return in->rows && !(inputs && errors && outputs);
}

static int has_unknown_verdict(const lb_line_windows *in)
{
    int found = 0;
    for (size_t row = 0; in->distortion && row < in->rows; ++row) {
        found |= in->verdict[row] < 0 || (uint64_t)in->verdict[row] >= in->verdicts;
    }
    return found;
}

lb_status lb_lines_process(const lb_line_weights *weights, const lb_line_moments *moments, double *largest,
                           const lb_line_settings *settings, const lb_line_windows *in, const lb_line_rows *out)
{
    if (!weights || !moments || !largest || !settings || !in || !out || is_missing(in, out)) {
        return LB_ERROR_NULL;
    }
    if (!moments->count || !moments->means || !moments->scatter || !moments->moment) {
        return LB_ERROR_NULL;
    }
    if (in->place >= moments->places || !moments->lines || in->stride < moments->lines || has_unknown_verdict(in) ||
        (weights->forgetting != 1.0 && !(weights->table && weights->length))) {
        return LB_ERROR_SIZE;
    }
    lb_line_kernel *kernel = kernels_of(settings->set).lines;
    if (!kernel) {
        return LB_ERROR_INSTRUCTION_SET;
    }
    const lb_line_job job = {weights, moments, settings, in, out};
    kernel(&job, largest);
    return LB_OK;
}

lb_status lb_largest_sizes(const double *x, size_t count, size_t begun, size_t window, lb_instruction_set set,
                           double *out)
{
    lb_sizes_kernel *kernel = kernels_of(set).sizes;
    if ((!x && count) || !out) {
        return LB_ERROR_NULL;
    }
    if (!begun || !window) {
        return LB_ERROR_SIZE;
    }
    if (!kernel) {
        return LB_ERROR_INSTRUCTION_SET;
    }
    kernel(x, count, begun, window, out);
    return LB_OK;
}
