/* Checks the arguments, and selects the functions of the machine's instruction set. */
#include "choice.h"
#include "rows.h"

static lb_line_kernel *const kernels[] = LB_BY_SET(lb_lines);

static int is_missing(const lb_line_windows *in, const lb_line_rows *out)
{
    const int inputs = in->output && in->denominator && in->reference && in->whole && in->clean && in->moment;
    const int errors = in->distortion ? in->verdict != 0 : !in->invalid;
    const int outputs = out->value && out->sigma && out->coherence && out->input_coherence && out->weight &&
                        out->distortion && out->variation && out->valid && out->dof && out->moment && out->usable;
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
    if (!moments->count || !moments->means || !moments->scatter || !moments->change || !moments->moment) {
        return LB_ERROR_NULL;
    }
    if (in->place >= moments->places || !moments->lines || in->stride < moments->lines || has_unknown_verdict(in) ||
        (weights->forgetting != 1.0 && !(weights->table && weights->length))) {
        return LB_ERROR_SIZE;
    }
    lb_line_kernel *kernel = kernels[lb_choice(settings->set)];
    if (!kernel) {
        return LB_ERROR_INSTRUCTION_SET;
    }
    const lb_line_job job = {weights, moments, settings, in, out};
    kernel(&job, largest);
    return LB_OK;
}
