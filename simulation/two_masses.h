/* Many pairs of masses joined by a belt, each under a measured torque, in one pass over the samples. C99; memory
 * belongs to the caller. The plant is that of axis.h with two masses, without friction, play and eccentricity; it is
 * linear while the stiffness of a tick is constant, so a Taylor series of order 8 has the order of dop853.h. */
#ifndef LB_TWO_MASSES_H
#define LB_TWO_MASSES_H

#include <stddef.h>

/* Pairs that are advanced together; more are advanced in turn. */
#define LB_TWO_MASSES_LANES 8

/* Constants of one pair: the motor's inertia in kg m^2, the load in kg, and factors on the common stiffness and
 * damping. */
typedef struct {
    double inertia_kg_m2, load_kg, stiffness, damping;
} lb_two_masses;

/* Common to all: the stiffness in N/m and the damping in N s/m at each tick. */
typedef struct {
    size_t ticks;
    double rate_hz, radius_m;
    const double *stiffness_n_per_m, *damping_n_s_per_m;
} lb_two_masses_course;

/* From rest. torque_n_m: `ticks` values for each pair, one pair after the other, those of the next pair `stride` values
 * further (0: all have the same); motor: rad/s and cart: m/s at the beginning of each tick, `pairs` rows; cart may be
 * null. A pair that diverges has values that are not finite. */
void lb_two_masses_advance(const lb_two_masses_course *course, size_t pairs, const lb_two_masses *pair,
                           const double *torque_n_m, size_t stride, double *motor, double *cart);

#endif
