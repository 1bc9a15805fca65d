/* exp(−2πi·r/N) from integers, without libm: the same bits on every machine. Private. */
#ifndef LB_TWIDDLE_H
#define LB_TWIDDLE_H

#include <stdint.h>

/* cos and sin of 2π·r/N for 0 ≤ r < N, within 1.5 units in the last place. sin of N − r is exactly −sin of r. */
void lb_twiddle(uint32_t r, uint32_t N, double *cosine, double *sine);

#endif
