/* Integers of a few bits in the pages of a Parquet file, in runs: one value many times, or eight at a time packed. */
#include "livebode/table.h"

#define HEAD_BYTES_MAX 5

/* A number of seven bits a byte, the lowest first; the byte after it, NULL if it does not end. */
static const uint8_t *read_head(const uint8_t *p, const uint8_t *end, uint64_t *head)
{
    *head = 0;
    for (unsigned i = 0; i < HEAD_BYTES_MAX && p < end; ++i) {
        const uint8_t byte = *p++;
        *head |= (uint64_t)(byte & 0x7Fu) << 7u * i;
        if (byte < 0x80u) {
            return p;
        }
    }
    return NULL;
}

static void repeat(const uint8_t *p, size_t bytes, size_t count, uint32_t *out)
{
    uint32_t value = 0;
    for (size_t i = 0; i < bytes; ++i) {
        value |= (uint32_t)p[i] << 8u * i;
    }
    for (size_t i = 0; i < count; ++i) {
        out[i] = value;
    }
}

static void unpack(const uint8_t *p, unsigned width, size_t count, uint32_t *out)
{
    const uint64_t mask = ((uint64_t)1 << width) - 1u;
    uint64_t bits = 0;
    unsigned held = 0;
    for (size_t i = 0; i < count; ++i) {
        for (; held < width; held += 8u) {
            bits |= (uint64_t)*p++ << held;
        }
        out[i] = (uint32_t)(bits & mask);
        bits >>= width;
        held -= width;
    }
}

lb_status lb_runs_decode(const uint8_t *data, size_t length, unsigned width, size_t count, uint32_t *out)
{
    if (!data || !out) {
        return LB_ERROR_NULL;
    }
    if (width > LB_RUN_WIDTH_MAX) {
        return LB_ERROR_SIZE;
    }
    const uint8_t *p = data, *end = data + length;
    while (count > 0) {
        uint64_t head;
        p = read_head(p, end, &head);
        if (!p) {
            return LB_ERROR_SIZE;
        }
        const int is_packed = (int)(head & 1u);
        const uint64_t run = head >> 1, bytes = is_packed ? run * width : (width + 7u) / 8u;
        if (bytes > (uint64_t)(end - p)) {
            return LB_ERROR_SIZE;
        }
        const uint64_t values = is_packed ? 8u * run : run;
        const size_t filled = values < count ? (size_t)values : count;
        if (is_packed) {
            unpack(p, width, filled, out);
        } else {
            repeat(p, (size_t)bytes, filled, out);
        }
        p += bytes, out += filled, count -= filled;
    }
    return LB_OK;
}
