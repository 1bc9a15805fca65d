/* Prints a hash of everything the kernel makes, over many configurations, blocks, hops and instruction sets: the
 * same on every machine and compiler. Buffers have their exact size, so that sanitizers see what is beyond them.
 * Exit code 1 if two instruction sets, tables, or ways of cutting differ. */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "livebode/sdft.h"

#define CHANNELS 2u

static void demand(int holds, const char *what)
{
    if (!holds) {
        fprintf(stderr, "failed: %s\n", what);
        exit(1);
    }
}
#define DEMAND(x) demand((x), #x)

static void *claim(size_t bytes)
{
    void *memory = malloc(bytes ? bytes : 1);
    DEMAND(memory != NULL);
    return memory;
}

static uint64_t hashed(uint64_t hash, const void *data, size_t bytes)
{
    for (size_t i = 0; i < bytes; ++i) {
        hash = (hash ^ ((const unsigned char *)data)[i]) * 1099511628211u;
    }
    return hash;
}

/* Samples from integers alone; |x| < 4, exact in float. */
static int32_t noise(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (int32_t)(*state >> 12) - (1 << 19);
}

#define REAL double
#define FN(name) lb_sdft64_##name
#define DFT lb_sdft64
#define RUN run64
#include "bits_of_type.h"
#undef REAL
#undef FN
#undef DFT
#undef RUN

#define REAL float
#define FN(name) lb_sdft32_##name
#define DFT lb_sdft32
#define RUN run32
#include "bits_of_type.h"

/* The hashes of one configuration in both number types: the same for every instruction set and table. */
static uint64_t every_way(uint32_t window, uint32_t bins, lb_variant variant, uint32_t hop, uint64_t total)
{
    uint64_t first64 = 0, first32 = 0;
    for (int set = LB_BASELINE; set <= (int)lb_best_instruction_set(); ++set) {
        for (int table = LB_TABLE_ROWS; table <= (hop ? LB_TABLE_ROWS : LB_TABLE_COMPACT); ++table) {
            const uint64_t h64 = run64(window, bins, variant, (lb_instruction_set)set, (lb_table)table, hop);
            const uint64_t h32 = run32(window, bins, variant, (lb_instruction_set)set, (lb_table)table, hop);
            const int is_first = set == LB_BASELINE && table == LB_TABLE_ROWS;
            first64 = is_first ? h64 : first64;
            first32 = is_first ? h32 : first32;
            DEMAND(h64 == first64);
            DEMAND(h32 == first32);
        }
    }
    return hashed(hashed(total, &first64, sizeof first64), &first32, sizeof first32);
}

int main(void)
{
#ifdef BITS_FEW_WINDOWS
    static const uint32_t windows[] = {1, 3, 7, 32, 129};
#else
    static const uint32_t windows[] = {1, 2, 3, 7, 50, 128, 129, 300};
#endif
    uint64_t total = 14695981039346656037u;
    for (size_t w = 0; w < sizeof windows / sizeof *windows; ++w) {
        for (uint32_t bins = 1; bins <= 35 && bins <= windows[w]; bins += bins < 18 ? 1 : 5) {
            for (int variant = LB_MODULATED; variant <= LB_BLACKMAN; variant += bins % 3 ? 6 : 1) {
                total = every_way(windows[w], bins, (lb_variant)variant, 0, total);
            }
            for (uint32_t hop = 1; hop <= windows[w]; ++hop) {
                total = windows[w] % hop ? total : every_way(windows[w], bins, LB_MODULATED, hop, total);
            }
        }
    }
    printf("%016" PRIx64 "\n", total);
    return 0;
}
