/* Counts instructions on the target, in two windows of samples, and writes a table to the host's counted.txt: for
 * loops of known length turns and count; for each step the total and the worst; bytes of RAM
 * in all and in delay lines. */
#include "count.h"
#include "livebode/sdft.h"
#include "rls.h"
#include "semihosting.h"

#if LB_BITS == 64
typedef lb_sdft64 dft_type;
#define FN(name) lb_sdft64_##name
#else
typedef lb_sdft32 dft_type;
#define FN(name) lb_sdft32_##name
#endif
typedef rls_real real;

enum { WINDOW = 400, HOP = 20, CHANNELS = 2, BINS_MAX = 21 };

static int out;
static unsigned char memory[1 << 17];

static void say(const char *text)
{
    size_t length = 0;
    while (text[length]) {
        ++length;
    }
    (void)host_write(out, text, length);
}

static void say_number(uint32_t number)
{
    char digits[12], *at = digits + sizeof digits;
    *--at = 0;
    do {
        *--at = (char)('0' + number % 10u);
        number /= 10u;
    } while (number);
    say(at);
}

/* A row of the table: its name and two numbers. */
static void row(const char *name, uint32_t a, uint32_t b)
{
    say(name);
    say(" "), say_number(a);
    say(" "), say_number(b);
    say("\n");
}

/* What two readings of the timer cost by themselves. */
static uint32_t nothing;

static uint32_t spent(uint32_t before)
{
    const uint32_t after = count_ticks();
    return count_instructions(before, after) - nothing;
}

/* 2·turns + 1 instructions, written in assembler so that this is known. */
static void known_loop(uint32_t turns)
{
    const uint32_t before = count_ticks();
    __asm volatile("mov r3, %0\n1:\n\tsubs r3, r3, #1\n\tbne 1b" ::"r"(turns) : "r3", "cc");
    const uint32_t total = spent(before);
    row("loop", turns, total);
}

static real noise(void)
{
    static uint32_t state = 1;
    state = state * 1664525u + 1013904223u;
    return (real)((int32_t)(state >> 8) - (1 << 23)) / (real)(1 << 23);
}

typedef struct {
    uint32_t total, worst;
} tally;

static void add(tally *t, uint32_t instructions)
{
    t->total += instructions;
    t->worst = instructions > t->worst ? instructions : t->worst;
}

static void quotients(const real *u, const real *y, uint32_t bins, real *frf)
{
    for (uint32_t i = 0; i < 2u * bins; i += 2u) {
        const real scale = 1 / (u[i] * u[i] + u[i + 1] * u[i + 1]);
        frf[i] = (y[i] * u[i] + y[i + 1] * u[i + 1]) * scale;
        frf[i + 1] = (y[i + 1] * u[i] - y[i] * u[i + 1]) * scale;
    }
}

static void kernel(uint32_t bin_count, lb_table table, uint32_t own_hop, const char *name)
{
    uint32_t bins[BINS_MAX];
    for (uint32_t i = 0; i < bin_count; ++i) {
        bins[i] = 2u * (i + 1u);
    }
    const lb_config config = {WINDOW, CHANNELS, bin_count, bins, LB_MODULATED, 0.0, LB_BEST, table, own_hop};
    static real sums[2 * CHANNELS * BINS_MAX], frf[2 * BINS_MAX];
    tally push = {0, 0}, hop = {0, 0};
    dft_type *dft;
    size_t bytes;
    if (FN(size)(&config, &bytes) != LB_OK || FN(init)(memory, sizeof memory, &config, &dft) != LB_OK) {
        host_exit(1);
    }
    for (uint32_t n = 0; n < 4u * WINDOW; ++n) {
        const real samples[CHANNELS] = {noise(), noise()};
        uint32_t before = count_ticks();
        (void)FN(push)(dft, samples);
        if (n >= 2u * WINDOW) {
            add(&push, spent(before));
            before = count_ticks();
            (void)FN(read)(dft, LB_PHASE_FIXED, sums);
            quotients(sums, sums + 2u * bin_count, bin_count, frf);
            add(&hop, spent(before));
        }
    }
    say(name);
    row(" push", push.total, push.worst);
    say(name);
    row(" hop", hop.total, hop.worst);
    say(name);
    row(" bytes", (uint32_t)bytes, CHANNELS * WINDOW * sizeof(real));
}

static void least_squares(void)
{
    static rls r;
    tally t = {0, 0};
    rls_begin(&r, (real)0.995);
    for (uint32_t n = 0; n < 2u * WINDOW; ++n) {
        const real u = noise(), y = noise();
        const uint32_t before = count_ticks();
        rls_push(&r, u, y);
        add(&t, spent(before));
    }
    row("rls", t.total, t.worst);
}

int main(void)
{
    out = host_open("counted.txt", HOST_WRITE);
    count_begin();
    uint32_t before = count_ticks();
    nothing = spent(before);
    for (uint32_t turns = 1; turns <= 100000u; turns *= 10u) {
        known_loop(turns);
    }
    kernel(7, LB_TABLE_ROWS, 0, "7 rows");
    kernel(21, LB_TABLE_ROWS, 0, "21 rows");
    kernel(7, LB_TABLE_COMPACT, 0, "7 compact");
    kernel(21, LB_TABLE_COMPACT, 0, "21 compact");
    kernel(7, LB_TABLE_ROWS, HOP, "7 hop");
    kernel(21, LB_TABLE_ROWS, HOP, "21 hop");
    least_squares();
    return 0;
}
