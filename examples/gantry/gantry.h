/* Livebode in the controller of a gantry: excitations of two motors, and the matrix of responses from their torques to
 * their speeds, without knowledge of the board. */
#ifndef GANTRY_H
#define GANTRY_H

#include <stddef.h>
#include <stdint.h>

#if LB_BITS == 64
typedef double gantry_real;
#else
typedef float gantry_real;
#endif
#define EXCITATION_TYPE gantry_real
#include "excitation.h"

/* An experiment lasts GANTRY_DWELL periods; windows in its first GANTRY_SETTLE periods are not used. */
#define GANTRY_DWELL 3
#define GANTRY_SETTLE 1
#ifndef GANTRY_HOP
#define GANTRY_HOP 100 /* samples from matrix to matrix */
#endif
#define GANTRY_CONDITION_MAX 1000 /* of the torques over both experiments */
_Static_assert(EXCITATION_SAMPLES % GANTRY_HOP == 0, "GANTRY_HOP must divide EXCITATION_SAMPLES; define another hop");
_Static_assert(GANTRY_DWELL > GANTRY_SETTLE, "an experiment needs a period that is used");

enum { GANTRY_MOTORS = 2, GANTRY_SIGNALS = 4, GANTRY_LINES = EXCITATION_LINES };

typedef struct {
    gantry_real re, im;
} gantry_complex;

typedef struct {
    uint64_t newest;                                                     /* number of the last sample */
    gantry_complex response[GANTRY_LINES][GANTRY_MOTORS][GANTRY_MOTORS]; /* speed of a motor over torque of another */
    uint8_t valid[GANTRY_LINES];                                         /* the torques separate */
} gantry_matrix;

/* Returns 0 if it is ready. */
int gantry_begin(void);

/* In the control interrupt: the torques to add in this cycle … */
void gantry_excitation(gantry_real torque_n_m[GANTRY_MOTORS]);

/* … and the torques of this cycle with the speeds measured in it: u1, u2, y1, y2. Constant time except at the end of a
 * period. */
void gantry_tick(const gantry_real signals[GANTRY_SIGNALS]);

/* In the background: whether a matrix is due. It must be taken before the next hop. */
int gantry_ready(void);
const gantry_matrix *gantry_take(void);

#endif
