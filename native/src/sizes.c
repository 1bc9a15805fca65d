/* The largest sample of each stretch. Compiled once for each instruction set; with the baseline also the choice. */
#include "livebode/sizes.h"

#include "lb_assert.h"
#include "lines/choice.h"
#include "lines/lanes.h"

#ifndef LB_SIZES_NAME
#define LB_SIZES_NAME lb_sizes_baseline
#define LB_WITH_CHOICE
#endif

typedef void lb_sizes_kernel(const double *x, size_t count, size_t begun, size_t window, double *out);

lb_sizes_kernel lb_sizes_baseline, lb_sizes_avx2, lb_sizes_avx512;

#define ABREAST 4u /* independent maxima, which hide the latency of one */

/* Of zeros the positive one. */
LB_INLINE lb_lanes sizes_of(lb_lanes x) { return lb_select(lb_above(x, lb_all(0.0)), x, 0.0 - x); }

static double largest(const double *x, size_t count)
{
    lb_lanes most[ABREAST] = {lb_all(0.0), lb_all(0.0), lb_all(0.0), lb_all(0.0)};
    size_t i = 0;
    for (; count - i >= ABREAST * LB_LANES; i += ABREAST * LB_LANES) {
        for (size_t k = 0; k < ABREAST; ++k) {
            most[k] = lb_larger(most[k], sizes_of(lb_load(x + i + k * LB_LANES, LB_LANES)));
        }
    }
    for (; i < count; i += LB_LANES) {
        most[0] = lb_larger(most[0], sizes_of(lb_load(x + i, count - i)));
    }
    return lb_largest_lane(lb_larger(lb_larger(most[0], most[1]), lb_larger(most[2], most[3])));
}

void LB_SIZES_NAME(const double *x, size_t count, size_t begun, size_t window, double *out)
{
    size_t from = 0, to = begun < count ? begun : count;
    LB_ASSERT(begun > 0 && window > 0);
    for (;;) {
        *out++ = largest(x + from, to - from);
        if (to == count) {
            return;
        }
        from = to;
        to = count - to < window ? count : to + window;
    }
}

#ifdef LB_WITH_CHOICE

static lb_sizes_kernel *const kernels[] = LB_BY_SET(lb_sizes);

lb_status lb_largest_sizes(const double *x, size_t count, size_t begun, size_t window, lb_instruction_set set,
                           double *out)
{
    lb_sizes_kernel *kernel = kernels[lb_choice(set)];
    if ((!x && count) || !out) {
        return LB_ERROR_NULL;
    }
    if (!begun || !window) {
        return LB_ERROR_SIZE;
    }
    if (!kernel) {
        return LB_ERROR_INSTRUCTION_SET;
    }
    kernel(x, count, begun, window, out);
    return LB_OK;
}

#endif
