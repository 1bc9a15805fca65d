/* Which inner kernel runs. With LB_DISPATCH the build holds several and the machine is asked. */
#include "state.h"

void LB(tile_baseline)(const lb_tile *tile);
void LB(tile_avx2)(const lb_tile *tile);
void LB(tile_avx512)(const lb_tile *tile);

lb_tile_function LB(tile_of)(lb_instruction_set set)
{
#ifdef LB_DISPATCH
    if (set == LB_AVX512 && __builtin_cpu_supports("avx512f")) {
        return LB(tile_avx512);
    }
    if (set == LB_AVX2 && __builtin_cpu_supports("avx2")) {
        return LB(tile_avx2);
    }
#endif
    return set == LB_BASELINE ? LB(tile_baseline) : 0;
}
