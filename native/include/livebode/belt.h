/* Two masses joined by a belt, behind a zero-order hold: sampled responses, and normal equations of their fits.
 *
 * Parameters are natural logarithms of what the motor's shaft sees: its inertia and that of the load, kg m²; stiffness,
 * N m/rad; damping, N m s. No function of a mathematical library is used except sqrt, floor and fabs, which IEEE 754
 * defines to the bit. Complex arrays are pairs of re and im; all belong to the caller. The NumPy equivalent, with the
 * same bits, is tests/twins/belt.py; the sign and payload of NaN are not specified.
 */
#ifndef LIVEBODE_BELT_H
#define LIVEBODE_BELT_H

#include <stddef.h>

#include "livebode/sdft.h"

#ifdef __cplusplus
extern "C" {
#endif

#define LB_BELT_PARAMETERS 4u

typedef struct {
    size_t lines;
    double rate_hz;
    const double *step;  /* [lines][2], z − 1 with z = e^(jθ) */
    const double *theta; /* [lines], θ; used where there is a delay */
} lb_belt_grid;

/* Measured responses. */
typedef struct {
    size_t rows;
    const double *value;  /* [rows][lines][2] */
    const double *weight; /* [rows][lines], one over the standard deviation, up to a factor */
} lb_belt_rows;

/* A fit of all rows together: unknowns are the logarithms of both inertias, weights of the splines of the logarithms of
 * stiffness and damping, and a delay of the response in samples; 3 + stiffness + damping of them. */
typedef struct {
    size_t stiffness, damping;
    const double *stiffness_basis; /* [rows][stiffness], value of each spline */
    const double *damping_basis;   /* [rows][damping] */
} lb_belt_splines;

/* Σ (weight·|rest|)², and for unknown k the gradient Σ weight²·Re(conj(slope_k)·rest) and the Gauss–Newton matrix. */
typedef struct {
    double *cost, *gradient, *matrix;
} lb_belt_normal;

/* Numbers of memory that each function needs. */
size_t lb_belt_work(size_t lines);

/* response: [rows][lines][2] of parameters [rows][LB_BELT_PARAMETERS]. */
lb_status lb_belt_response(const lb_belt_grid *grid, size_t rows, const double *parameters, double *response,
                           double *work);

/* Each row by itself: cost [rows], gradient [rows][LB_BELT_PARAMETERS] and the matrices of the rows. */
lb_status lb_belt_each(const lb_belt_grid *grid, const lb_belt_rows *rows, const double *parameters,
                       const lb_belt_normal *out, double *work);

/* All rows together: cost [1], gradient [unknowns], matrix [unknowns][unknowns]. */
lb_status lb_belt_together(const lb_belt_grid *grid, const lb_belt_rows *rows, const lb_belt_splines *splines,
                           const double *unknowns, const lb_belt_normal *out, double *work);

/* A motor, kg m², and a cart, kg, on a pulley of this radius, m. */
typedef struct {
    double inertia, load, radius;
} lb_belt_masses;

/* Constant within a tick: stiffness of the belt, N/m; damping, N s/m; torque of the motor, N m. */
typedef struct {
    size_t ticks;
    double rate_hz;
    const double *stiffness, *damping, *torque; /* [ticks] */
} lb_belt_course;

/* Velocities at the beginning of each tick, from rest: motor, rad/s, and cart, m/s, [ticks] each. Without control and
 * friction; if it diverges, the last values are not finite. */
lb_status lb_belt_replay(const lb_belt_masses *masses, const lb_belt_course *course, double *motor, double *cart);

#ifdef __cplusplus
}
#endif

#endif
