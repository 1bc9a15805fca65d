/* Zeroed arrays of their exact size, so that sanitizers see what is beyond them, and what a test demands. */
#ifndef LB_TESTS_ARRAYS_H
#define LB_TESTS_ARRAYS_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

static void demand(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "failed: %s\n", what);
        exit(1);
    }
}
#define DEMAND(x) demand((x), #x)

static void *claim(size_t count, size_t size)
{
    void *memory = calloc(count ? count : 1, size);
    DEMAND(memory != NULL);
    return memory;
}

static double *reals(size_t count) { return (double *)claim(count, sizeof(double)); }
static uint8_t *flags(size_t count) { return (uint8_t *)claim(count, 1); }

#endif
