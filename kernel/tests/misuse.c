/* Every call says what is wrong with its arguments, and does nothing then. Exit code 1 if one does not. */
#include <stdio.h>
#include <stdlib.h>

#include "livebode/sdft.h"

static int failures;

static void expect(lb_status got, lb_status want, const char *what)
{
    if (got != want) {
        fprintf(stderr, "%s: status %d where %d was due\n", what, (int)got, (int)want);
        ++failures;
    }
}
#define EXPECT(want, call) expect((call), (want), #call)

static const uint32_t bins[] = {1, 2, 3}, twice[] = {1, 2, 1}, beyond[] = {1, 8};
static const lb_config good = {8, 2, 3, bins, LB_MODULATED, 0.0, LB_BEST, LB_TABLE_ROWS, 0};

static void configurations(void)
{
    size_t bytes;
    lb_config c = good;
    EXPECT(LB_OK, lb_sdft64_size(&c, &bytes));
    EXPECT(LB_ERROR_NULL, lb_sdft64_size(0, &bytes));
    EXPECT(LB_ERROR_NULL, lb_sdft64_size(&c, 0));
    c.window = 0;
    EXPECT(LB_ERROR_WINDOW, lb_sdft64_size(&c, &bytes));
    c.window = LB_WINDOW_MAX + 1u;
    EXPECT(LB_ERROR_WINDOW, lb_sdft64_size(&c, &bytes));
    c = good, c.channels = 0;
    EXPECT(LB_ERROR_CHANNELS, lb_sdft64_size(&c, &bytes));
    c.channels = LB_CHANNELS_MAX + 1u;
    EXPECT(LB_ERROR_CHANNELS, lb_sdft64_size(&c, &bytes));
    c = good, c.bins = 0;
    EXPECT(LB_ERROR_NULL, lb_sdft64_size(&c, &bytes));
    c = good, c.bin_count = 0;
    EXPECT(LB_ERROR_BINS, lb_sdft64_size(&c, &bytes));
    c = good, c.bins = beyond, c.bin_count = 2;
    EXPECT(LB_ERROR_BINS, lb_sdft64_size(&c, &bytes));
    c = good, c.variant = (lb_variant)17;
    EXPECT(LB_ERROR_VARIANT, lb_sdft64_size(&c, &bytes));
    c = good, c.table = (lb_table)2;
    EXPECT(LB_ERROR_TABLE, lb_sdft64_size(&c, &bytes));
    c.table = LB_TABLE_COMPACT, c.window = LB_COMPACT_WINDOW_MAX + 1u;
    EXPECT(LB_ERROR_TABLE, lb_sdft64_size(&c, &bytes));
    c = good, c.variant = LB_DAMPED, c.damping = 1.0;
    EXPECT(LB_ERROR_DAMPING, lb_sdft64_size(&c, &bytes));
    c = good, c.hop = 3;
    EXPECT(LB_ERROR_HOP, lb_sdft64_size(&c, &bytes));
    c.hop = 4, c.variant = LB_HANN;
    EXPECT(LB_ERROR_HOP, lb_sdft64_size(&c, &bytes));
    c.variant = LB_MODULATED, c.table = LB_TABLE_COMPACT;
    EXPECT(LB_ERROR_HOP, lb_sdft64_size(&c, &bytes));
    c.table = LB_TABLE_ROWS;
    EXPECT(LB_OK, lb_sdft64_size(&c, &bytes));
}

static void init(void *memory, size_t bytes)
{
    lb_sdft64 *dft;
    lb_config c = good;
    EXPECT(LB_ERROR_NULL, lb_sdft64_init(0, bytes, &c, &dft));
    EXPECT(LB_ERROR_NULL, lb_sdft64_init(memory, bytes, &c, 0));
    EXPECT(LB_ERROR_NULL, lb_sdft64_init(memory, bytes, 0, &dft));
    EXPECT(LB_ERROR_MEMORY, lb_sdft64_init(memory, bytes - 1, &c, &dft));
    c.bins = twice;
    EXPECT(LB_ERROR_BINS, lb_sdft64_init(memory, bytes, &c, &dft));
    c = good, c.instruction_set = (lb_instruction_set)9;
    EXPECT(LB_ERROR_INSTRUCTION_SET, lb_sdft64_init(memory, bytes, &c, &dft));
    if (dft) {
        expect(LB_OK, LB_ERROR_NULL, "a refused init leaves no object");
    }
}

static void calls(lb_sdft64 *dft)
{
    double x[16] = {0}, out[2 * 2 * 3 * 2];
    size_t rows, bytes;
    uint64_t count;
    lb_instruction_set set;
    unsigned char snapshot[1024];
    EXPECT(LB_ERROR_NULL, lb_sdft64_push(0, x));
    EXPECT(LB_ERROR_NULL, lb_sdft64_push(dft, 0));
    EXPECT(LB_ERROR_NULL, lb_sdft64_queue(dft, 0));
    EXPECT(LB_ERROR_NULL, lb_sdft64_reset(0));
    EXPECT(LB_ERROR_NULL, lb_sdft64_rows(dft, 8, 4, 0));
    EXPECT(LB_ERROR_NULL, lb_sdft64_process(dft, 0, 8, 1, 8, 4, LB_PHASE_WINDOW, out, 2));
    EXPECT(LB_ERROR_NULL, lb_sdft64_process(dft, x, 8, 1, 8, 4, LB_PHASE_WINDOW, 0, 2));
    EXPECT(LB_ERROR_ROWS, lb_sdft64_process(dft, x, 8, 1, 8, 4, LB_PHASE_WINDOW, out, 1));
    EXPECT(LB_ERROR_PHASE, lb_sdft64_process(dft, x, 8, 1, 8, 4, (lb_phase)2, out, 2));
    EXPECT(LB_ERROR_NULL, lb_sdft64_read(dft, LB_PHASE_WINDOW, 0));
    EXPECT(LB_ERROR_PHASE, lb_sdft64_read(dft, (lb_phase)7, out));
    EXPECT(LB_ERROR_NULL, lb_sdft64_instruction_set(0, &set));
    EXPECT(LB_OK, lb_sdft64_count(dft, &count));
    if (count) {
        expect(LB_OK, LB_ERROR_ROWS, "refused calls take no samples");
    }
    EXPECT(LB_OK, lb_sdft64_process(dft, x, 8, 1, 8, 4, LB_PHASE_WINDOW, out, 2));
    EXPECT(LB_OK, lb_sdft64_process(dft, x, 8, 1, 8, 0, LB_PHASE_WINDOW, 0, 0));
    EXPECT(LB_OK, lb_sdft64_process(dft, 0, 0, 0, 0, 1, LB_PHASE_WINDOW, 0, 0));
    EXPECT(LB_OK, lb_sdft64_rows(dft, 7, 4, &rows));
    EXPECT(LB_OK, lb_sdft64_snapshot_size(dft, &bytes));
    EXPECT(LB_ERROR_SNAPSHOT_LENGTH, lb_sdft64_snapshot(dft, snapshot, bytes - 1));
    EXPECT(LB_OK, lb_sdft64_snapshot(dft, snapshot, bytes));
    EXPECT(LB_ERROR_SNAPSHOT_LENGTH, lb_sdft64_restore(dft, snapshot, 3));
    EXPECT(LB_ERROR_SNAPSHOT_CRC, lb_sdft64_restore(dft, snapshot, bytes - 1));
    snapshot[0] ^= 1;
    EXPECT(LB_ERROR_SNAPSHOT_MAGIC, lb_sdft64_restore(dft, snapshot, bytes));
}

/* Rows at a hop: bins are looked for twice, and rows at other hops are refused. */
static void hops(void)
{
    double x[16] = {0}, out[2 * 2 * 3 * 2];
    size_t bytes, rows;
    lb_sdft64 *dft;
    lb_config c = good;
    c.hop = 4;
    EXPECT(LB_OK, lb_sdft64_size(&c, &bytes));
    void *memory = malloc(bytes);
    c.bins = twice;
    EXPECT(LB_ERROR_BINS, lb_sdft64_init(memory, bytes, &c, &dft));
    c.bins = bins;
    EXPECT(LB_OK, lb_sdft64_init(memory, bytes, &c, &dft));
    EXPECT(LB_ERROR_HOP, lb_sdft64_rows(dft, 8, 2, &rows));
    EXPECT(LB_ERROR_HOP, lb_sdft64_process(dft, x, 8, 1, 8, 6, LB_PHASE_WINDOW, out, 1));
    EXPECT(LB_OK, lb_sdft64_process(dft, x, 8, 1, 8, 4, LB_PHASE_WINDOW, out, 2));
    free(memory);
}

int main(void)
{
    size_t bytes;
    lb_sdft64 *dft;
    configurations();
    EXPECT(LB_OK, lb_sdft64_size(&good, &bytes));
    char *memory = (char *)malloc(bytes + 1);
    if (!memory) {
        return 1;
    }
    init(memory, bytes);
    /* Memory of any alignment will do. */
    EXPECT(LB_OK, lb_sdft64_init(memory + 1, bytes, &good, &dft));
    calls(dft);
    free(memory);
    hops();
    return failures != 0;
}
