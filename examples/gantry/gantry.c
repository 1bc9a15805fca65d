#include "gantry.h"

#include "livebode/sdft.h"

#if LB_BITS == 64
typedef lb_sdft64 dft_type;
#define FN(name) lb_sdft64_##name
#else
typedef lb_sdft32 dft_type;
#define FN(name) lb_sdft32_##name
#endif

typedef gantry_real real;
typedef gantry_complex number;

enum {
    WINDOW = EXCITATION_SAMPLES,
    SPAN = GANTRY_DWELL * WINDOW,
    FIRST = (GANTRY_SETTLE + 1) * WINDOW, /* samples of an experiment after which its first window is used */
    PLACES = (SPAN - FIRST) / GANTRY_HOP + 1
};

/* As lb_sdft32_size and lb_sdft64_size require: table and delay lines, then what each line takes, then the object. */
static union {
    uint64_t align;
    unsigned char bytes[(WINDOW * (2 + GANTRY_SIGNALS) + GANTRY_LINES * (4 + 4 * GANTRY_SIGNALS)) * sizeof(real) + 384];
} memory;

static dft_type *dft;
static uint64_t samples;
static uint32_t place; /* of the next sample in its experiment */
static unsigned experiment;
static uint32_t whole_after; /* samples until the window contains neither the start nor one that is not finite */
static number sums[2][PLACES][GANTRY_SIGNALS][GANTRY_LINES];
static uint8_t whole[2][PLACES];
static gantry_matrix latest;
static uint32_t due_place; /* of the windows that the next matrix is computed from */
static volatile int due;

int gantry_begin(void)
{
    uint32_t bins[GANTRY_LINES];
    for (int i = 0; i < GANTRY_LINES; ++i) {
        bins[i] = excitation_bins[i];
    }
    const lb_config config = {
        .window = WINDOW,
        .channels = GANTRY_SIGNALS,
        .bin_count = GANTRY_LINES,
        .bins = bins,
        .table = LB_TABLE_COMPACT,
    };
    whole_after = WINDOW;
    return FN(init)(memory.bytes, sizeof memory, &config, &dft) != LB_OK;
}

/* The same multisine for both motors, and in the second experiment −1 times it for the second: orthogonal over both. */
void gantry_excitation(real torque_n_m[GANTRY_MOTORS])
{
    const real x = excitation[place % WINDOW];
    torque_n_m[0] = x;
    torque_n_m[1] = experiment ? -x : x;
}

static int is_finite(real x) { return x - x == 0; }

void gantry_tick(const real signals[GANTRY_SIGNALS])
{
    (void)FN(push)(dft, signals);
    whole_after -= whole_after > 0;
    for (int i = 0; i < GANTRY_SIGNALS; ++i) {
        if (!is_finite(signals[i])) {
            whole_after = 2 * WINDOW; /* it has no effect on the kernel after that */
        }
    }
    ++samples;
    ++place;
    if (place >= FIRST && place % GANTRY_HOP == 0) {
        const uint32_t at = (place - FIRST) / GANTRY_HOP;
        (void)FN(read)(dft, LB_PHASE_FIXED, &sums[experiment][at][0][0].re);
        whole[experiment][at] = whole_after == 0;
        latest.newest = samples - 1;
        due_place = at;
        due = whole[0][at] && whole[1][at];
    }
    if (place == SPAN) {
        place = 0;
        experiment ^= 1u;
    }
}

int gantry_ready(void) { return due; }

static number times(number a, number b) { return (number){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re}; }

static number minus(number a, number b) { return (number){a.re - b.re, a.im - b.im}; }
static real power(number a) { return a.re * a.re + a.im * a.im; }

/* G = Y·D⁻¹ at a line, with one column for each experiment. The condition number κ of two torques follows from
 * ‖D‖² = (κ + 1/κ)·|det D|, without a root. */
static uint8_t quotient(int line, number g[GANTRY_MOTORS][GANTRY_MOTORS])
{
    const real limit = GANTRY_CONDITION_MAX + (real)1 / GANTRY_CONDITION_MAX;
    number u[2][2], y[2][2]; /* [motor][experiment] */
    real size = 0;
    for (int i = 0; i < 2; ++i) {
        for (int e = 0; e < 2; ++e) {
            u[i][e] = sums[e][due_place][i][line];
            y[i][e] = sums[e][due_place][GANTRY_MOTORS + i][line];
            size += power(u[i][e]);
        }
    }
    const number det = minus(times(u[0][0], u[1][1]), times(u[0][1], u[1][0]));
    const real scale = 1 / power(det);
    const number inverse = {det.re * scale, -det.im * scale};
    for (int o = 0; o < 2; ++o) {
        g[o][0] = times(minus(times(y[o][0], u[1][1]), times(y[o][1], u[1][0])), inverse);
        g[o][1] = times(minus(times(y[o][1], u[0][0]), times(y[o][0], u[0][1])), inverse);
    }
    return size * size <= limit * limit * power(det) && size > 0;
}

const gantry_matrix *gantry_take(void)
{
    due = 0;
    for (int i = 0; i < GANTRY_LINES; ++i) {
        latest.valid[i] = quotient(i, latest.response[i]);
    }
    return &latest;
}
