/* What the processor of this x86-64 machine has, and its operating system saves. Private; also of simulation/. */
#ifndef LB_PROCESSOR_H
#define LB_PROCESSOR_H

#ifdef _WIN32
/* clang's library that answers __builtin_cpu_supports is not linked there; Windows knows the same. */
#include <cpuid.h>
__declspec(dllimport) int __stdcall IsProcessorFeaturePresent(unsigned long feature);
#define LB_WINDOWS_AVX2 40
#define LB_WINDOWS_AVX512F 41

static inline int lb_has_avx2(void) { return IsProcessorFeaturePresent(LB_WINDOWS_AVX2); }

static inline int lb_has_avx512(void)
{
    unsigned eax, ebx, ecx, edx;
    const int has_f = IsProcessorFeaturePresent(LB_WINDOWS_AVX512F);
    return has_f && __get_cpuid_count(7, 0, &eax, &ebx, &ecx, &edx) && ebx >> 31; /* AVX512VL */
}
#else
static inline int lb_has_avx2(void) { return __builtin_cpu_supports("avx2"); }

static inline int lb_has_avx512(void)
{
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl");
}
#endif

#endif
