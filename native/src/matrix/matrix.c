/* Checks the arguments, and selects the function of the machine's instruction set. */
#include "lines/choice.h"
#include "matrices.h"

static lb_matrix_kernel *const kernels[] = LB_BY_SET(lb_matrix);

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
    lb_matrix_kernel *kernel = kernels[lb_choice(settings->set)];
    if (!kernel) {
        return LB_ERROR_INSTRUCTION_SET;
    }
    const lb_matrix_job job = {settings, history, in, out};
    kernel(&job);
    return LB_OK;
}
