/* The drive on Arm's MPS2 board, as QEMU has it: a control interrupt at 4 kHz; spectra on the first serial line and,
 * to compare with, the samples on the second, both as livebode's frames. */
#include "drive.h"
#include "machine.h"
#include "semihosting.h"

#ifndef SECONDS
#define SECONDS 0 /* for ever */
#endif

#define CLOCK_HZ 25000000u
#define TICK ((volatile uint32_t *)0xE000E010u) /* control, reload, value */
#define SPECTRA ((volatile uint32_t *)0x40004000u)
#define SAMPLES ((volatile uint32_t *)0x40005000u)

enum { RATE_HZ = DRIVE_RATE_HZ, BATCH = 100, BATCHES = SECONDS * RATE_HZ / BATCH };
static const char layout[] = "u\tN m\ny\trad/s\n";

/* Two batches: the interrupt fills one while the other is sent. */
static float batches[2][BATCH][DRIVE_SIGNALS];
static volatile uint32_t ticks;

static void serial_begin(volatile uint32_t *line)
{
    line[4] = 16; /* divisor of the clock */
    line[2] = 1;  /* transmits */
}

static void send(volatile uint32_t *line, const uint8_t *bytes, size_t count)
{
    for (; count; --count, ++bytes) {
        while (line[1] & 1u) {
        }
        line[0] = *bytes;
    }
}

void systick(void)
{
    const float velocity = machine_velocity();
    const float torque = machine_controller(velocity) + drive_excitation();
    float *pair = batches[ticks / BATCH % 2][ticks % BATCH];
    machine_step(torque);
    drive_tick(torque, velocity);
    pair[0] = torque;
    pair[1] = velocity;
    ++ticks;
}

static void send_samples(uint32_t batch, uint64_t epoch)
{
    static uint8_t frame[LB_FRAME_BYTES(sizeof batches[0])];
    const uint32_t crc = lb_frame_crc(0, layout, sizeof layout - 1);
    if (batch * BATCH % RATE_HZ == 0) {
        send(SAMPLES, frame,
             lb_frame(frame, LB_FRAME_LAYOUT, batch, epoch, 0, 0, RATE_HZ, crc, DRIVE_SIGNALS, 0, layout,
                      sizeof layout - 1));
    }
    send(SAMPLES, frame,
         lb_frame(frame, LB_FRAME_SAMPLES, batch, epoch, (uint64_t)batch * BATCH, 0, RATE_HZ, crc, DRIVE_SIGNALS, BATCH,
                  batches[batch % 2], sizeof batches[0]));
}

static void send_spectrum(uint32_t *until_layout)
{
    static uint8_t frame[DRIVE_FRAME_BYTES > DRIVE_LAYOUT_BYTES ? DRIVE_FRAME_BYTES : DRIVE_LAYOUT_BYTES];
    static float frf[EXCITATION_LINES][2];
    if ((*until_layout)-- == 0) {
        *until_layout = RATE_HZ / DRIVE_HOP - 1;
        send(SPECTRA, frame, drive_layout(frame));
    }
    send(SPECTRA, frame, drive_spectrum(frame, frf));
}

int main(void)
{
    const uint64_t epoch = host_time_s();
    uint32_t sent = 0, until_layout = 0;
    if (drive_begin(epoch)) {
        return 1;
    }
    serial_begin(SPECTRA);
    serial_begin(SAMPLES);
    drive_enable(1);
    TICK[1] = CLOCK_HZ / RATE_HZ - 1;
    TICK[2] = 0;
    TICK[0] = 7; /* processor clock, interrupt, on */
    while (!BATCHES || sent != BATCHES) {
        if (drive_ready()) {
            send_spectrum(&until_layout);
        } else if (ticks >= (sent + 1) * BATCH) {
            send_samples(sent++, epoch);
        } else {
            __asm volatile("wfi");
        }
    }
    return 0;
}
