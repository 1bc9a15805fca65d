#include "axis.h"

#include <math.h>
#include <string.h>

#include "dop853.h"

/* Values of one degree of freedom for friction and play. */
typedef struct {
    double slack, rate; /* elongation beyond the play, and its time derivative */
    int region;
} lb_play;

/* Regions of a play within each of which the equations are smooth. */
enum { LB_FREE = 1, LB_CORNER = 2, LB_ABOVE = 4, LB_BELOW = 8 };

/* viscous v + (coulomb + stribeck/(1 + (v/vs)^2)) v/sqrt(v^2 + w^2); `speed` is v in m/s at the belt. */
static double friction(double coulomb, double stribeck, double vs, double w, double speed)
{
    if (coulomb == 0.0 && stribeck == 0.0) return 0.0;
    const double ratio = speed / vs;
    return (coulomb + stribeck / (1.0 + ratio * ratio)) * (speed / sqrt(speed * speed + w * w));
}

/* Dead zone of total width gap; within a twentieth of it around each corner a quartic joins the two straights, smooth
 * up to its second derivative. */
static lb_play play(double gap, double elongation, double rate)
{
    if (gap == 0.0) return (lb_play){elongation, rate, LB_FREE};
    const double round = 0.05 * gap, beyond = fabs(elongation) - 0.5 * gap, into = beyond + round;
    if (into <= 0.0) return (lb_play){0.0, 0.0, LB_FREE};
    if (beyond >= round) return (lb_play){copysign(beyond, elongation), rate, elongation > 0.0 ? LB_ABOVE : LB_BELOW};
    const double square = into * into, unit = 16.0 * (round * round * round);
    const double slope = (3.0 * square * (3.0 * round - beyond) - square * into) / unit;
    return (lb_play){copysign(square * into * (3.0 * round - beyond) / unit, elongation), rate * slope, LB_CORNER};
}

/* Belt that the motor's pulley has moved, the angle at which a pulley without eccentricity moves as much, its arm, and
 * the belt's speed there. */
typedef struct {
    double travel, angle, arm, speed;
} lb_pulley;

static lb_pulley pulley(const lb_axis_config *c, double phi, double omega)
{
    const double r = c->radius_m, e = c->eccentricity;
    if (e == 0.0) return (lb_pulley){r * phi, phi, r, r * omega};
    const double arm = r * (1.0 + e * sin(phi)), angle = phi + e * (1.0 - cos(phi));
    return (lb_pulley){r * angle, angle, arm, arm * omega};
}

static double spots(const lb_axis_config *c, double at)
{
    double factor = 1.0;
    for (int i = 0; i < c->spots; ++i) {
        const double u = (at - c->spot[i].position_m) / c->spot[i].width_m;
        const double bump = 1.0 / (1.0 + u * u);
        factor *= 1.0 - c->spot[i].loss * (bump * bump);
    }
    return factor;
}

/* Stiffness and damping of the whole belt for two masses, of a span of 1 m for three. */
typedef struct {
    double k, b;
} lb_belt;

static lb_belt belt(const lb_axis_config *c, const double *now, double at)
{
    const double shape = 1.0 / at + 1.0 / (2.0 * c->pulley_distance_m - at);
    const double k = c->specific_stiffness_n * now[LB_AXIS_STIFFNESS] * spots(c, at);
    const double b = c->damping_shape * now[LB_AXIS_DAMPING];
    return c->states == 4 ? (lb_belt){k * shape, b * sqrt(shape)} : (lb_belt){k, b / sqrt(shape)};
}

static int two_masses(const lb_axis_config *c, const double *now, lb_belt whole, double torque, const double *s,
                      double *d)
{
    const lb_pulley m = pulley(c, s[0], s[1]);
    const lb_play p = play(now[LB_AXIS_GAP], m.travel - s[2], m.speed - s[3]);
    const double force = whole.k * p.slack + whole.b * p.rate;
    d[0] = s[1];
    d[1] = (torque - m.arm * force) / c->motor_inertia_kg_m2;
    d[2] = s[3];
    d[3] = force;
    return p.region;
}

static int three_masses(const lb_axis_config *c, const double *now, lb_belt span, double at, double torque,
                        const double *s, double *d)
{
    const double r = c->radius_m, l3 = c->pulley_distance_m, k = span.k, b = span.b;
    const lb_pulley m = pulley(c, s[0], s[1]);
    const double s1 = 1.0 / at, s2 = 1.0 / (l3 - at), s3 = 1.0 / l3;
    /* Position of the belt at the cart: that of the cart, or within the play the equilibrium of the spans. */
    const double free = (s1 * m.travel + s2 * (r * s[2])) / (s1 + s2);
    const double free_rate = (s1 * m.speed + s2 * (r * s[3])) / (s1 + s2);
    const lb_play p = play(now[LB_AXIS_GAP], free - s[4], free_rate - s[5]);
    const double x = now[LB_AXIS_GAP] == 0.0 ? s[4] : free - p.slack;
    const double v = now[LB_AXIS_GAP] == 0.0 ? s[5] : free_rate - p.rate;
    const double f1 = s1 * (k * (m.travel - x) + b * (m.speed - v));
    const double f2 = s2 * (k * (x - r * s[2]) + b * (v - r * s[3]));
    const double f3 = s3 * (k * (r * s[2] - m.travel) + b * (r * s[3] - m.speed));
    d[0] = s[1];
    d[1] = (torque - m.arm * f1 + m.arm * f3) / c->motor_inertia_kg_m2;
    d[2] = s[3];
    d[3] = r * (f2 - f3) / c->pulley_inertia_kg_m2;
    d[4] = s[5];
    d[5] = f1 - f2;
    return p.region;
}

/* Time derivative with the belt as it is at the cart, or, where the spans are frozen, as `frozen` has it. Returns the
 * region of the play. */
static inline int derivative(const lb_axis_config *c, const double *now, const lb_belt *frozen, double torque,
                             const double *s, double *d)
{
    const double omega = s[1], v = s[c->states - 1], vs = c->stribeck_speed_m_per_s, w = c->smoothing_m_per_s;
    const double share = now[LB_AXIS_FRICTION], at = c->frozen ? c->frozen_position_m : s[c->states - 2];
    const lb_belt here = c->frozen ? *frozen : belt(c, now, at);
    double drive = torque + now[LB_AXIS_DISTURBANCE] -
                   share * (c->motor_viscous_n_m_s * omega +
                            friction(c->motor_coulomb_n_m, c->motor_stribeck_n_m, vs, w, c->radius_m * omega));
    if (c->torque_ripple_n_m != 0.0) drive += c->torque_ripple_n_m * sin(c->torque_ripple_per_turn * s[0]);
    const int region =
        c->states == 4 ? two_masses(c, now, here, drive, s, d) : three_masses(c, now, here, at, drive, s, d);
    const double resisting =
        share * (c->load_viscous_n_s_per_m * v + friction(c->load_coulomb_n, c->load_stribeck_n, vs, w, v));
    d[c->states - 1] = (d[c->states - 1] - resisting) / now[LB_AXIS_LOAD];
    return region;
}

void lb_axis_derivative(const lb_axis_config *c, const double *now, double torque, const double *s, double *d)
{
    const lb_belt frozen = c->frozen ? belt(c, now, c->frozen_position_m) : (lb_belt){0.0, 0.0};
    derivative(c, now, &frozen, torque, s, d);
}

/* One step of order 8 under constant torque, of n states. Returns the regions of the play that its stages were in. */
static inline int step_of(int n, const lb_axis_config *c, const double *now, double torque, double seconds,
                          double *state)
{
    int regions = 0;
    double slope[LB_STAGES][LB_AXIS_STATES], at[LB_AXIS_STATES];
    const lb_belt frozen = c->frozen ? belt(c, now, c->frozen_position_m) : (lb_belt){0.0, 0.0};
    memcpy(at, state, sizeof at);
    for (int stage = 0; stage < LB_STAGES; ++stage) {
        regions |= derivative(c, now, &frozen, torque, at, slope[stage]);
        const lb_combination *mix = &lb_dop853[stage];
        double sum[LB_AXIS_STATES] = {0.0};
        for (int j = 0; j < mix->terms; ++j)
            for (int i = 0; i < n; ++i) sum[i] += mix->weight[j] * slope[mix->stage[j]][i];
        for (int i = 0; i < n; ++i) at[i] = state[i] + seconds * sum[i];
    }
    memcpy(state, at, sizeof at);
    return regions;
}

/* With the number of states constant the compiler unrolls and vectorises the sums: a fifth faster. */
static int step(const lb_axis_config *c, const double *now, double torque, double seconds, double *state)
{
    return c->states == 4 ? step_of(4, c, now, torque, seconds, state) : step_of(6, c, now, torque, seconds, state);
}

/* A step, or two halves where it crosses from one region of the play into another, down to 2^-halvings of it. */
static void split(const lb_axis_config *c, const double *now, double torque, double seconds, int halvings,
                  double *state)
{
    double before[LB_AXIS_STATES];
    memcpy(before, state, sizeof before);
    const int regions = step(c, now, torque, seconds, state);
    if (halvings == 0 || (regions & (regions - 1)) == 0) return;
    memcpy(state, before, sizeof before);
    split(c, now, torque, 0.5 * seconds, halvings - 1, state);
    split(c, now, torque, 0.5 * seconds, halvings - 1, state);
}

static int alive(const lb_axis_config *c, const lb_axis_state *state)
{
    for (int i = 0; i < c->states; ++i)
        if (!isfinite(state->plant[i])) return 0;
    const double x = state->plant[c->states - 2];
    return x >= c->position_m_min && x <= c->position_m_max;
}

/* Angle that the encoder reads: its disc is eccentric, and has steps. */
static double encoder_reading(const lb_axis_config *c, double angle)
{
    const double q = c->encoder_step_rad, eccentricity = c->encoder_eccentricity_rad;
    const double disc = eccentricity > 0.0 ? angle + eccentricity * sin(angle) : angle;
    return q > 0.0 ? floor(disc / q + 0.5) * q : disc;
}

/* Readings of the drive: the angle in steps of the encoder, and the velocity with the steps' differences. */
static double read_velocity(const lb_axis_config *c, lb_axis_state *state)
{
    const double angle = state->plant[0], reading = encoder_reading(c, angle);
    const double velocity = c->velocity_differenced
                                ? (reading - state->reading) * c->rate_hz
                                : state->plant[1] + ((reading - angle) - (state->reading - state->angle)) * c->rate_hz;
    state->reading = reading;
    state->angle = angle;
    return velocity;
}

/* Position and velocity loop (Nevaranta 2016, Fig. 7), then the delay, the excitation and the limit. */
static double control(const lb_axis_config *c, lb_axis_state *state, const double *now, double velocity)
{
    if (state->tick % (uint64_t)c->position_ticks == 0)
        state->held = c->position_gain_per_s * (now[LB_AXIS_POSITION_REFERENCE] - state->reading) +
                      c->velocity_feedforward * now[LB_AXIS_VELOCITY_REFERENCE];
    if (state->tick % (uint64_t)c->velocity_ticks == 0) {
        const double error = state->held - velocity;
        if (!state->limited) state->integral += error * c->integral_step;
        state->control = c->velocity_gain_n_m_s * (error + state->integral);
    }
    double torque = state->control;
    if (c->delay_ticks > 0) {
        double *slot = &state->delayed[state->tick % (uint64_t)c->delay_ticks];
        torque = *slot;
        *slot = state->control;
    }
    torque += now[LB_AXIS_EXCITATION];
    state->limited = fabs(torque) > c->torque_n_m_max;
    return state->limited ? copysign(c->torque_n_m_max, torque) : torque;
}

void lb_axis_rest(const lb_axis_config *c, double position_m, lb_axis_state *state)
{
    memset(state, 0, sizeof *state);
    state->plant[0] = position_m / c->radius_m;
    const lb_pulley m = pulley(c, state->plant[0], 0.0);
    if (c->states == 6) state->plant[2] = m.angle; /* no span is elongated, not even by rounding */
    state->plant[c->states - 2] = m.travel;
    state->angle = state->plant[0];
    state->reading = encoder_reading(c, state->angle);
}

size_t lb_axis_advance(const lb_axis_config *c, lb_axis_state *state, size_t ticks, const double *input, double *output)
{
    const double seconds = 1.0 / (c->rate_hz * c->substeps);
    for (size_t n = 0; n < ticks; ++n) {
        if (!alive(c, state)) return n;
        double now[LB_AXIS_INPUTS];
        for (int i = 0; i < LB_AXIS_INPUTS; ++i) now[i] = input[(size_t)i * ticks + n];
        const double velocity = read_velocity(c, state) + now[LB_AXIS_NOISE];
        const double torque = control(c, state, now, velocity);
        const double signals[LB_AXIS_SIGNALS] = {torque, velocity, state->reading};
        for (int i = 0; i < LB_AXIS_SIGNALS; ++i) output[(size_t)i * ticks + n] = signals[i];
        for (int i = 0; i < c->states; ++i) output[(size_t)(LB_AXIS_SIGNALS + i) * ticks + n] = state->plant[i];
        for (int i = 0; i < c->substeps; ++i) split(c, now, torque, seconds, c->halvings, state->plant);
        ++state->tick;
    }
    return ticks;
}
