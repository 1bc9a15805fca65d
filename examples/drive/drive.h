/* Livebode inside a drive: the excitation, and the spectra of torque and velocity. Nothing here knows a board. */
#ifndef DRIVE_H
#define DRIVE_H

#include <stddef.h>
#include <stdint.h>

#include "livebode_frame.h"

#define EXCITATION_TYPE float
#include "excitation.h"

#define DRIVE_RATE_HZ 4000 /* of the control interrupt */
#ifndef DRIVE_HOP
#define DRIVE_HOP 200 /* samples from spectrum to spectrum, 20 a second */
#endif
#ifndef DRIVE_LIMIT_N_M
#define DRIVE_LIMIT_N_M 0.5f /* what the excitation never exceeds */
#endif
_Static_assert(EXCITATION_SAMPLES % DRIVE_HOP == 0, "DRIVE_HOP must divide EXCITATION_SAMPLES; define another hop");
_Static_assert(EXCITATION_RATE_HZ == DRIVE_RATE_HZ, "the excitation is made for another rate than DRIVE_RATE_HZ");
_Static_assert((float)EXCITATION_PEAK_N_M <= DRIVE_LIMIT_N_M, "the excitation exceeds DRIVE_LIMIT_N_M");
#ifndef DRIVE_VELOCITY_RAD_S
#define DRIVE_VELOCITY_RAD_S 30 /* taken off the velocity: what it is about at this speed */
#endif

enum { DRIVE_SIGNALS = 2 };
#define DRIVE_FRAME_BYTES LB_FRAME_BYTES(LB_FRAME_SPECTRA_PAYLOAD(DRIVE_SIGNALS, EXCITATION_LINES, 0, 1))
#define DRIVE_LAYOUT_TEXT (160 + 6 * EXCITATION_LINES)
#define DRIVE_LAYOUT_BYTES LB_FRAME_BYTES(DRIVE_LAYOUT_TEXT)

/* epoch: another number at each start. 0 when it is ready. */
int drive_begin(uint64_t epoch);

/* Whether to excite: taken over where a period begins, and followed over EXCITATION_RAMP_PERIODS of them. At first it
 * does not. */
void drive_enable(int on);

/* In the control interrupt: what to add to the torque reference in this cycle … */
float drive_excitation(void);

/* … and the torque that was then asked for, with the velocity measured in this cycle. Constant time but for the end of
 * a period. */
void drive_tick(float torque_n_m, float velocity_rad_s);

/* In the background: whether a spectrum waits. It must be fetched before the next hop, or it is lost. */
int drive_ready(void);

/* The frame with that spectrum; returns its length. frf: velocity over torque at each line, re and im,
 * (rad/s)/(N m). */
size_t drive_spectrum(uint8_t frame[DRIVE_FRAME_BYTES], float frf[EXCITATION_LINES][2]);

/* The frame that says what spectra are of: to be sent first, and then once a second. */
size_t drive_layout(uint8_t frame[DRIVE_LAYOUT_BYTES]);

#endif
