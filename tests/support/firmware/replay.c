/* Plays recordings through the kernel on the target: jobs.bin → made.bin, both on the host. A job is a header, bins,
 * a snapshot to begin from (or none) and samples; it makes its rows and the snapshot after its last sample. */
#include "livebode/sdft.h"
#include "semihosting.h"

#if LB_BITS == 64
typedef double real;
typedef lb_sdft64 dft_type;
#define FN(name) lb_sdft64_##name
#else
typedef float real;
typedef lb_sdft32 dft_type;
#define FN(name) lb_sdft32_##name
#endif

#define CHANNELS_MAX 8
#define BINS_MAX 128

typedef struct {
    uint32_t window, channels, bin_count, variant, table, phase, hop, samples, snapshot_bytes, blockwise, own_hop;
} header;

static unsigned char memory[1 << 20], snapshot[1 << 17];
static real samples[1 << 16], made[1 << 16];

static void demand(int holds, int code)
{
    if (!holds) {
        host_exit(code);
    }
}

/* Sample by sample, as a drive does: a row after every hop-th. */
static void push_all(const header *h, dft_type *dft, int out)
{
    uint64_t count;
    for (uint32_t n = 0; n < h->samples; ++n) {
        demand(FN(push)(dft, samples + (size_t)n * h->channels) == LB_OK, 10);
        demand(FN(count)(dft, &count) == LB_OK, 11);
        if (h->hop && count % h->hop == 0) {
            demand(FN(read)(dft, (lb_phase)h->phase, made) == LB_OK, 12);
            demand(host_write(out, made, (size_t)h->channels * h->bin_count * 2 * sizeof(real)), 13);
        }
    }
}

static void process_all(const header *h, dft_type *dft, int out)
{
    size_t rows;
    demand(FN(rows)(dft, h->samples, h->hop, &rows) == LB_OK, 20);
    const size_t bytes = rows * h->channels * h->bin_count * 2 * sizeof(real);
    demand(bytes <= sizeof made, 21);
    demand(FN(process)(dft, samples, 1, (ptrdiff_t)h->channels, h->samples, h->hop, (lb_phase)h->phase, made, rows) ==
               LB_OK,
           22);
    demand(host_write(out, made, bytes), 23);
}

static void play(const header *h, int in, int out)
{
    static uint32_t bins[BINS_MAX];
    demand(h->channels <= CHANNELS_MAX && h->bin_count <= BINS_MAX, 30);
    demand(host_read(in, bins, h->bin_count * sizeof *bins), 31);
    const lb_config config = {
        .window = h->window,
        .channels = h->channels,
        .bin_count = h->bin_count,
        .bins = bins,
        .variant = (lb_variant)h->variant,
        .damping = 0.9999,
        .table = (lb_table)h->table,
        .hop = h->own_hop,
    };
    dft_type *dft;
    size_t bytes;
    demand(FN(size)(&config, &bytes) == LB_OK && bytes <= sizeof memory, 32);
    demand(FN(init)(memory, bytes, &config, &dft) == LB_OK, 33);
    if (h->snapshot_bytes) {
        demand(h->snapshot_bytes <= sizeof snapshot && host_read(in, snapshot, h->snapshot_bytes), 34);
        demand(FN(restore)(dft, snapshot, h->snapshot_bytes) == LB_OK, 35);
    }
    const size_t sample_bytes = (size_t)h->samples * h->channels * sizeof(real);
    demand(sample_bytes <= sizeof samples && host_read(in, samples, sample_bytes), 36);
    if (h->blockwise) {
        process_all(h, dft, out);
    } else {
        push_all(h, dft, out);
    }
    demand(FN(snapshot_size)(dft, &bytes) == LB_OK && bytes <= sizeof snapshot, 37);
    demand(FN(snapshot)(dft, snapshot, bytes) == LB_OK, 38);
    demand(host_write(out, snapshot, bytes), 39);
}

int main(void)
{
    const int in = host_open("jobs.bin", HOST_READ), out = host_open("made.bin", HOST_WRITE);
    header h;
    demand(in >= 0 && out >= 0, 1);
    while (host_read(in, &h, sizeof h)) {
        play(&h, in, out);
    }
    return 0;
}
