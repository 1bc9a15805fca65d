/* Two masses under a measured torque, along measured positions.
 *
 * The momentum J·ω + r·m·v is the sum of the torque alone. What is left is an oscillator of the belt's elongation and
 * its rate ω·r − v, whose transition over a tick does not depend on the state: it is computed for several ticks at
 * once, and the recursion that remains has few dependent operations. */
#include "belt.h"

#define ORDER 8u /* of the Taylor series, as of the simulated axis */

/* After a tick: elongation and rate from a rate of 1, and elongation from an acceleration of 1. All else follows. */
typedef struct {
    double e[LB_LANES], rate[LB_LANES], pushed[LB_LANES];
} transition;

static inline void find_transition(double tick, const double *stiffness, const double *damping, transition *t)
{
    double e[LB_LANES], rate[LB_LANES];
    for (size_t k = 0; k < LB_LANES; ++k) {
        e[k] = t->e[k] = t->pushed[k] = 0.0;
        rate[k] = t->rate[k] = 1.0;
    }
    for (unsigned order = 1u; order <= ORDER; ++order) {
        const double share = tick / (double)order;
        for (size_t k = 0; k < LB_LANES; ++k) {
            const double pushed = share * e[k];
            e[k] = share * rate[k];
            rate[k] = -(stiffness[k] * pushed + damping[k] * e[k]);
            t->pushed[k] += pushed;
            t->e[k] += e[k];
            t->rate[k] += rate[k];
        }
    }
}

lb_status lb_belt_replay(const lb_belt_masses *masses, const lb_belt_course *course, double *motor, double *cart)
{
    if (!masses || !course || !course->stiffness || !course->damping || !course->torque || !motor || !cart) {
        return LB_ERROR_NULL;
    }
    const double radius = masses->radius, arm = radius * masses->load, tick = 1.0 / course->rate_hz;
    const double share = radius * radius / masses->inertia + 1.0 / masses->load;
    const double whole = 1.0 / (masses->inertia + radius * arm), push = radius / masses->inertia;
    double e = 0.0, rate = 0.0, momentum = 0.0;
    for (size_t first = 0; first < course->ticks; first += LB_LANES) {
        const size_t here = course->ticks - first < LB_LANES ? course->ticks - first : LB_LANES;
        double stiffness[LB_LANES], damping[LB_LANES], rates[LB_LANES] = {0.0}, momenta[LB_LANES] = {0.0};
        transition t;
        for (size_t k = 0; k < LB_LANES; ++k) {
            stiffness[k] = share * course->stiffness[first + (k < here ? k : 0u)];
            damping[k] = share * course->damping[first + (k < here ? k : 0u)];
        }
        find_transition(tick, stiffness, damping, &t);
        for (size_t k = 0; k < here; ++k) {
            const double torque = course->torque[first + k], pull = push * torque - stiffness[k] * e;
            rates[k] = rate;
            momenta[k] = momentum;
            e = e + (t.e[k] * rate + t.pushed[k] * pull);
            rate = t.rate[k] * rate + t.e[k] * pull;
            momentum = momentum + tick * torque;
        }
        for (size_t k = 0; k < here; ++k) {
            motor[first + k] = (momenta[k] + arm * rates[k]) * whole;
            cart[first + k] = radius * motor[first + k] - rates[k];
        }
    }
    return LB_OK;
}
