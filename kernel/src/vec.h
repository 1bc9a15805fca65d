/* Vectors of LB_LANES numbers, in the language of gcc and clang. Private. */
#ifndef LB_VEC_H
#define LB_VEC_H

#include "real.h"

#ifdef LB_LANES
#elif defined(__AVX512F__)
#define LB_LANES (512 / LB_BITS)
#elif defined(__AVX2__)
#define LB_LANES (256 / LB_BITS)
#else
#define LB_LANES (128 / LB_BITS)
#endif

/* Calls where speed does not matter: with the sanitizers' checks, inlining gives objects of megabytes. */
#ifndef LB_INLINE
#define LB_INLINE static inline __attribute__((always_inline))
#endif

typedef real vec __attribute__((vector_size(LB_LANES * sizeof(real)), may_alias));
typedef real loose_vec __attribute__((vector_size(LB_LANES * sizeof(real)), may_alias, aligned(sizeof(real))));

LB_INLINE vec lb_load(const real *p) { return *(const vec *)(const void *)p; }
LB_INLINE void lb_store(real *p, vec v) { *(vec *)(void *)p = v; }

#if defined(__clang__) || __GNUC__ >= 12
#define LB_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
typedef lb_lane_index lanes __attribute__((vector_size(LB_LANES * sizeof(real))));
#define LB_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, (lanes){__VA_ARGS__})
#endif

#if LB_BITS == 64 && LB_LANES == 8
#define LB_LOW 0, 8, 2, 10, 4, 12, 6, 14
#define LB_REVERSED 7, 6, 5, 4, 3, 2, 1, 0
#define LB_HIGH 1, 9, 3, 11, 5, 13, 7, 15
#elif LB_BITS == 64 && LB_LANES == 4
#define LB_LOW 0, 4, 2, 6
#define LB_REVERSED 3, 2, 1, 0
#define LB_HIGH 1, 5, 3, 7
#elif LB_BITS == 64
#define LB_LOW 0, 2
#define LB_REVERSED 1, 0
#define LB_HIGH 1, 3
#elif LB_LANES == 16
#define LB_REVERSED 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0
#define LB_LOW 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29
#define LB_HIGH 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31
#elif LB_LANES == 8
#define LB_REVERSED 7, 6, 5, 4, 3, 2, 1, 0
#define LB_LOW 0, 8, 1, 9, 4, 12, 5, 13
#define LB_HIGH 2, 10, 3, 11, 6, 14, 7, 15
#else
#define LB_REVERSED 3, 2, 1, 0
#define LB_LOW 0, 4, 1, 5
#define LB_HIGH 2, 6, 3, 7
#endif

/* re and im of LB_LANES slots as pairs: the low halves of the 128-bit lanes are bins of the block's first half,
 * the high halves of its second (lb_slot). `out` is the destination of the first of them. */
LB_INLINE void lb_store_pairs(real *out, vec re, vec im)
{
    *(loose_vec *)(void *)out = (loose_vec)LB_SHUFFLE(re, im, LB_LOW);
    *(loose_vec *)(void *)(out + LB_BLOCK) = (loose_vec)LB_SHUFFLE(re, im, LB_HIGH);
}

#if defined(__clang__)
#define LB_UNROLL_4 _Pragma("clang loop unroll_count(4)")
#define LB_UNROLL_8 _Pragma("clang loop unroll_count(8)")
#elif defined(__GNUC__)
#define LB_UNROLL_4 _Pragma("GCC unroll 4")
#define LB_UNROLL_8 _Pragma("GCC unroll 8")
#else
#define LB_UNROLL_4
#define LB_UNROLL_8
#endif

#if defined(__AVX512VL__) || defined(__aarch64__)
#define LB_MANY_REGISTERS 1
#else
#define LB_MANY_REGISTERS 0
#endif

/* Blocks processed at once: enough independent sums to hide the adder's latency, few enough for the registers. */
#ifndef LB_ABREAST
#if LB_LANES == LB_BLOCK
#define LB_ABREAST 2
#else
#define LB_ABREAST 1
#endif
#endif

#endif
