/* Margins of a loop around a fitted plant, with their sigma: L = F·G at the plant's input, broken there.
 *
 * G is a model of livebode/fit.h, F a table. Every row is computed by itself, from IEEE 754 operations alone. The NumPy
 * equivalent, to rounding, is livebode.margins.reading.
 */
#ifndef LIVEBODE_MARGINS_H
#define LIVEBODE_MARGINS_H

#include "livebode/fit.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LB_MARGINS 6u
#define LB_FEEDBACK_DEGREE 15u

/* F over ln f, f in Hz: pieces of equal width from `begin` on, each a series of Chebyshev polynomials. */
typedef struct {
    double begin, width;
    size_t pieces;
    const double *coefficients; /* [pieces][LB_FEEDBACK_DEGREE + 1][2] */
} lb_feedback;

/* Frequencies at which a row is searched, ascending to half the rate, and F there. */
typedef struct {
    size_t points;
    const double *frequency_hz; /* [points] */
    const double *feedback;     /* [points][2] */
    double rate_hz;
} lb_margin_grid;

/* Gain margin and reduction, phase margin, delay margin, peak sensitivity, bandwidth: dB, dB, deg, ms, –, Hz. A margin
 * without a crossing is infinite, a bandwidth NaN; the frequency of what is not there is NaN. */
typedef struct {
    double *value;        /* [rows][LB_MARGINS] */
    double *sigma;        /* [rows][LB_MARGINS], 0 without a crossing */
    double *frequency_hz; /* [rows][LB_MARGINS] */
    double *frequency_sigma_hz;
    uint8_t *is_stable; /* [rows]; where the loop is not stable, the rest is NaN */
} lb_margin_rows;

/* Margins for values [rows][parameters] and their covariance [rows][parameters][parameters]; `work` has 2·points
 * doubles. LB_ERROR_NULL for a missing pointer, LB_ERROR_SIZE for a model of another number of parameters, fewer than
 * three points, or no pieces. */
lb_status lb_margins(const lb_fit_model *model, const lb_feedback *feedback, const lb_margin_grid *grid, size_t rows,
                     const double *values, const double *covariance, const lb_margin_rows *out, double *work);

#ifdef __cplusplus
}
#endif

#endif
