/* Models, from parameters to the sampled response. */
#include "fit.h"

/* Poles nearer to each other than this share of their size are moved apart. */
static const double apart = 1e-5;

int lb_is_complete(const lb_fit_model *m) { return m && m->start && m->low && m->high && m->scale && m->held; }

int lb_is_valid(const lb_fit_model *m)
{
    const size_t of_kind[] = {3u, m->ratio > 0.0 ? 6u : 7u, 6u};
    return (unsigned)m->kind <= LB_FIT_TWO_MASS_GAIN && m->parameters == of_kind[m->kind] &&
           (m->integrators == 1 || m->integrators == 2);
}

static lb_transfer rigid(const lb_fit_model *m, const double *v)
{
    lb_transfer t = {m->lever / v[0], 0.0, 0.0, 1.0, 0.0, 0.0, m->integrators, 0, 0.0};
    if (v[1] != 0.0) {
        t.integrators = m->integrators - 1;
        t.has_slow = 1;
        t.slow = -v[1] / v[0];
    }
    return t;
}

/* The real root nearest to zero of d3·s³ + d2·s² + d1·s + d0, whose coefficients are those of a passive machine: it is
 * between −d2/d3 and 0. Newton's steps, and a bisection where one leaves the interval. */
static double slow_root(double d3, double d2, double d1, double d0)
{
    double low = -d2 / d3, high = 0.0, x = -d0 / d1;
    for (int i = 0; i < 60; ++i) {
        const double value = ((d3 * x + d2) * x + d1) * x + d0, slope = (3.0 * d3 * x + 2.0 * d2) * x + d1;
        low = value < 0.0 ? x : low;
        high = value < 0.0 ? high : x;
        const double newton = x - value / slope;
        const double next = newton > low && newton < high ? newton : 0.5 * (low + high);
        if (fabs(next - x) <= 1e-15 * fabs(x)) {
            return next;
        }
        x = next;
    }
    return x;
}

static lb_transfer two_mass(const lb_fit_model *m, const double *v)
{
    const size_t next = m->ratio > 0.0 ? 1u : 2u;
    const double motor = v[0], load = m->ratio > 0.0 ? motor * m->ratio : v[1] * m->arm;
    const double spring = v[next] * m->arm, damper = v[next + 1u] * m->arm, both = motor + load;
    const double drag = v[next + 2u], load_drag = v[next + 3u] * m->arm, drags = drag + load_drag;
    lb_transfer t = {spring, damper + load_drag, load, both * spring, both * damper, motor * load, m->integrators, 0,
                     0.0};
    if (m->at_load) {
        t.n0 = m->lever * spring;
        t.n1 = m->lever * damper;
        t.n2 = 0.0;
    }
    if (drags != 0.0) {
        const double d3 = motor * load, d2 = motor * (damper + load_drag) + load * (damper + drag);
        const double d1 = both * spring + drag * load_drag + damper * drags, d0 = spring * drags;
        t.integrators = m->integrators - 1;
        t.has_slow = 1;
        t.slow = slow_root(d3, d2, d1, d0);
        t.d1 = d2 + d3 * t.slow;
        t.d0 = -d0 / t.slow;
    }
    return t;
}

static lb_transfer two_mass_gain(const lb_fit_model *m, const double *v)
{
    const double low = 2.0 * LB_PI * v[1], high = 2.0 * LB_PI * v[2];
    lb_transfer t = {
        v[0], 2.0 * v[0] * v[3] / low, v[0] / (low * low), 1.0, 2.0 * v[4] / high, 1.0 / (high * high), m->integrators};
    return t;
}

lb_transfer lb_transfer_of(const lb_fit_model *m, const double *values)
{
    LB_ASSERT(m->parameters <= LB_FIT_PARAMETERS);
    LB_ASSERT(m->integrators == 1 || m->integrators == 2);
    return m->kind == LB_FIT_RIGID      ? rigid(m, values)
           : m->kind == LB_FIT_TWO_MASS ? two_mass(m, values)
                                        : two_mass_gain(m, values);
}

/* Residue over the pole, N(p)/(d2·(p − other)·p^integrators)/p. */
static lb_complex share_of(const lb_transfer *t, lb_complex p, lb_complex other)
{
    lb_complex above = {t->n2 * p.re + t->n1, t->n2 * p.im},
               below = {t->d2 * (p.re - other.re), t->d2 * (p.im - other.im)};
    const lb_complex value = {above.re * p.re - above.im * p.im + t->n0, above.re * p.im + above.im * p.re};
    if (t->has_slow) {
        const lb_complex more = {below.re * (p.re - t->slow) - below.im * p.im,
                                 below.re * p.im + below.im * (p.re - t->slow)};
        below = more;
    }
    for (int i = 0; i <= t->integrators; ++i) {
        const lb_complex more = {below.re * p.re - below.im * p.im, below.re * p.im + below.im * p.re};
        below = more;
    }
    const double size = below.re * below.re + below.im * below.im;
    const lb_complex found = {(value.re * below.re + value.im * below.im) / size,
                              (value.im * below.re - value.re * below.im) / size};
    return found;
}

static void complex_pair(const lb_transfer *t, double re, double im, double tick, double late, lb_sampled *s)
{
    const lb_complex pole = {re, im}, other = {re, -im};
    const lb_complex q = share_of(t, pole, other), end = lb_expm1_of(re * tick, im * tick);
    const lb_complex soon = s->is_late ? lb_expm1_of(re * tick * (1.0 - late), im * tick * (1.0 - late)) : end;
    const lb_complex rest = {end.re - soon.re, end.im - soon.im};
    const lb_complex first = {q.re * soon.re - q.im * soon.im, q.re * soon.im + q.im * soon.re};
    const lb_complex second = {q.re * rest.re - q.im * rest.im, q.re * rest.im + q.im * rest.re};
    s->n1 = 2.0 * first.re;
    s->n0 = -2.0 * (first.re * end.re + first.im * end.im);
    s->late1 = 2.0 * second.re;
    s->late0 = -2.0 * (second.re * end.re + second.im * end.im);
    s->d1 = -2.0 * end.re;
    s->d0 = end.re * end.re + end.im * end.im;
}

static void real_pair(const lb_transfer *t, double one, double two, double tick, double late, lb_sampled *s)
{
    const lb_complex p[2] = {{one, 0.0}, {two, 0.0}};
    double end[2], first[2], second[2];
    for (size_t i = 0; i < 2u; ++i) {
        const double q = share_of(t, p[i], p[1u - i]).re;
        end[i] = lb_expm1(p[i].re * tick);
        const double soon = s->is_late ? lb_expm1(p[i].re * tick * (1.0 - late)) : end[i];
        first[i] = q * soon;
        second[i] = q * (end[i] - soon);
    }
    s->n1 = first[0] + first[1];
    s->n0 = -(first[0] * end[1] + first[1] * end[0]);
    s->late1 = second[0] + second[1];
    s->late0 = -(second[0] * end[1] + second[1] * end[0]);
    s->d1 = -(end[0] + end[1]);
    s->d0 = end[0] * end[1];
}

static void section(const lb_transfer *t, double tick, double late, lb_sampled *s)
{
    const double half = -t->d1 / t->d2 / 2.0, product = t->d0 / t->d2, under = half * half - product;
    const double turn = sqrt(fabs(under));
    if (2.0 * turn < apart * sqrt(fabs(product))) {
        real_pair(t, half * (1.0 - apart), half * (1.0 + apart), tick, late, s);
    } else if (under < 0.0) {
        complex_pair(t, half, turn, tick, late, s);
    } else {
        /* The larger one first: the difference of half and turn would lose the smaller one's digits. */
        const double large = half > 0.0 ? half + turn : half - turn;
        real_pair(t, product / large, large, tick, late, s);
    }
}

/* The slow pole, whose residue has the whole section below it. */
static void slow_section(const lb_transfer *t, double tick, double late, lb_sampled *s)
{
    const double p = t->slow;
    double below = (t->d2 * p + t->d1) * p + t->d0;
    for (int i = 0; i <= t->integrators; ++i) {
        below = below * p;
    }
    const double q = ((t->n2 * p + t->n1) * p + t->n0) / below;
    s->slow_end = lb_expm1(p * tick);
    const double soon = s->is_late ? lb_expm1(p * tick * (1.0 - late)) : s->slow_end;
    s->slow = q * soon;
    s->slow_late = q * (s->slow_end - soon);
}

lb_sampled lb_sampled_of(const lb_transfer *t, double tick, double delay_s)
{
    lb_sampled s = {0};
    const double ticks = delay_s / tick;
    s.ticks = floor(ticks);
    s.is_late = ticks != 0.0;
    s.is_double = t->integrators == 2;
    s.has_section = t->d2 != 0.0;
    const double late = ticks - s.ticks, soon = s.is_late ? (1.0 - late) * tick : tick, rest = tick - soon;
    s.has_slow = t->has_slow;
    if (t->integrators > 0) {
        const double constant = t->n0 / (t->has_slow ? t->d0 * -t->slow : t->d0),
                     speed = s.is_double ? (t->n1 - constant * t->d1) / t->d0 : constant;
        const double place = s.is_double ? constant : 0.0;
        s.a = speed * soon + place * (soon * soon / 2.0);
        s.b = speed * rest + place * ((tick * tick - soon * soon) / 2.0);
        s.c = place * tick * soon;
        s.d = place * tick * rest;
    }
    if (s.has_section) {
        section(t, tick, late, &s);
    }
    if (s.has_slow) {
        slow_section(t, tick, late, &s);
    }
    return s;
}

static void add_section(const lb_places *p, const lb_sampled *s, lb_curve to)
{
    for (size_t i = 0; i < p->width; ++i) {
        const double below_re = p->square.re[i] + s->d1 * p->w.re[i] + s->d0;
        const double below_im = p->square.im[i] + s->d1 * p->w.im[i];
        double re = s->n1 * p->w.re[i] + s->n0, im = s->n1 * p->w.im[i];
        if (s->is_late) {
            const double late_re = s->late1 * p->w.re[i] + s->late0, late_im = s->late1 * p->w.im[i];
            re = re + (late_re * p->before.re[i] - late_im * p->before.im[i]);
            im = im + (late_re * p->before.im[i] + late_im * p->before.re[i]);
        }
        const double size = below_re * below_re + below_im * below_im;
        to.re[i] = to.re[i] + (re * below_re + im * below_im) / size;
        to.im[i] = to.im[i] + (im * below_re - re * below_im) / size;
    }
}

static void add_slow(const lb_places *p, const lb_sampled *s, lb_curve to)
{
    for (size_t i = 0; i < p->width; ++i) {
        const double below_re = p->w.re[i] - s->slow_end, below_im = p->w.im[i];
        const double re = s->is_late ? s->slow + s->slow_late * p->before.re[i] : s->slow;
        const double im = s->is_late ? s->slow_late * p->before.im[i] : 0.0;
        const double size = below_re * below_re + below_im * below_im;
        to.re[i] = to.re[i] + (re * below_re + im * below_im) / size;
        to.im[i] = to.im[i] + (im * below_re - re * below_im) / size;
    }
}

static void turn_back(lb_places *p, double ticks, lb_curve to)
{
    if (p->ticks != ticks) {
        for (size_t i = 0; i < p->width; ++i) {
            const lb_complex z = lb_turned(-(p->theta[i] * ticks));
            p->turned.re[i] = z.re;
            p->turned.im[i] = z.im;
        }
        p->ticks = ticks;
    }
    for (size_t i = 0; i < p->width; ++i) {
        const double re = to.re[i], im = to.im[i];
        to.re[i] = re * p->turned.re[i] - im * p->turned.im[i];
        to.im[i] = re * p->turned.im[i] + im * p->turned.re[i];
    }
}

void lb_evaluate(lb_places *p, const lb_sampled *s, lb_curve to)
{
    LB_ASSERT(p->lines <= p->width);
    for (size_t i = 0; i < p->width; ++i) {
        to.re[i] = s->a * p->once.re[i];
        to.im[i] = s->a * p->once.im[i];
    }
    if (s->is_double) {
        for (size_t i = 0; i < p->width; ++i) {
            to.re[i] = to.re[i] + s->c * p->twice.re[i];
            to.im[i] = to.im[i] + s->c * p->twice.im[i];
        }
    }
    if (s->is_late) {
        for (size_t i = 0; i < p->width; ++i) {
            to.re[i] = to.re[i] + (s->b * p->once_late.re[i] + s->d * p->twice_late.re[i]);
            to.im[i] = to.im[i] + (s->b * p->once_late.im[i] + s->d * p->twice_late.im[i]);
        }
    }
    if (s->has_section) {
        add_section(p, s, to);
    }
    if (s->has_slow) {
        add_slow(p, s, to);
    }
    if (s->ticks != 0.0) {
        turn_back(p, s->ticks, to);
    }
}

void lb_respond(lb_places *p, const lb_fit_model *m, const double *values, lb_curve to)
{
    const lb_transfer t = lb_transfer_of(m, values);
    const lb_sampled s = lb_sampled_of(&t, p->tick, values[m->parameters - 1u]);
    lb_evaluate(p, &s, to);
}
