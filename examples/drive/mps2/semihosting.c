#include "semihosting.h"

enum { SYS_OPEN = 0x01, SYS_WRITE = 0x05, SYS_READ = 0x06, SYS_TIME = 0x11, SYS_EXIT_EXTENDED = 0x20 };
#define APPLICATION_EXIT 0x20026u

static int call(int operation, const void *arguments)
{
    register int r0 __asm("r0") = operation;
    register const void *r1 __asm("r1") = arguments;
    __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

int host_open(const char *name, int mode)
{
    uint32_t length = 0;
    while (name[length]) {
        ++length;
    }
    const uint32_t arguments[3] = {(uint32_t)name, (uint32_t)mode, length};
    return call(SYS_OPEN, arguments);
}

/* Both answer with the bytes that were left over. */
int host_read(int handle, void *to, size_t bytes)
{
    const uint32_t arguments[3] = {(uint32_t)handle, (uint32_t)to, bytes};
    return call(SYS_READ, arguments) == 0;
}

int host_write(int handle, const void *from, size_t bytes)
{
    const uint32_t arguments[3] = {(uint32_t)handle, (uint32_t)from, bytes};
    return call(SYS_WRITE, arguments) == 0;
}

uint32_t host_time_s(void) { return (uint32_t)call(SYS_TIME, 0); }

void host_exit(int code)
{
    const uint32_t arguments[2] = {APPLICATION_EXIT, (uint32_t)code};
    for (;;) {
        (void)call(SYS_EXIT_EXTENDED, arguments);
    }
}
