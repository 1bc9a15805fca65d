/* Selects the inner kernel. With LB_DISPATCH the build contains several, and the machine decides. */
#include "state.h"
#ifndef LB_SCALAR

extern const lb_kernel LB(kernel_baseline);
extern const lb_kernel LB(kernel_avx2);
extern const lb_kernel LB(kernel_avx512);

static const lb_kernel *kernel_of(lb_instruction_set set)
{
#ifdef LB_DISPATCH
    if (set == LB_AVX512 && lb_best_instruction_set() >= LB_AVX512) {
        return &LB(kernel_avx512);
    }
    if (set == LB_AVX2 && lb_best_instruction_set() >= LB_AVX2) {
        return &LB(kernel_avx2);
    }
#endif
    return set == LB_BASELINE ? &LB(kernel_baseline) : 0;
}

lb_status LB(choose)(LB_DFT *t, lb_instruction_set set)
{
    t->set = set == LB_BEST ? lb_best_instruction_set() : set;
    LB_ASSERT(t->set != LB_BEST);
    t->kernel = kernel_of(t->set);
    LB_ASSERT(set != LB_BEST || t->kernel); /* what the machine has, the build has */
    return t->kernel ? LB_OK : LB_ERROR_INSTRUCTION_SET;
}

#endif
