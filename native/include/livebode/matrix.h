/* Matrices of frequency responses from the spectra of several experiments, with the covariance of their noise.
 *
 * A repetition has `experiments` windows, `places` rows apart; `history` is a ring of rows, in which the caller's rows
 * follow each other. G = S_yd·S_dd⁻¹ over the windows of the newest repetition, or with `average` of all complete ones;
 * the noise is the scatter of y − G·d around its mean in each experiment, over the repetitions before the newest one,
 * or with `average` over all. All arrays belong to the caller; complex numbers are pairs of re and im. The NumPy
 * equivalent, with the same bits, is tests/twins/matrices.py; where a result is not a number, its sign and payload
 * are not specified.
 */
#ifndef LIVEBODE_MATRIX_H
#define LIVEBODE_MATRIX_H

#include <stddef.h>
#include <stdint.h>

#include "livebode/sdft.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LB_MATRIX_MOST 8u /* outputs, and inputs */

typedef struct {
    size_t outputs, inputs, lines;
    size_t beside; /* further signals that the history has after them, and that nothing is computed from */
    size_t experiments, repetitions, places;
    int average; /* G is that of all complete repetitions */
    int means;   /* their spectra are averaged before G: noise in d then has no bias that remains */
    double condition_max;
    lb_instruction_set set;
} lb_matrix_settings;

/* Windows so far. */
typedef struct {
    size_t length;     /* rows of the ring, at least repetitions·experiments·places */
    double *spectrum;  /* [length][outputs + inputs + beside][2][lines]: re of all lines, then im */
    uint8_t *complete; /* [length], no gap and no invalid sample */
    double *work;      /* [3][inputs][lines] */
} lb_matrix_history;

/* New windows, each at a place of an experiment. */
typedef struct {
    size_t first;           /* row of the ring for the first one */
    size_t rows;            /* at most length − repetitions·experiments·places, so that none that is used is lost */
    size_t of, stride;      /* rows and complex numbers of a row in `spectrum` */
    const double *spectrum; /* [outputs + inputs + beside][of][stride][2] */
    const int64_t *row;     /* [rows], which row of `spectrum` each one is */
    const uint8_t *clean;   /* [of] */
} lb_matrix_windows;

/* For each row and line, and for each row. NaN where a value is not known. */
typedef struct {
    double *value;     /* [rows][lines][outputs][inputs][2] */
    double *noise;     /* [rows][lines][outputs][outputs][2], covariance in the spectra of one window */
    double *spread;    /* [rows][lines][inputs][inputs][2], covariance of the columns for noise of unit power */
    double *coherence; /* [rows][lines][outputs] */
    double *condition; /* [rows][lines], the largest that the norms of the scaled inputs and of their inverse permit */
    double *dof;       /* [rows], of `noise` */
    int64_t *complete; /* [rows], complete repetitions without one that is not between them */
    uint8_t *sure;     /* [rows][lines], the inputs separate beyond doubt; elsewhere the matrix is not to be used */
} lb_matrix_rows;

/* LB_ERROR_NULL for a missing pointer, LB_ERROR_SIZE for numbers that do not fit each other, LB_ERROR_INSTRUCTION_SET
 * for one that this machine does not have. */
lb_status lb_matrix_process(const lb_matrix_settings *settings, const lb_matrix_history *history,
                            const lb_matrix_windows *in, const lb_matrix_rows *out);

#ifdef __cplusplus
}
#endif

#endif
