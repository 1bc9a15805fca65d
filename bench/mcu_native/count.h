/* Instructions, counted: QEMU with `-icount shift=10` lets 1024 ns pass with each, and the board's timer runs at
 * 25 MHz, so that an instruction is 25.6 of its ticks and none is lost in rounding. */
#ifndef COUNT_H
#define COUNT_H

#include <stdint.h>

#define TIMER ((volatile uint32_t *)0x40000000u) /* control, value, reload; counts down */

static inline void count_begin(void)
{
    TIMER[2] = UINT32_MAX;
    TIMER[1] = UINT32_MAX;
    TIMER[0] = 1u;
}

/* Less from call to call. */
static inline uint32_t count_ticks(void) { return TIMER[1]; }

static inline uint32_t count_instructions(uint32_t before, uint32_t after)
{
    return ((before - after) * 5u + 64u) / 128u; /* / 25.6, rounded */
}

#endif
