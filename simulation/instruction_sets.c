/* Chooses the version of a function for the processor. All have the same operations in the same order, without fused
 * multiplications, and so the same bits. */
#include "../kernel/src/processor.h"
#include "late.h"
#include "two_masses.h"

#define DECLARE(set) \
    extern void lb_late_##set(size_t, size_t, double, const double *, double *, double *); \
    extern void lb_two_masses_advance_##set(const lb_two_masses_course *, size_t, const lb_two_masses *, \
                                            const double *, size_t, double *, double *);
DECLARE(baseline)
DECLARE(avx2)
DECLARE(avx512)

typedef enum { BASELINE, AVX2, AVX512 } instruction_set;

static instruction_set best(void)
{
    if (lb_has_avx512()) return AVX512;
    return lb_has_avx2() ? AVX2 : BASELINE;
}

void lb_two_masses_advance(const lb_two_masses_course *course, size_t pairs, const lb_two_masses *pair,
                           const double *torque, size_t stride, double *motor, double *cart)
{
    switch (best()) {
    case AVX512: lb_two_masses_advance_avx512(course, pairs, pair, torque, stride, motor, cart); break;
    case AVX2: lb_two_masses_advance_avx2(course, pairs, pair, torque, stride, motor, cart); break;
    default: lb_two_masses_advance_baseline(course, pairs, pair, torque, stride, motor, cart);
    }
}

void lb_late(size_t rows, size_t ticks, double samples, const double *in, double *out, double *work)
{
    switch (best()) {
    case AVX512: lb_late_avx512(rows, ticks, samples, in, out, work); break;
    case AVX2: lb_late_avx2(rows, ticks, samples, in, out, work); break;
    default: lb_late_baseline(rows, ticks, samples, in, out, work);
    }
}
