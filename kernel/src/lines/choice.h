/* One function for each instruction set, and which of them this machine has. Private; also of native/. */
#ifndef LB_CHOICE_H
#define LB_CHOICE_H

#include "livebode/sdft.h"

/* Functions by instruction set; none for LB_BEST. */
#ifdef LB_DISPATCH
#define LB_BY_SET(name) {0, name##_baseline, name##_avx2, name##_avx512}
#else
#define LB_BY_SET(name) {0, name##_baseline}
#endif

/* The place of a set in them: that of no function if the machine does not have it. */
static inline lb_instruction_set lb_choice(lb_instruction_set set)
{
    const lb_instruction_set best = lb_best_instruction_set();
    const lb_instruction_set chosen = set == LB_BEST ? best : set;
    return chosen <= best ? chosen : LB_BEST;
}

#endif
