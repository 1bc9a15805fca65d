#include "two_masses.h"

#define LANES LB_TWO_MASSES_LANES
#define ORDER 8

/* A lane for each pair: elongation of the belt, speed of the motor, speed of the cart. */
typedef struct {
    double e[LANES], motor[LANES], cart[LANES];
} lanes;

typedef struct {
    double stiffness[LANES], damping[LANES], per_inertia[LANES], per_load[LANES];
} constants;

/* One step under constant torque: x + sum of h^k/k! times the k-th derivative, of which only the first has the torque.
 */
static inline void step(const constants *c, double radius, double h, double k, double b, const double *torque, lanes *x)
{
    lanes term = *x;
    for (int order = 1; order <= ORDER; ++order) {
        const double share = h / order, drive = order == 1 ? 1.0 : 0.0;
        for (int i = 0; i < LANES; ++i) {
            const double rate = radius * term.motor[i] - term.cart[i];
            const double force = k * c->stiffness[i] * term.e[i] + b * c->damping[i] * rate;
            const double motor = (drive * torque[i] - radius * force) * c->per_inertia[i];
            const double cart = force * c->per_load[i];
            term.e[i] = share * rate;
            term.motor[i] = share * motor;
            term.cart[i] = share * cart;
            x->e[i] += term.e[i];
            x->motor[i] += term.motor[i];
            x->cart[i] += term.cart[i];
        }
    }
}

static void advance(const lb_two_masses_course *course, size_t pairs, const lb_two_masses *pair, const double *torque,
                    size_t stride, double *motor, double *cart)
{
    const double seconds = 1.0 / course->rate_hz;
    lanes x = {{0.0}, {0.0}, {0.0}};
    constants c;
    for (size_t i = 0; i < LANES; ++i) {
        const lb_two_masses *of = &pair[i < pairs ? i : 0];
        c.stiffness[i] = of->stiffness;
        c.damping[i] = of->damping;
        c.per_inertia[i] = 1.0 / of->inertia_kg_m2;
        c.per_load[i] = 1.0 / of->load_kg;
    }
    for (size_t n = 0; n < course->ticks; ++n) {
        double now[LANES];
        for (size_t i = 0; i < LANES; ++i) now[i] = torque[(i < pairs ? i : 0) * stride + n];
        for (size_t i = 0; i < pairs; ++i) {
            motor[i * course->ticks + n] = x.motor[i];
            cart[i * course->ticks + n] = x.cart[i];
        }
        step(&c, course->radius_m, seconds, course->stiffness_n_per_m[n], course->damping_n_s_per_m[n], now, &x);
    }
}

void lb_two_masses_advance(const lb_two_masses_course *course, size_t pairs, const lb_two_masses *pair,
                           const double *torque, size_t stride, double *motor, double *cart)
{
    for (size_t first = 0; first < pairs; first += LANES) {
        const size_t here = pairs - first < LANES ? pairs - first : LANES, at = first * course->ticks;
        advance(course, here, pair + first, torque + first * stride, stride, motor + at, cart + at);
    }
}
