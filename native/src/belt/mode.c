/* The response of two masses, and its slopes.
 *
 * (14) is α/s + β·s/(s² + 2δ·s + Ω) with α = 1/(J + m), β = 1/J − α, δ = b/2μ, Ω = k/μ, μ = J·m·α. Behind a zero-order
 * hold, and with e = E − 1 of the poles E = e^(pT), it is α·T/w + β·g·w/((w − e1)(w − e2)) with g = (e1 − e2)/(p1 −
 * p2): nothing cancels where lines and poles are near 1. */
#include "belt.h"

/* Sum, product and difference over p1 − p2 of e1 and e2. */
static void set_poles(lb_mode *m, double delta, double square, double tick)
{
    const double root = sqrt(fabs(square));
    if (square < 0.0) {
        const lb_complex e = lb_expm1_of(-delta * tick, root * tick);
        m->sum = 2.0 * e.re;
        m->product = e.re * e.re + e.im * e.im;
        m->g = e.im / root;
    } else {
        const double one = lb_expm1((root - delta) * tick), two = lb_expm1((-root - delta) * tick);
        m->sum = one + two;
        m->product = one * two;
        m->g = (one - two) / (2.0 * root);
    }
}

/* By δ and by Ω; with C = cosh(ρT), ρ² = δ² − Ω and g = e^(−δT)·sinh(ρT)/ρ, sum + 2 = 2·e^(−δT)·C and
 * product = e^(−2δT) − sum − 1. */
static void set_slopes(lb_mode *m, double delta, double square, double tick)
{
    const double bend = (tick * (0.5 * (m->sum + 2.0)) - m->g) / (2.0 * square); /* of g by ρ² alone */
    const double decay = lb_exp(-2.0 * delta * tick);
    m->g_by[0] = 2.0 * delta * bend - tick * m->g;
    m->g_by[1] = -bend;
    m->sum_by[0] = tick * (2.0 * delta * m->g - (m->sum + 2.0));
    m->sum_by[1] = -(tick * m->g);
    m->product_by[0] = -2.0 * tick * decay - m->sum_by[0];
    m->product_by[1] = tick * m->g;
}

lb_mode lb_mode_of(const double *parameters, double tick)
{
    const double motor = lb_exp(parameters[0]), load = lb_exp(parameters[1]);
    const double stiffness = lb_exp(parameters[2]), damping = lb_exp(parameters[3]);
    lb_mode m;
    m.alpha = 1.0 / (motor + load);
    const double of_load = load * m.alpha, of_motor = motor * m.alpha, reduced = motor * of_load;
    const double delta = damping / (2.0 * reduced), omega = stiffness / reduced, square = delta * delta - omega;
    m.beta = of_load / motor;
    m.alpha_by[0] = -(m.alpha * of_motor);
    m.alpha_by[1] = -(m.alpha * of_load);
    m.beta_by[0] = m.alpha * of_motor - 1.0 / motor;
    m.beta_by[1] = m.alpha * of_load;
    m.delta_by[0] = -(delta * of_load);
    m.delta_by[1] = -(delta * of_motor);
    m.delta_by[2] = 0.0;
    m.delta_by[3] = delta;
    m.omega_by[0] = -(omega * of_load);
    m.omega_by[1] = -(omega * of_motor);
    m.omega_by[2] = omega;
    m.omega_by[3] = 0.0;
    set_poles(&m, delta, square, tick);
    set_slopes(&m, delta, square, tick);
    return m;
}

void lb_belt_tiles_of(const lb_belt_grid *grid, lb_belt_tile *tiles)
{
    const double tick = 1.0 / grid->rate_hz;
    for (size_t i = 0; i < lb_tiles(grid->lines) * LB_LANES; ++i) {
        const size_t line = i < grid->lines ? i : 0u, k = i % LB_LANES;
        const double re = grid->step[2u * line], im = grid->step[2u * line + 1u], size = re * re + im * im;
        lb_belt_tile *const to = &tiles[i / LB_LANES];
        to->w.re[k] = re;
        to->w.im[k] = im;
        to->square.re[k] = re * re - im * im;
        to->square.im[k] = 2.0 * re * im;
        to->rigid.re[k] = tick * re / size;
        to->rigid.im[k] = -(tick * im / size);
        to->theta[k] = grid->theta ? grid->theta[line] : 0.0;
    }
}

/* h = 1/(w² − sum·w + product), q = w·h, and the response. */
static inline void respond(const lb_mode *m, const lb_belt_tile *at, lb_lanes *h, lb_lanes *q, lb_lanes *response)
{
    for (size_t k = 0; k < LB_LANES; ++k) {
        const double re = at->square.re[k] - m->sum * at->w.re[k] + m->product;
        const double im = at->square.im[k] - m->sum * at->w.im[k], size = re * re + im * im;
        h->re[k] = re / size;
        h->im[k] = -(im / size);
        q->re[k] = at->w.re[k] * h->re[k] - at->w.im[k] * h->im[k];
        q->im[k] = at->w.re[k] * h->im[k] + at->w.im[k] * h->re[k];
        response->re[k] = m->alpha * at->rigid.re[k] + m->beta * (m->g * q->re[k]);
        response->im[k] = m->alpha * at->rigid.im[k] + m->beta * (m->g * q->im[k]);
    }
}

void lb_belt_evaluate(const lb_mode *m, const lb_belt_tile *at, lb_lanes *response)
{
    lb_lanes h, q;
    respond(m, at, &h, &q, response);
}

void lb_belt_slopes(const lb_mode *m, const lb_belt_tile *at, lb_lanes *response, lb_lanes slope[LB_SLOPES])
{
    lb_lanes h, q, by[2];
    respond(m, at, &h, &q, response);
    for (size_t i = 0; i < 2u; ++i) { /* of g·q by δ and Ω: g'·q + g·q·(sum'·q − product'·h) */
        for (size_t k = 0; k < LB_LANES; ++k) {
            const double re = m->sum_by[i] * q.re[k] - m->product_by[i] * h.re[k];
            const double im = m->sum_by[i] * q.im[k] - m->product_by[i] * h.im[k];
            const double g_re = m->g * q.re[k], g_im = m->g * q.im[k];
            by[i].re[k] = m->g_by[i] * q.re[k] + (g_re * re - g_im * im);
            by[i].im[k] = m->g_by[i] * q.im[k] + (g_re * im + g_im * re);
        }
    }
    for (size_t i = 0; i < LB_BELT_PARAMETERS; ++i) {
        const double delta_by = m->beta * m->delta_by[i], omega_by = m->beta * m->omega_by[i];
        const double alpha_by = i < 2u ? m->alpha_by[i] : 0.0, beta_by = i < 2u ? m->beta_by[i] * m->g : 0.0;
        for (size_t k = 0; k < LB_LANES; ++k) {
            slope[i].re[k] =
                (alpha_by * at->rigid.re[k] + beta_by * q.re[k]) + (delta_by * by[0].re[k] + omega_by * by[1].re[k]);
            slope[i].im[k] =
                (alpha_by * at->rigid.im[k] + beta_by * q.im[k]) + (delta_by * by[0].im[k] + omega_by * by[1].im[k]);
        }
    }
    for (size_t k = 0; k < LB_LANES; ++k) { /* −jθ·G, before it is turned by the delay */
        slope[4].re[k] = at->theta[k] * response->im[k];
        slope[4].im[k] = -(at->theta[k] * response->re[k]);
    }
}
