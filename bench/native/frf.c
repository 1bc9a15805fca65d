/* Two channels through the kernel sample by sample, and their FRF every `hop` samples. */
#include <stdlib.h>

#include "livebode/sdft.h"

#define BINS_MAX 128

/* Y/U at every bin. */
static void quotients(const double *u, const double *y, size_t bins, double *restrict out)
{
    for (size_t i = 0; i < 2 * bins; i += 2) {
        const double scale = 1.0 / (u[i] * u[i] + u[i + 1] * u[i + 1]);
        out[i] = (y[i] * u[i] + y[i + 1] * u[i + 1]) * scale;
        out[i + 1] = (y[i + 1] * u[i] - y[i] * u[i + 1]) * scale;
    }
}

typedef struct {
    void *memory;
    lb_sdft64 *dft;
    size_t bins;
} tracker;

void *frf_new(uint32_t window, uint32_t bin_count, const uint32_t *bins, int set)
{
    const lb_config config = {window, 2, bin_count, bins, LB_MODULATED, 0.0, (lb_instruction_set)set, LB_TABLE_ROWS, 0};
    tracker *t = (tracker *)calloc(1, sizeof *t);
    size_t bytes;
    if (!t || bin_count > BINS_MAX || lb_sdft64_size(&config, &bytes) != LB_OK) {
        return 0;
    }
    t->bins = bin_count;
    t->memory = malloc(bytes);
    return lb_sdft64_init(t->memory, bytes, &config, &t->dft) == LB_OK ? t : 0;
}

void frf_free(void *tracker_)
{
    free(((tracker *)tracker_)->memory);
    free(tracker_);
}

/* The sums catch up when they are read. */
double frf_queued(void *tracker_, const double *u, const double *y, size_t length, size_t hop)
{
    tracker *t = (tracker *)tracker_;
    double sums[4 * BINS_MAX], frf[2 * BINS_MAX], used = 0.0;
    for (size_t n = 0, due = hop; n < length; ++n) {
        const double sample[2] = {u[n], y[n]};
        lb_sdft64_queue(t->dft, sample);
        if (--due == 0) {
            due = hop;
            lb_sdft64_read(t->dft, LB_PHASE_FIXED, sums);
            quotients(sums, sums + 2 * t->bins, t->bins, frf);
            used += frf[0];
        }
    }
    return used;
}

/* The sums are up to date after every sample, as in a drive. */
double frf_pushed(void *tracker_, const double *u, const double *y, size_t length, size_t hop)
{
    tracker *t = (tracker *)tracker_;
    double sums[4 * BINS_MAX], frf[2 * BINS_MAX], used = 0.0;
    for (size_t n = 0, due = hop; n < length; ++n) {
        const double sample[2] = {u[n], y[n]};
        lb_sdft64_push(t->dft, sample);
        if (--due == 0) {
            due = hop;
            lb_sdft64_read(t->dft, LB_PHASE_FIXED, sums);
            quotients(sums, sums + 2 * t->bins, t->bins, frf);
            used += frf[0];
        }
    }
    return used;
}
