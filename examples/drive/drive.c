#include "drive.h"

#include "livebode/sdft.h"

#define TEXT_OF(x) #x
#define TEXT(x) TEXT_OF(x)

/* A constant is nothing at the lines; but beside a velocity of 30 rad/s the response of 0.01 rad/s would keep three
 * digits of float's seven fewer. So it is taken off before the DFT, and the receiver is told. */
static const float subtracted[DRIVE_SIGNALS] = {0, DRIVE_VELOCITY_RAD_S};

/* As lb_sdft32_size asks: table and delay lines, then what each line takes, then the object itself. */
static unsigned char
    memory[EXCITATION_SAMPLES * (8 + 4 * DRIVE_SIGNALS) + EXCITATION_LINES * (12 + 16 * DRIVE_SIGNALS) + 256];

enum { RAMP = EXCITATION_RAMP_PERIODS * EXCITATION_SAMPLES };

static lb_sdft32 *dft;
static uint64_t epoch, samples;
static char layout[DRIVE_LAYOUT_TEXT];
static uint32_t sequence, layout_bytes, layout_crc;
static uint32_t place; /* of the next sample in the excitation's period */
static uint32_t level; /* of the ramp, in samples */
static int rising;     /* ramping in, or there */
static volatile int enabled;
static uint32_t whole_after; /* samples until the window holds neither start nor ramp nor one that was not finite */
static struct {
    float sums[DRIVE_SIGNALS][EXCITATION_LINES][2];
    uint64_t newest;
    uint32_t state;
} latest;
static volatile int waits;

static void say(const char *text)
{
    while (*text) {
        layout[layout_bytes++] = *text++;
    }
}

static void say_bin(unsigned number)
{
    char digits[11], *at = digits + sizeof digits;
    *--at = 0;
    do {
        *--at = (char)('0' + number % 10);
        number /= 10;
    } while (number);
    say(at);
}

static void describe(void)
{
    say("window\t" TEXT(EXCITATION_SAMPLES) "\nhop\t" TEXT(DRIVE_HOP) "\nlines");
    for (int i = 0; i < EXCITATION_LINES; ++i) {
        say(i ? " " : "\t");
        say_bin(excitation_bins[i]);
    }
    say("\nsignal\tu\tN m\t0\nsignal\ty\trad/s\t" TEXT(DRIVE_VELOCITY_RAD_S) "\n");
    layout_crc = lb_frame_crc(0, layout, layout_bytes);
}

int drive_begin(uint64_t epoch_)
{
    uint32_t bins[EXCITATION_LINES];
    for (int i = 0; i < EXCITATION_LINES; ++i) {
        bins[i] = excitation_bins[i];
    }
    const lb_config config = {
        .window = EXCITATION_SAMPLES,
        .channels = DRIVE_SIGNALS,
        .bin_count = EXCITATION_LINES,
        .bins = bins,
        .table = LB_TABLE_COMPACT,
    };
    epoch = epoch_;
    whole_after = EXCITATION_SAMPLES;
    describe();
    return lb_sdft32_init(memory, sizeof memory, &config, &dft) != LB_OK;
}

void drive_enable(int on) { enabled = on; }

float drive_excitation(void) { return excitation[place] * ((float)level / RAMP); }

static int is_finite(float x) { return x - x == 0.0f; }

static void advance(void)
{
    level += rising && level < RAMP;
    level -= !rising && level > 0;
    place = place + 1 < EXCITATION_SAMPLES ? place + 1 : 0;
    if (place == 0) {
        rising = enabled;
    }
}

void drive_tick(float torque_n_m, float velocity_rad_s)
{
    const float x[DRIVE_SIGNALS] = {torque_n_m - subtracted[0], velocity_rad_s - subtracted[1]};
    (void)lb_sdft32_push(dft, x);
    whole_after -= whole_after > 0;
    if (whole_after < EXCITATION_SAMPLES && !(rising && level == RAMP)) {
        whole_after = EXCITATION_SAMPLES;
    }
    if (!is_finite(x[0]) || !is_finite(x[1])) {
        whole_after = 2 * EXCITATION_SAMPLES; /* the kernel has forgotten it by then */
    }
    advance();
    if (++samples % DRIVE_HOP == 0) {
        (void)lb_sdft32_read(dft, LB_PHASE_FIXED, &latest.sums[0][0][0]);
        latest.newest = samples - 1;
        latest.state = whole_after ? LB_FRAME_NOT_WHOLE : 0;
        waits = 1;
    }
}

int drive_ready(void) { return waits; }

/* y/u at each line. The phase of both is that of the sample numbers, and cancels. */
static void quotients(const float (*u)[2], const float (*y)[2], float (*frf)[2])
{
    for (uint32_t i = 0; i < EXCITATION_LINES; ++i) {
        const float scale = 1.0f / (u[i][0] * u[i][0] + u[i][1] * u[i][1]);
        frf[i][0] = (y[i][0] * u[i][0] + y[i][1] * u[i][1]) * scale;
        frf[i][1] = (y[i][1] * u[i][0] - y[i][0] * u[i][1]) * scale;
    }
}

size_t drive_spectrum(uint8_t frame[DRIVE_FRAME_BYTES], float frf[EXCITATION_LINES][2])
{
    waits = 0;
    quotients((const float (*)[2])latest.sums[0], (const float (*)[2])latest.sums[1], frf);
    lb_frame_put_spectrum(frame, 0, latest.state, 0, 0, &latest.sums[0][0][0], DRIVE_SIGNALS, EXCITATION_LINES);
    return lb_frame_spectra(frame, sequence++, epoch, latest.newest, 0, EXCITATION_RATE_HZ, layout_crc, DRIVE_SIGNALS,
                            EXCITATION_LINES, 0, 1);
}

size_t drive_layout(uint8_t frame[DRIVE_LAYOUT_BYTES])
{
    return lb_frame(frame, LB_FRAME_SPECTRA_LAYOUT, sequence++, epoch, 0, 0, EXCITATION_RATE_HZ, layout_crc,
                    DRIVE_SIGNALS, 0, layout, layout_bytes);
}
