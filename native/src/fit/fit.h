/* What the files of the fit share. Private.
 *
 * Arrays over lines are padded to `width`, a multiple of LB_LANES: sums have that many partial sums in a fixed order,
 * so that a compiler may use vectors and the bits stay. A padded line has weight zero and the tables of the first. */
#ifndef LB_FIT_PRIVATE_H
#define LB_FIT_PRIVATE_H

#include "../elementary.h"
#include "livebode/fit.h"

#define LB_LANES 8u
#define LB_SCANNED 48u /* resonances */
#define LB_TRIED 4u    /* of them */
#define LB_FREE LB_FIT_PARAMETERS

typedef struct {
    double *re, *im;
} lb_curve;

/* Lines, z = e^(jθ), w = z − 1. */
typedef struct {
    size_t lines, width;
    double tick, lowest_hz, highest_hz;
    double *theta;
    lb_curve w, square, before; /* w, w², 1/z */
    lb_curve once, once_late;   /* 1/w, 1/(z·w) */
    lb_curve twice, twice_late; /* 1/w², 1/(z·w²) */
    lb_curve turned;            /* z^−ticks */
    double ticks;
} lb_places;

/* Numerator and denominator in s, by powers, over s^integrators; with `has_slow` also over s − slow. */
typedef struct {
    double n0, n1, n2, d0, d1, d2;
    int integrators;
    int has_slow;
    double slow;
} lb_transfer;

/* Behind the hold: once·a + once_late·b + twice·c + twice_late·d, and a section of second order in w; a delay adds the
 * late parts, and whole ticks. */
typedef struct {
    double a, b, c, d;
    double n0, n1, late0, late1, d0, d1;
    double slow, slow_late, slow_end; /* a section of first order, slow/(w − slow_end) */
    int has_section, has_slow, is_late, is_double;
    double ticks;
} lb_sampled;

/* A row as it is fitted. */
typedef struct {
    double *re, *im, *use, *noise, *weight; /* noise: sigma², 0 where it is not known; weight: squared */
    double *rest, *size, *each;             /* |residual|², |G|², and scratch */
} lb_row;

/* A point of the search: coordinates, cost, and the response with its slopes. */
typedef struct {
    double x[LB_FREE], values[LB_FREE], cost, gradient[LB_FREE], matrix[LB_FREE][LB_FREE];
    int is_settled;
    lb_curve response, slope[LB_FREE];
} lb_point;

typedef struct {
    const lb_fit_model *model;
    size_t free, at[LB_FREE]; /* number and positions of the free parameters */
    lb_places places;
    lb_row row;
    lb_point now, tried, best, other;
    lb_curve shape, rigid, modes[LB_SCANNED];
    double omega[LB_SCANNED];
    int has_modes;
} lb_job;

static inline double lb_sum(const double *x, size_t width)
{
    double s[LB_LANES] = {0.0};
    LB_ASSERT(width % LB_LANES == 0u);
    for (size_t i = 0; i < width; i += LB_LANES) {
        for (size_t k = 0; k < LB_LANES; ++k) {
            s[k] += x[i + k];
        }
    }
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

/* Σ square·Re(a·conj(b)) */
static inline double lb_product(const double *square, lb_curve a, lb_curve b, size_t width)
{
    double s[LB_LANES] = {0.0};
    LB_ASSERT(width % LB_LANES == 0u);
    for (size_t i = 0; i < width; i += LB_LANES) {
        for (size_t k = 0; k < LB_LANES; ++k) {
            s[k] += square[i + k] * (a.re[i + k] * b.re[i + k] + a.im[i + k] * b.im[i + k]);
        }
    }
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

static inline int lb_finite(double x) { return x - x == 0.0; }
static inline double lb_clipped(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

/* places.c */
void lb_find_places(lb_places *p, const double *frequency_hz, double rate_hz);
/* model.c */
int lb_is_complete(const lb_fit_model *m);
int lb_is_valid(const lb_fit_model *m);
lb_transfer lb_transfer_of(const lb_fit_model *m, const double *values);
lb_sampled lb_sampled_of(const lb_transfer *t, double tick, double delay_s);
void lb_evaluate(lb_places *p, const lb_sampled *s, lb_curve to);
void lb_respond(lb_places *p, const lb_fit_model *m, const double *values, lb_curve to);
/* solve.c: matrix·x = right by Gauss with partial pivoting; 0 if the matrix is singular. Both are overwritten. */
int lb_solve(size_t n, double matrix[LB_FREE][LB_FREE], size_t columns, double right[LB_FREE][LB_FREE]);
/* minimise.c: from `now.values`; 0 if a matrix is singular. The result is `now`. */
int lb_minimise(lb_job *j, int rounds);
double lb_coordinate(const lb_fit_model *m, size_t at, double value);
/* scan.c: the best of the fits from a scan is `now`. */
int lb_scan(lb_job *j);
/* weighing.c: weights for the sizes of the row, and residuals and sizes of a response. */
void lb_weigh(lb_row *r, size_t width, double epsilon);
void lb_take_residuals(lb_row *r, size_t width, lb_curve response);
double lb_reduced(const lb_row *r, size_t width, double square);
double lb_epsilon_for(size_t count, const double *rest, const double *noise, const double *size, double dof);
/* covariance.c: of the coordinates, not a number where the lines do not determine them; 0 if it is singular. */
int lb_covariance(lb_job *j, double noise_dof, double count, double to[LB_FREE][LB_FREE]);

static inline void lb_exchange(lb_point *a, lb_point *b)
{
    const lb_point x = *a;
    *a = *b;
    *b = x;
}

#endif
