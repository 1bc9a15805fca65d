/* From spectra at lines to frequency responses with their scatter: what follows the sliding DFT.
 *
 * Numerator and denominator of an estimate are the output's spectrum and another, each times conj(reference). Windows
 * one period apart are a series: a period has `places`, each with its own moments. All arrays belong to the caller;
 * arrays of spectra are pairs of re and im. The NumPy equivalent, with the same bits, is tests/twins/lines.py;
 * where a result is not a number, its sign and payload are not specified.
 */
#ifndef LIVEBODE_LINES_H
#define LIVEBODE_LINES_H

#include <stddef.h>
#include <stdint.h>

#include "livebode/sdft.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LB_LINE_MEANS 10u
#define LB_LINE_SCATTER 4u
#define LB_LINE_CHANGES 5u
#define LB_LINE_SUMS 6u
#define LB_LINE_PLACE 5u

/* Sums of the forgetting weights over c windows, c = 0 … length − 1, the last ones for more: Σλ^i, Σλ^2i, Σλ^3i, Σiλ^i,
 * Σλ^i(i − μ)², Σλ^2i(i − μ)² for i < c, with μ = Σiλ^i/Σλ^i the mean age. Where λ = 1 there is no table. */
typedef struct {
    double forgetting;   /* λ per period, 0 < λ ≤ 1 */
    const double *table; /* [LB_LINE_SUMS][length] */
    size_t length;
} lb_line_weights;

/* Running moments: zeros before the first window. */
typedef struct {
    size_t places, lines;
    int64_t *count;  /* [places], windows that were added */
    double *means;   /* [LB_LINE_MEANS][places][lines]: re and im of numerator, denominator, reference; the powers of
                        reference, output, noise at detection lines, denominator's signal */
    double *scatter; /* [LB_LINE_SCATTER][places][lines]: Σλ^i·|δnum|², |δden|², re and im of δnum·conj(δden) */
    double *change;  /* [LB_LINE_CHANGES][places][lines], of the error numerator − Ĝ·denominator of a window:
                        Σλ^i·|step|² of the steps from one period to the next, re and im of Σλ^i(μ − i)·error, re and im
                        of the newest error */
    double *moment;  /* [LB_LINE_PLACE][places]: means of time and schedule, number of the oldest sample, all updated
                        with averages; lines with a trend, and with more scatter than steps, in the newest window */
} lb_line_moments;

/* Where the variance of numerator − Ĝ·denominator is from. */
typedef enum {
    LB_NOISE_SCATTER = 0, /* the scatter between periods */
    LB_NOISE_MOVING,      /* detection lines, in windows in which the machine moves; else the scatter */
    LB_NOISE_LARGER       /* also without motion the detection lines, where they have more */
} lb_line_noise;

typedef struct {
    int averages; /* the value is that of all windows so far, and not of one */
    int direct;   /* the reference is the denominator's signal: the weight is its power */
    lb_line_noise noise;
    double noise_dof;     /* degrees of freedom of the noise at detection lines */
    double dof_repeating; /* and of the errors that repeat */
    lb_instruction_set set;
} lb_line_settings;

/* Windows at consecutive places, from `place` on. Rows of spectra are `stride` complex numbers apart. */
typedef struct {
    size_t place, rows, stride;
    const double *output, *denominator, *reference; /* [rows][stride][2] */
    const double *noise;                            /* [rows][lines], power at the detection lines; NULL without */
    const uint8_t *whole;                           /* [rows], no gap and no invalid sample */
    const uint8_t *clean;                           /* [rows], and no spike */
    const uint8_t *aside;                           /* [rows], nothing is learned from it; NULL without */
    const uint8_t *moving;                          /* [rows], the machine moves; NULL if never */
    const double *distortion;                       /* [verdicts][lines], errors that repeat, NaN where not known; NULL
                                                       without */
    const uint8_t *invalid;                         /* [verdicts][lines], invalid because of them; NULL without */
    const int64_t *verdict;                         /* [rows], which verdict is that of the row */
    size_t verdicts;
    const double *moment; /* [3][rows]: time, schedule, oldest sample */
} lb_line_windows;

/* For each row and line, and for each row. NaN where a value is not known. */
typedef struct {
    double *value;           /* [rows][lines][2] */
    double *sigma;           /* [rows][lines], of the value */
    double *coherence;       /* [rows][lines], of reference and output, without its bias */
    double *input_coherence; /* [rows][lines], of reference and denominator; NaN for `direct` */
    double *weight;          /* [rows][lines][2], of the row in a mean */
    double *distortion;      /* [rows][lines] */
    double *variation;       /* [rows][lines], part of sigma from a change of the machine */
    uint8_t *valid;          /* [rows][lines] */
    double *dof;             /* [rows] */
    double *moment;          /* [3][rows], of what the value is of */
    uint8_t *usable;         /* [rows], whether the window entered the moments */
} lb_line_rows;

/* Responses of the windows, whose moments are updated, and so is the largest power of the reference so far.
 *
 * LB_ERROR_NULL for a missing pointer, LB_ERROR_SIZE for a place that the period does not have, no places or lines,
 * rows that are closer than their lines, or a verdict that does not exist, LB_ERROR_INSTRUCTION_SET for one that this
 * machine does not have. */
lb_status lb_lines_process(const lb_line_weights *weights, const lb_line_moments *moments, double *largest,
                           const lb_line_settings *settings, const lb_line_windows *in, const lb_line_rows *out);

#ifdef __cplusplus
}
#endif

#endif
