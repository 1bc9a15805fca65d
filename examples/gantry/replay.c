/* Plays recorded samples through gantry.c in QEMU: the host's samples.bin with u1, u2, y1, y2 of each cycle. Writes
 * excitation.bin (the torques it would add), matrices.bin (number of the newest sample, matrix, validity), and the
 * instructions of cycles and matrices as text, counted.txt: total, worst, number. */
#include "count.h"
#include "gantry.h"
#include "semihosting.h"

typedef struct {
    uint32_t total, worst, number;
} tally;

static int counted;
static uint32_t nothing; /* instructions that two readings of the timer cost */

static void add(tally *t, uint32_t before, uint32_t after)
{
    const uint32_t instructions = count_instructions(before, after) - nothing;
    t->total += instructions;
    t->worst = instructions > t->worst ? instructions : t->worst;
    ++t->number;
}

static void write_number(uint32_t number)
{
    char digits[12], *const end = digits + sizeof digits, *at = end;
    *--at = '\n';
    do {
        *--at = (char)('0' + number % 10u);
        number /= 10u;
    } while (number);
    (void)host_write(counted, at, (size_t)(end - at));
}

static void write_tally(const tally *t)
{
    write_number(t->total);
    write_number(t->worst);
    write_number(t->number);
}

int main(void)
{
    const int in = host_open("samples.bin", HOST_READ), torques = host_open("excitation.bin", HOST_WRITE);
    const int out = host_open("matrices.bin", HOST_WRITE);
    gantry_real signals[GANTRY_SIGNALS], w[GANTRY_MOTORS];
    tally ticks = {0, 0, 0}, matrices = {0, 0, 0};
    counted = host_open("counted.txt", HOST_WRITE);
    if (gantry_begin()) {
        return 1;
    }
    count_begin();
    const uint32_t first = count_ticks();
    nothing = count_instructions(first, count_ticks());
    while (host_read(in, signals, sizeof signals)) {
        const uint32_t before = count_ticks();
        gantry_excitation(w);
        gantry_tick(signals);
        add(&ticks, before, count_ticks());
        (void)host_write(torques, w, sizeof w);
        if (gantry_ready()) {
            const uint32_t begin = count_ticks();
            const gantry_matrix *found = gantry_take();
            add(&matrices, begin, count_ticks());
            (void)host_write(out, &found->newest, sizeof found->newest);
            (void)host_write(out, found->response, sizeof found->response);
            (void)host_write(out, found->valid, sizeof found->valid);
        }
    }
    write_tally(&ticks);
    write_tally(&matrices);
    return 0;
}
