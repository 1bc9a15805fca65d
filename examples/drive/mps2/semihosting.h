/* The host's files and exit code, by Arm's semihosting: what QEMU and debuggers offer to a bare machine. */
#ifndef SEMIHOSTING_H
#define SEMIHOSTING_H

#include <stddef.h>
#include <stdint.h>

enum { HOST_READ = 1, HOST_WRITE = 5 }; /* rb, wb */

/* A handle, negative if the host refuses. The name ":tt" is the host's console. */
int host_open(const char *name, int mode);

/* Whether all of it was read or written. */
int host_read(int handle, void *to, size_t bytes);
int host_write(int handle, const void *from, size_t bytes);

/* Seconds since 1970. */
uint32_t host_time_s(void);

__attribute__((noreturn)) void host_exit(int code);

#endif
