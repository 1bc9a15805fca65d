/* The instruction set of this machine. One object for both number types. */
#include "livebode/sdft.h"
#ifdef LB_DISPATCH
#include "processor.h"
#endif

lb_instruction_set lb_best_instruction_set(void)
{
#ifdef LB_DISPATCH
    if (lb_has_avx512()) {
        return LB_AVX512;
    }
    if (lb_has_avx2()) {
        return LB_AVX2;
    }
#endif
    return LB_BASELINE;
}
