#include "instruction_sets.h"
#include "two_masses.h"

#define LANES LB_TWO_MASSES_LANES
#define ORDER 8

/* Lanes that are one vector. A step is a chain of dependent operations, which wide vectors make no longer. */
#if defined(__AVX2__) && !defined(__AVX512F__)
#define WIDTH 4
#else
#define WIDTH 8
#endif
typedef double vec __attribute__((vector_size(WIDTH * sizeof(double)), aligned(sizeof(double)), may_alias));

/* Of WIDTH pairs: elongation of the belt, speed of the motor, speed of the cart; and their constants. */
typedef struct {
    vec e, motor, cart;
} masses;

typedef struct {
    vec stiffness, damping, per_inertia, per_load;
} constants;

/* One step under constant torque: x + sum of h^k/k! times the k-th derivative, of which only the first has the torque.
 */
static inline void step(const constants *c, double radius, double h, double k, double b, const vec *torque, masses *x)
{
    const vec stiffness = k * c->stiffness, damping = b * c->damping, none = {0.0};
    masses term = *x;
    for (int order = 1; order <= ORDER; ++order) {
        const double share = h / order;
        const vec rate = radius * term.motor - term.cart, force = stiffness * term.e + damping * rate;
        const vec drive = order == 1 ? *torque : none;
        term.e = share * rate;
        term.motor = share * ((drive - radius * force) * c->per_inertia);
        term.cart = share * (force * c->per_load);
        x->e += term.e;
        x->motor += term.motor;
        x->cart += term.cart;
    }
}

static void advance(const lb_two_masses_course *course, size_t pairs, const lb_two_masses *pair, const double *torque,
                    size_t stride, double *motor, double *cart)
{
    const double seconds = 1.0 / course->rate_hz;
    const size_t vectors = (pairs + WIDTH - 1) / WIDTH;
    masses x[LANES / WIDTH];
    constants c[LANES / WIDTH];
    for (size_t i = 0; i < vectors * WIDTH; ++i) {
        const lb_two_masses *of = &pair[i < pairs ? i : 0];
        const size_t v = i / WIDTH, lane = i % WIDTH;
        c[v].stiffness[lane] = of->stiffness;
        c[v].damping[lane] = of->damping;
        c[v].per_inertia[lane] = 1.0 / of->inertia_kg_m2;
        c[v].per_load[lane] = 1.0 / of->load_kg;
        x[v].e[lane] = x[v].motor[lane] = x[v].cart[lane] = 0.0;
    }
    for (size_t n = 0; n < course->ticks; ++n) {
        double now[LANES];
        for (size_t i = 0; i < vectors * WIDTH; ++i) now[i] = torque[(i < pairs ? i : 0) * stride + n];
        for (size_t i = 0; i < pairs; ++i) {
            motor[i * course->ticks + n] = x[i / WIDTH].motor[i % WIDTH];
            if (cart) cart[i * course->ticks + n] = x[i / WIDTH].cart[i % WIDTH];
        }
        for (size_t v = 0; v < vectors; ++v) {
            step(&c[v], course->radius_m, seconds, course->stiffness_n_per_m[n], course->damping_n_s_per_m[n],
                 (const vec *)(const void *)(now + v * WIDTH), &x[v]);
        }
    }
}

void LB_FOR_SET(lb_two_masses_advance)(const lb_two_masses_course *course, size_t pairs, const lb_two_masses *pair,
                                       const double *torque, size_t stride, double *motor, double *cart)
{
    for (size_t first = 0; first < pairs; first += LANES) {
        const size_t here = pairs - first < LANES ? pairs - first : LANES, at = first * course->ticks;
        advance(course, here, pair + first, torque + first * stride, stride, motor + at, cart ? cart + at : cart);
    }
}
