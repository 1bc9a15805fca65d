/* What is written of some lines of a row. Private. */
#ifndef LB_LINE_RESULTS_H
#define LB_LINE_RESULTS_H

#include "facts.h"

/* Some lines of a row. */
typedef struct {
    lb_lanes re, im, inverse; /* the value, and 1/|denominator|² */
    lb_lanes variance, variation, distortion;
    lb_mask valid;
} lb_estimates;

/* γ² of the reference and another signal, S_rx/(S_rr·S_xx), Nevaranta 2016, eq. (18), without its bias of (1 − γ²)/m
 * over m periods. */
LB_INLINE lb_lanes lb_coherence_of(const lb_lanes *cross, lb_lanes reference, lb_lanes other, const lb_row_facts *f,
                                   lb_mask valid)
{
    const lb_lanes squared = cross[0] * cross[0] + cross[1] * cross[1];
    const lb_lanes coherence = squared / (reference * other);
    const lb_lanes found = lb_at_least(0.0, 1.0 - (1.0 - coherence) * f->of->bias);
    return lb_select(valid, found, lb_all(LB_NOT_A_NUMBER));
}

LB_INLINE void lb_write_coherence(const lb_line_job *j, const lb_row_facts *f, const lb_some_moments *m, lb_mask valid,
                                  size_t to, size_t count)
{
    lb_lanes found = lb_all(LB_NOT_A_NUMBER), of_input = found;
    if (f->several) {
        const lb_lanes reference = m->mean[REF_POWER];
        found = lb_coherence_of(m->mean + NUM_RE, reference, m->mean[OUT_POWER], f, valid);
        if (!j->s->direct) {
            of_input = lb_coherence_of(m->mean + DEN_RE, reference, m->mean[DEN_POWER], f, valid);
        }
    }
    lb_store(j->out->coherence + to, found, count);
    lb_store(j->out->input_coherence + to, of_input, count);
}

/* Weight of a response in a mean, so that the mean is a ratio of averages: U/W, for the direct estimator |U|². */
LB_INLINE void lb_write_weight(const lb_line_job *j, const lb_some_moments *m, const lb_window *now, lb_mask valid,
                               double *out, size_t count)
{
    lb_lanes re = now->of[REF_POWER], im = lb_all(0.0);
    if (!j->s->direct) {
        const lb_lanes *pair = j->s->averages ? m->mean : now->of;
        re = pair[DEN_RE] / pair[REF_POWER];
        im = pair[DEN_IM] / pair[REF_POWER];
    }
    const lb_lanes nothing = lb_all(LB_NOT_A_NUMBER);
    lb_store_pairs(out, lb_select(valid, re, nothing), lb_select(valid, im, nothing), count);
}

/* A line that is invalid because of an error that repeats has an infinite one. */
LB_INLINE lb_mask lb_write_verdicts(const lb_line_job *j, const lb_row_facts *f, size_t first, size_t to, size_t count,
                                    const lb_estimates *e)
{
    lb_lanes distortion = lb_select(e->valid, e->distortion, lb_all(LB_NOT_A_NUMBER));
    lb_mask valid = e->valid;
    if (j->in->invalid) {
        const size_t at = (size_t)j->in->verdict[f->row] * j->m->lines + first;
        const lb_mask against = lb_load_flags(j->in->invalid + at, count);
        distortion = lb_select(valid & against, lb_all(LB_INFINITE), distortion);
        valid = valid & ~against;
    }
    lb_store(j->out->distortion + to, distortion, count);
    lb_store_flags(j->out->valid + to, valid, count);
    return valid;
}

LB_INLINE void lb_write_results(const lb_line_job *j, const lb_row_facts *f, size_t first, size_t count,
                                const lb_some_moments *m, const lb_window *now, const lb_estimates *e)
{
    const lb_line_rows *out = j->out;
    const size_t to = f->row * j->m->lines + first;
    const lb_mask valid = lb_write_verdicts(j, f, first, to, count, e);
    const lb_lanes nothing = lb_all(LB_NOT_A_NUMBER);
    lb_store_pairs(out->value + 2u * to, lb_select(valid, e->re, nothing), lb_select(valid, e->im, nothing), count);
    lb_store(out->sigma + to, lb_roots(lb_select(valid, e->variance, nothing)), count);
    lb_store(out->variation + to, lb_roots(lb_select(valid, e->variation, nothing)), count);
    lb_write_weight(j, m, now, valid, out->weight + 2u * to, count);
    lb_write_coherence(j, f, m, valid, to, count);
}

#endif
