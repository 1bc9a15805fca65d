/* The belt drive under its cascade, tick by tick. C99; memory belongs to the caller; it uses only libm's sqrt, floor,
 * fabs and (for torque ripple and an eccentric pulley) sin and cos. The readable definition is
 * src/livebode/simulation/twin.py; same order of operations, same bits. */
#ifndef LB_AXIS_H
#define LB_AXIS_H

#include <stddef.h>
#include <stdint.h>

#define LB_AXIS_STATES 6     /* of three masses; two have 4 */
#define LB_AXIS_DELAY_MAX 64 /* ticks */
#define LB_AXIS_SPOTS_MAX 16
#define LB_AXIS_INPUTS 10
#define LB_AXIS_SIGNALS 3

typedef struct {
    double position_m, width_m, loss;
} lb_axis_spot;

/* Constants of a run. */
typedef struct {
    int states; /* 4: two masses (phi, omega, x, v); 6: three masses (phi1, omega1, phi2, omega2, x, v) */
    double motor_inertia_kg_m2, pulley_inertia_kg_m2, radius_m;
    double eccentricity; /* the motor's pulley has the radius radius_m * (1 + eccentricity * sin(phi)) */
    double specific_stiffness_n, pulley_distance_m;
    double damping_shape; /* bs = damping_shape * sqrt(1/l1 + 1/(l2 + l3)) */
    int frozen;           /* the spans are those of frozen_position_m wherever the cart is */
    double frozen_position_m;
    int spots;
    lb_axis_spot spot[LB_AXIS_SPOTS_MAX];
    double motor_coulomb_n_m, motor_viscous_n_m_s, motor_stribeck_n_m;
    double load_coulomb_n, load_viscous_n_s_per_m, load_stribeck_n;
    double stribeck_speed_m_per_s, smoothing_m_per_s;
    double torque_ripple_n_m, torque_ripple_per_turn;
    double rate_hz;
    int halvings; /* of a step in which a play opens or closes */
    int substeps, velocity_ticks, position_ticks, delay_ticks;
    double velocity_gain_n_m_s, integral_step, position_gain_per_s, velocity_feedforward;
    double torque_n_m_max;   /* infinite: none */
    double encoder_step_rad; /* 0: exact */
    double encoder_eccentricity_rad;
    int velocity_differenced;
    double position_m_min, position_m_max;
} lb_axis_config;

/* State of a run. */
typedef struct {
    double plant[LB_AXIS_STATES];
    double integral, held, control, reading, angle;
    double delayed[LB_AXIS_DELAY_MAX];
    int limited;
    uint64_t tick;
} lb_axis_state;

/* Rows of the input: quantities that may change from tick to tick. */
enum {
    LB_AXIS_POSITION_REFERENCE, /* rad */
    LB_AXIS_VELOCITY_REFERENCE, /* rad/s */
    LB_AXIS_EXCITATION,         /* N m */
    LB_AXIS_NOISE,              /* rad/s */
    LB_AXIS_STIFFNESS,          /* factor on every span */
    LB_AXIS_DAMPING,            /* factor on every span */
    LB_AXIS_LOAD,               /* kg */
    LB_AXIS_GAP,                /* m */
    LB_AXIS_FRICTION,           /* factor on all friction */
    LB_AXIS_DISTURBANCE         /* N m on the motor's shaft, not in the logged torque */
};

/* At rest with the motor at position_m / radius_m and no span elongated: the cart is at position_m, except for
 * eccentricity. */
void lb_axis_rest(const lb_axis_config *config, double position_m, lb_axis_state *state);

/* Time derivative of the plant's state under a torque; now[LB_AXIS_INPUTS] is one column of the input. */
void lb_axis_derivative(const lb_axis_config *config, const double *now, double torque_n_m, const double *state,
                        double *derivative);

/* Advances by `ticks`. input: LB_AXIS_INPUTS rows, output: torque, velocity, position reading, then the plant's state,
 * each row `ticks` long and one after the other. Returns the ticks done: fewer than `ticks` when the state at the start
 * of the next one is not finite or the cart is outside its limits; `state` then contains that state. */
size_t lb_axis_advance(const lb_axis_config *config, lb_axis_state *state, size_t ticks, const double *input,
                       double *output);

#endif
