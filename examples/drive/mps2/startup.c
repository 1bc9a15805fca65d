/* From reset to main, without a C library. */
#include <stdint.h>

#include "semihosting.h"

extern uint32_t data_begin[], data_end[], data_from[], bss_begin[], bss_end[], stack_top[];

int main(void);
void reset(void);

#define COPROCESSOR_ACCESS (*(volatile uint32_t *)0xE000ED88u)

__attribute__((noreturn)) void reset(void)
{
    COPROCESSOR_ACCESS |= 0xFu << 20; /* the floating-point unit */
    __asm volatile("dsb\n\tisb" ::: "memory");
    for (uint32_t *to = data_begin, *from = data_from; to != data_end;) {
        *to++ = *from++;
    }
    for (uint32_t *to = bss_begin; to != bss_end;) {
        *to++ = 0;
    }
    host_exit(main());
}

static void fault(void) { host_exit(70); }

/* A program that wants the tick defines it. */
__attribute__((weak)) void systick(void) { fault(); }

typedef void (*handler)(void);

__attribute__((section(".vectors"), used)) static const struct {
    const void *stack;
    handler handlers[15];
} vectors = {stack_top, {reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, 0, 0, fault, systick}};
