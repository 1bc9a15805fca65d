/* Neighbouring lines of a row, LB_LANES at a time: vectors in the language of gcc and clang, or one number. Private.
 *
 * Each lane computes as a number alone would, so the width changes no bit. Of the last lines of a row only `count` are
 * loaded, zeros for the others, and only they are stored. */
#ifndef LB_LANES_H
#define LB_LANES_H

#include <stddef.h>
#include <stdint.h>

#if !defined(LB_SCALAR) && !(defined(__GNUC__) || defined(__clang__))
#define LB_SCALAR 1
#endif

#ifdef LB_SCALAR
#define LB_LANES 1u
#elif defined(__AVX512F__)
#define LB_LANES 8u
#elif defined(__AVX2__)
#define LB_LANES 4u
#else
#define LB_LANES 2u
#endif

#if defined(__AVX2__) && !defined(LB_SCALAR)
#include <immintrin.h>
#endif
#if !(defined(__GNUC__) || defined(__clang__))
#include <math.h>
#endif

#ifndef LB_INLINE
#ifdef LB_SCALAR
#define LB_INLINE static inline
#else
#define LB_INLINE static inline __attribute__((always_inline))
#endif
#endif

#ifdef LB_SCALAR

typedef double lb_lanes;
typedef int64_t lb_mask; /* 0 or −1 */

LB_INLINE lb_mask lb_no_lane(void) { return 0; }
LB_INLINE lb_mask lb_above(lb_lanes a, lb_lanes b) { return -(lb_mask)(a > b); }
LB_INLINE lb_mask lb_equal(lb_lanes a, lb_lanes b) { return -(lb_mask)(a == b); }
LB_INLINE lb_lanes lb_all(double x) { return x; }
LB_INLINE lb_lanes lb_select(lb_mask which, lb_lanes one, lb_lanes other) { return which ? one : other; }
LB_INLINE lb_lanes lb_load(const double *p, size_t count) { return count ? *p : 0.0; }

LB_INLINE void lb_store(double *p, lb_lanes x, size_t count)
{
    if (count) {
        *p = x;
    }
}

LB_INLINE void lb_load_pairs(const double *p, size_t count, lb_lanes *re, lb_lanes *im)
{
    *re = count ? p[0] : 0.0;
    *im = count ? p[1] : 0.0;
}

LB_INLINE void lb_store_pairs(double *p, lb_lanes re, lb_lanes im, size_t count)
{
    lb_store(p, re, count);
    lb_store(p + 1, im, count);
}

LB_INLINE double lb_lane(const lb_lanes *x, size_t i)
{
    (void)i;
    return *x;
}

LB_INLINE void lb_set_lane(lb_lanes *x, size_t i, double value)
{
    (void)i;
    *x = value;
}

#else

typedef double lb_lanes __attribute__((vector_size(LB_LANES * sizeof(double)), may_alias));
typedef double lb_loose_lanes __attribute__((vector_size(LB_LANES * sizeof(double)), may_alias, aligned(8)));
#if defined(__AVX512F__)
typedef uint32_t lb_mask; /* a bit for each lane, and above them any */
#else
typedef int64_t lb_mask __attribute__((vector_size(LB_LANES * sizeof(double)), may_alias));
#endif

#if defined(__clang__) || __GNUC__ >= 12
#define LB_PICK(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#else
#define LB_PICK(a, b, ...) __builtin_shuffle(a, b, (lb_mask){__VA_ARGS__})
#endif

#if defined(__AVX512F__)
#define LB_REALS 0, 2, 4, 6, 8, 10, 12, 14
#define LB_IMAGINARIES 1, 3, 5, 7, 9, 11, 13, 15
#define LB_PAIRS 0, 8, 1, 9, 2, 10, 3, 11
#define LB_MORE_PAIRS 4, 12, 5, 13, 6, 14, 7, 15
#elif defined(__AVX2__)
#define LB_REALS 0, 2, 4, 6
#define LB_IMAGINARIES 1, 3, 5, 7
#define LB_PAIRS 0, 4, 1, 5
#define LB_MORE_PAIRS 2, 6, 3, 7
#else
#define LB_REALS 0, 2
#define LB_IMAGINARIES 1, 3
#define LB_PAIRS 0, 2
#define LB_MORE_PAIRS 1, 3
#endif

LB_INLINE lb_lanes lb_all(double x) { return (lb_lanes){0} + x; }

#if defined(__AVX512F__)
LB_INLINE lb_mask lb_no_lane(void) { return 0u; }
LB_INLINE lb_mask lb_above(lb_lanes a, lb_lanes b) { return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_GT_OQ); }
LB_INLINE lb_mask lb_equal(lb_lanes a, lb_lanes b) { return _mm512_cmp_pd_mask((__m512d)a, (__m512d)b, _CMP_EQ_OQ); }

LB_INLINE lb_lanes lb_select(lb_mask which, lb_lanes one, lb_lanes other)
{
    return (lb_lanes)_mm512_mask_blend_pd((__mmask8)which, (__m512d)other, (__m512d)one);
}
#else
LB_INLINE lb_mask lb_no_lane(void) { return (lb_mask){0}; }
LB_INLINE lb_mask lb_above(lb_lanes a, lb_lanes b) { return (lb_mask)(a > b); }
LB_INLINE lb_mask lb_equal(lb_lanes a, lb_lanes b) { return (lb_mask)(a == b); }

LB_INLINE lb_lanes lb_select(lb_mask which, lb_lanes one, lb_lanes other)
{
    return (lb_lanes)((which & (lb_mask)one) | (~which & (lb_mask)other));
}
#endif

#if defined(__AVX512F__)
LB_INLINE __mmask8 lb_first(size_t count) { return (__mmask8)((1u << count) - 1u); }
#elif defined(__AVX2__)
LB_INLINE __m256i lb_first(size_t count) { return (__m256i)((lb_mask){0, 1, 2, 3} < (int64_t)count); }
#endif

LB_INLINE lb_lanes lb_load(const double *p, size_t count)
{
    if (count >= LB_LANES) {
        return *(const lb_loose_lanes *)(const void *)p;
    }
#if defined(__AVX512F__)
    return (lb_lanes)_mm512_maskz_loadu_pd(lb_first(count), p);
#elif defined(__AVX2__)
    return (lb_lanes)_mm256_maskload_pd(p, lb_first(count));
#else
    return (lb_lanes){count ? *p : 0.0};
#endif
}

LB_INLINE void lb_store(double *p, lb_lanes x, size_t count)
{
    if (count >= LB_LANES) {
        *(lb_loose_lanes *)(void *)p = (lb_loose_lanes)x;
        return;
    }
#if defined(__AVX512F__)
    _mm512_mask_storeu_pd(p, lb_first(count), (__m512d)x);
#elif defined(__AVX2__)
    _mm256_maskstore_pd(p, lb_first(count), (__m256d)x);
#else
    if (count) {
        *p = x[0];
    }
#endif
}

LB_INLINE size_t lb_rest(size_t numbers) { return numbers > LB_LANES ? numbers - LB_LANES : 0u; }

LB_INLINE void lb_load_pairs(const double *p, size_t count, lb_lanes *re, lb_lanes *im)
{
    const lb_lanes one = lb_load(p, 2u * count), other = lb_load(p + LB_LANES, lb_rest(2u * count));
    *re = LB_PICK(one, other, LB_REALS);
    *im = LB_PICK(one, other, LB_IMAGINARIES);
}

LB_INLINE void lb_store_pairs(double *p, lb_lanes re, lb_lanes im, size_t count)
{
    lb_store(p, LB_PICK(re, im, LB_PAIRS), 2u * count);
    lb_store(p + LB_LANES, LB_PICK(re, im, LB_MORE_PAIRS), lb_rest(2u * count));
}

LB_INLINE double lb_lane(const lb_lanes *x, size_t i) { return (*x)[i]; }
LB_INLINE void lb_set_lane(lb_lanes *x, size_t i, double value) { (*x)[i] = value; }

#endif

LB_INLINE lb_mask lb_are_numbers(lb_lanes x) { return lb_equal(x, x); }
LB_INLINE lb_mask lb_are_finite(lb_lanes x) { return lb_equal(x - x, lb_all(0.0)); }

/* As numpy.maximum: NaN where one of them is; as numpy.fmax: NaN where both are; and for a bound that is a number. */
LB_INLINE lb_lanes lb_larger(lb_lanes a, lb_lanes b)
{
    return lb_select(lb_above(b, a) | (lb_are_numbers(a) & ~lb_are_numbers(b)), b, a);
}
LB_INLINE lb_lanes lb_known_larger(lb_lanes a, lb_lanes b)
{
    return lb_select(lb_above(b, a) | (lb_are_numbers(b) & ~lb_are_numbers(a)), b, a);
}
LB_INLINE lb_lanes lb_at_least(double bound, lb_lanes x)
{
    return lb_select(lb_above(lb_all(bound), x), lb_all(bound), x);
}

/* Of lanes that are not negative; NaN where one is. As integers, which have this order, there is no branch to predict.
 */
LB_INLINE double lb_largest_lane(lb_lanes x)
{
    union {
        lb_lanes together;
        uint64_t each[LB_LANES];
        double most;
    } found = {x};
    uint64_t most = 0;
    for (size_t i = 0; i < LB_LANES; ++i) {
        const uint64_t size = found.each[i] & UINT64_MAX >> 1; /* a NaN may have a sign */
        most = size > most ? size : most;
    }
    found.each[0] = most;
    return found.most;
}

/* Exactly rounded. */
LB_INLINE lb_lanes lb_roots(lb_lanes x)
{
#if defined(LB_SCALAR) && (defined(__GNUC__) || defined(__clang__))
    return __builtin_sqrt(x);
#elif defined(LB_SCALAR)
    return sqrt(x);
#elif defined(__AVX512F__)
    return (lb_lanes)_mm512_sqrt_pd((__m512d)x);
#elif defined(__AVX2__)
    return (lb_lanes)_mm256_sqrt_pd((__m256d)x);
#else
    return (lb_lanes){__builtin_sqrt(x[0]), __builtin_sqrt(x[1])};
#endif
}

/* Flags of one byte. */
#ifdef LB_SCALAR
LB_INLINE lb_mask lb_load_flags(const uint8_t *p, size_t count) { return count ? -(lb_mask)(*p != 0) : 0; }

LB_INLINE void lb_store_flags(uint8_t *p, lb_mask x, size_t count)
{
    if (count) {
        *p = (uint8_t)(x & 1);
    }
}
#else
typedef int8_t lb_bytes __attribute__((vector_size(LB_LANES)));
typedef int64_t lb_whole __attribute__((vector_size(LB_LANES * sizeof(int64_t)), may_alias));
typedef union {
    lb_bytes together;
    uint8_t each[LB_LANES];
} lb_flags;

LB_INLINE lb_mask lb_load_flags(const uint8_t *p, size_t count)
{
    lb_flags found = {{0}};
    for (size_t i = 0; i < LB_LANES && i < count; ++i) {
        found.each[i] = p[i];
    }
#if defined(__AVX512F__)
    const __m512i wide = (__m512i) __builtin_convertvector(found.together, lb_whole);
    return _mm512_test_epi64_mask(wide, wide);
#else
    return __builtin_convertvector((lb_bytes)(found.together != 0), lb_mask);
#endif
}

LB_INLINE void lb_store_flags(uint8_t *p, lb_mask x, size_t count)
{
#if defined(__AVX512F__)
    const lb_whole wide = (lb_whole)_mm512_maskz_set1_epi64((__mmask8)x, 1);
#else
    const lb_whole wide = x & 1;
#endif
    const lb_flags found = {__builtin_convertvector(wide, lb_bytes)};
    for (size_t i = 0; i < LB_LANES && i < count; ++i) {
        p[i] = found.each[i];
    }
}
#endif

#endif
