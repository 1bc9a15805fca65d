/* Checks the arguments, and selects the function of the machine's instruction set. */
#include "matrices.h"

static lb_matrix_kernel *kernel_of(lb_instruction_set set)
{
    const lb_instruction_set best = lb_best_instruction_set();
    const lb_instruction_set chosen = set == LB_BEST ? best : set;
#ifdef LB_DISPATCH
    if (chosen == LB_AVX512 && best >= LB_AVX512) {
        return lb_matrix_avx512;
    }
    if (chosen == LB_AVX2 && best >= LB_AVX2) {
        return lb_matrix_avx2;
    }
#endif
    return chosen == LB_BASELINE ? lb_matrix_baseline : 0;
}

static int is_missing(const lb_matrix_history *h, const lb_matrix_windows *in, const lb_matrix_rows *out)
{
    const int inputs = h->spectrum && h->complete && h->work && in->spectrum && in->row && in->clean;
    const int outputs = out->value && out->noise && out->spread && out->coherence && out->condition && out->dof &&
                        out->complete && out->sure;
    return in->rows && !(inputs && outputs);
}

static int is_within(size_t number, size_t most) { return number && number <= most; }

static int fits(const lb_matrix_settings *s, const lb_matrix_history *h, const lb_matrix_windows *in)
{
    const size_t most = 1u << 20;
    if (!is_within(s->outputs, LB_MATRIX_MOST) || !is_within(s->inputs, LB_MATRIX_MOST) || !s->lines ||
        s->beside > most || !is_within(s->experiments, most) || !is_within(s->repetitions, most) ||
        !is_within(s->places, most)) {
        return 0;
    }
    const size_t remembered = s->experiments * s->repetitions;
    if (remembered > h->length / s->places || in->rows > h->length - remembered * s->places || in->stride < s->lines ||
        in->first >= h->length) {
        return 0;
    }
    for (size_t i = 0; i < in->rows; ++i) {
        if (in->row[i] < 0 || (uint64_t)in->row[i] >= in->of) {
            return 0;
        }
    }
    return 1;
}

lb_status lb_matrix_process(const lb_matrix_settings *settings, const lb_matrix_history *history,
                            const lb_matrix_windows *in, const lb_matrix_rows *out)
{
    if (!settings || !history || !in || !out || is_missing(history, in, out)) {
        return LB_ERROR_NULL;
    }
    if (!fits(settings, history, in)) {
        return LB_ERROR_SIZE;
    }
    lb_matrix_kernel *kernel = kernel_of(settings->set);
    if (!kernel) {
        return LB_ERROR_INSTRUCTION_SET;
    }
    const lb_matrix_job job = {settings, history, in, out};
    kernel(&job);
    return LB_OK;
}
