#include "string.h"

void *memcpy(void *restrict to, const void *restrict from, size_t bytes) { return memmove(to, from, bytes); }

void *memmove(void *to, const void *from, size_t bytes)
{
    unsigned char *t = (unsigned char *)to;
    const unsigned char *f = (const unsigned char *)from;
    if (t < f) {
        while (bytes--) {
            *t++ = *f++;
        }
    } else {
        while (bytes--) {
            t[bytes] = f[bytes];
        }
    }
    return to;
}

void *memset(void *to, int value, size_t bytes)
{
    for (unsigned char *t = (unsigned char *)to; bytes--;) {
        *t++ = (unsigned char)value;
    }
    return to;
}
