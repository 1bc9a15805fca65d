/* Selects the inner kernel. With LB_DISPATCH the build contains several, and the machine decides. */
#include "state.h"
#ifndef LB_SCALAR

extern const lb_kernel LB(kernel_baseline);
extern const lb_kernel LB(kernel_avx2);
extern const lb_kernel LB(kernel_avx512);
extern lb_run_hops LB(hops_baseline), LB(hops_avx2), LB(hops_avx512);

static void find(LB_DFT *t)
{
#ifdef LB_DISPATCH
    if (t->set == LB_AVX512 && lb_best_instruction_set() >= LB_AVX512) {
        t->kernel = &LB(kernel_avx512);
        t->run_hops = LB(hops_avx512);
        return;
    }
    if (t->set == LB_AVX2 && lb_best_instruction_set() >= LB_AVX2) {
        t->kernel = &LB(kernel_avx2);
        t->run_hops = LB(hops_avx2);
        return;
    }
#endif
    t->kernel = t->set == LB_BASELINE ? &LB(kernel_baseline) : 0;
    t->run_hops = LB(hops_baseline);
}

lb_status LB(choose)(LB_DFT *t, lb_instruction_set set)
{
    t->set = set == LB_BEST ? lb_best_instruction_set() : set;
    LB_ASSERT(t->set != LB_BEST);
    find(t);
    LB_ASSERT(set != LB_BEST || t->kernel); /* what the machine has, the build has */
    return t->kernel ? LB_OK : LB_ERROR_INSTRUCTION_SET;
}

#endif
