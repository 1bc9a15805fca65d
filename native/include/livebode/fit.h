/* Weighted least squares of drive models to rows of frequency responses (Levenberg–Marquardt), with covariance.
 *
 * One mass, two masses, or two masses behind an unknown gain, behind a zero-order hold and a delay; their frictions are
 * fixed. Every row is computed by itself. No function of a mathematical library is used except sqrt, floor and
 * fabs, which IEEE 754 defines to the bit. Complex arrays are pairs of re and im; all belong to the caller. The NumPy
 * equivalent, with the same bits, is tests/twins/fit.py; the sign and payload of NaN are not specified.
 */
#ifndef LIVEBODE_FIT_H
#define LIVEBODE_FIT_H

#include <stddef.h>
#include <stdint.h>

#include "livebode/sdft.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LB_FIT_PARAMETERS 7u

typedef enum { LB_FIT_RIGID = 0, LB_FIT_TWO_MASS, LB_FIT_TWO_MASS_GAIN } lb_fit_kind;

/* Parameters in the order of the Python model; with a `ratio` two masses have no load. A parameter with a positive
 * `low` moves as its logarithm, another in units of its `scale`. `held` is NaN for a free one. */
typedef struct {
    lb_fit_kind kind;
    size_t parameters;
    int integrators;                                 /* 1: velocity, 2: position */
    int at_load;                                     /* the output is that of the last mass */
    double lever;                                    /* of the output */
    double arm;                                      /* r², from load to shaft */
    double ratio;                                    /* load's inertia over the motor's, 0 if not known */
    const double *start, *low, *high, *scale, *held; /* [parameters] */
} lb_fit_model;

typedef struct {
    size_t lines;
    const double *frequency_hz; /* [lines] */
    double rate_hz;
} lb_fit_grid;

/* Measured rows. */
typedef struct {
    size_t rows;
    const double *value;     /* [rows][lines][2] */
    const double *sigma;     /* [rows][lines], E|e|² = sigma²; NaN: not known */
    const uint8_t *use;      /* [rows][lines] */
    const double *noise_dof; /* [rows], degrees of freedom of the sigmas */
    const double *start;     /* [rows][parameters], where the search begins; NULL: at a scan */
    const double *epsilon;   /* [rows], error of the model as a share of |G|; NULL: that of each row's residuals */
} lb_fit_rows;

typedef enum {
    LB_FIT_OK = 0,
    LB_FIT_NO_RESPONSE, /* too few lines */
    LB_FIT_NOT_CONVERGED,
    LB_FIT_AT_BOUND,
    LB_FIT_NOT_SEEN, /* a parameter is uncertain by more than half */
    LB_FIT_NO_MODEL, /* error of the model above half of |G| */
    LB_FIT_FRICTION  /* error above 3 %, of which a viscous friction explains more than half */
} lb_fit_status;

/* Results of each row; where the status is not LB_FIT_OK, values, covariance and epsilon are NaN. */
typedef struct {
    double *values;     /* [rows][parameters] */
    double *covariance; /* [rows][parameters][parameters] */
    int64_t *status;    /* [rows], of lb_fit_status */
    double *epsilon;    /* [rows] */
    double *chi2;       /* [rows], by sigma alone */
    double *dof;        /* [rows] */
    double *response;   /* [rows][lines][2], of the model, also where the fit failed */
    double *ended;      /* [rows][parameters], where the search ended */
} lb_fit_found;

/* Number of doubles that lb_fit needs as `work`. */
size_t lb_fit_work(const lb_fit_grid *grid);

/* Fits each row. LB_ERROR_NULL for a missing pointer, LB_ERROR_SIZE for a model of another number of parameters, none
 * free, no lines, or a grid that is not between zero and half the rate. */
lb_status lb_fit(const lb_fit_model *model, const lb_fit_grid *grid, const lb_fit_rows *in, const lb_fit_found *out,
                 double *work);

/* ε ≥ 0 with Σ 2·rest/(noise + ε²·size) = dof of each row; all are squares, [rows][lines], zero where not used. Zero
 * where noise alone explains the residuals. */
lb_status lb_fit_epsilon(size_t rows, size_t lines, const double *rest, const double *noise, const double *size,
                         const double *dof, double *epsilon);

/* Response of the model [rows][lines][2] for values [rows][parameters]. The frequencies of a row, above zero and up to
 * half the rate, are `stride` numbers after those of the previous one; 0 if all rows have the same. LB_ERROR_NULL for a
 * missing pointer, LB_ERROR_SIZE for a model of another number of parameters or rows that overlap. */
lb_status lb_fit_response(const lb_fit_model *model, double rate_hz, size_t rows, size_t lines, size_t stride,
                          const double *values, const double *frequency_hz, double *response);

#ifdef __cplusplus
}
#endif

#endif
