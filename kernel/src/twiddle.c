#include "lb_assert.h"
#include "twiddle.h"

/* Taylor sums on [0, π/4]; the truncation error is below 1e-19. */
static double small_sin(double a)
{
    const double z = a * a;
    double p = 1.0 / 355687428096000.0;
    p = p * z - 1.0 / 1307674368000.0;
    p = p * z + 1.0 / 6227020800.0;
    p = p * z - 1.0 / 39916800.0;
    p = p * z + 1.0 / 362880.0;
    p = p * z - 1.0 / 5040.0;
    p = p * z + 1.0 / 120.0;
    p = p * z - 1.0 / 6.0;
    return a + a * (z * p);
}

static double small_cos(double a)
{
    const double z = a * a;
    double p = 1.0 / 6402373705728000.0;
    p = 1.0 / 20922789888000.0 - p * z;
    p = p * z - 1.0 / 87178291200.0;
    p = p * z + 1.0 / 479001600.0;
    p = p * z - 1.0 / 3628800.0;
    p = p * z + 1.0 / 40320.0;
    p = p * z - 1.0 / 720.0;
    p = p * z + 1.0 / 24.0;
    return 1.0 - z * (0.5 - z * p);
}

void lb_twiddle(uint32_t r, uint32_t N, double *cosine, double *sine)
{
    LB_ASSERT(N > 0 && r < N);
    /* Reduced in integers, so that no angle is rounded before it is in [0, π/4]. */
    const int mirrored = (uint64_t)r * 2u > N;
    const uint64_t eighths = 8u * (uint64_t)(mirrored ? N - r : r);
    const unsigned octant = (unsigned)(eighths / N); /* 0 … 4 */
    const uint64_t rest = eighths - (uint64_t)octant * N;
    const uint64_t near_axis = (octant & 1u) ? N - rest : rest;
    const double angle = 0.78539816339744830962 * ((double)near_axis / (double)N);
    const double c = small_cos(angle);
    const double s = small_sin(angle);
    LB_ASSERT(octant <= 4u && near_axis <= N);
    LB_ASSERT(c * c + s * s > 1.0 - 1e-15 && c * c + s * s < 1.0 + 1e-15);

    switch (octant) {
    case 0: *cosine = c, *sine = s; break;
    case 1: *cosine = s, *sine = c; break;
    case 2: *cosine = -s, *sine = c; break;
    case 3: *cosine = -c, *sine = s; break;
    default: *cosine = -1.0, *sine = 0.0; break;
    }
    if (mirrored) {
        *sine = -*sine;
    }
}
