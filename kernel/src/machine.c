/* The instruction set of this machine. One object for both number types. */
#include "livebode/sdft.h"

lb_instruction_set lb_best_instruction_set(void)
{
#ifdef LB_DISPATCH
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) {
        return LB_AVX512;
    }
    if (__builtin_cpu_supports("avx2")) {
        return LB_AVX2;
    }
#endif
    return LB_BASELINE;
}
