/* Margins of a loop at each fit. */
#include "loop.h"

enum { GAIN_MARGIN, GAIN_REDUCTION, PHASE_MARGIN, DELAY_MARGIN, PEAK, BANDWIDTH };

static const double db = 8.685889638065037; /* of a natural logarithm */
static const double degrees = 180.0 / LB_PI;
static const double peak_step = 1e-3;
static const double bandwidth_square = 0.5011872336272722; /* |T|² 3 dB down */

/* A value with its changes by the parameters, in their sigmas, and those of ln f. */
typedef struct {
    double value, by[LB_FIT_PARAMETERS], by_log_f[LB_FIT_PARAMETERS];
} reading;

static lb_complex negative(lb_complex x)
{
    const lb_complex found = {-x.re, -x.im};
    return found;
}

/* The delay that turns L to −1, ms. */
static double delay_of(double turn_deg, double frequency_hz)
{
    return (turn_deg < 0.0 ? turn_deg + 360.0 : turn_deg) / 360e-3 / frequency_hz;
}

static void keep_if_less(lb_crossing *kept, double *cost, lb_crossing other, double of_other)
{
    if (!kept->is_found || of_other < *cost) {
        *kept = other;
        *cost = of_other;
    }
}

static void take_phase(lb_crossing found, lb_crossing kept[LB_MARGINS], double cost[LB_MARGINS])
{
    const double size = 0.5 * lb_log(lb_square(found.value));
    const size_t margin = size < 0.0 ? GAIN_MARGIN : GAIN_REDUCTION;
    keep_if_less(&kept[margin], &cost[margin], found, fabs(size));
}

static void take_gain(lb_crossing found, lb_crossing kept[LB_MARGINS], double cost[LB_MARGINS])
{
    const double turn = lb_angle(negative(found.value)) * degrees;
    keep_if_less(&kept[PHASE_MARGIN], &cost[PHASE_MARGIN], found, fabs(turn));
    keep_if_less(&kept[DELAY_MARGIN], &cost[DELAY_MARGIN], found, delay_of(turn, found.frequency_hz));
}

static int is_above_one(lb_complex x) { return lb_square(x) > 1.0; }

/* The crossings that determine each margin. */
static void find_crossings(const lb_loop *l, lb_crossing kept[LB_MARGINS])
{
    const size_t last = l->grid->points - 1u;
    double cost[LB_MARGINS] = {0.0};
    int is_below = lb_square(lb_closed(l->curve[0])) < bandwidth_square;
    for (size_t i = 0; i < last; ++i) {
        const lb_complex a = l->curve[i], b = l->curve[i + 1u];
        if (is_above_one(a) != is_above_one(b)) {
            take_gain(lb_root(l, i, lb_gain_side), kept, cost);
        }
        /* At half the rate L is real except for rounding, so the sign there is meaningless. */
        if ((a.im > 0.0) != (b.im > 0.0) && a.re < 0.0 && i + 1u < last) {
            take_phase(lb_root(l, i, lb_phase_side), kept, cost);
        }
        if (!is_below && lb_square(lb_closed(b)) < bandwidth_square) {
            kept[BANDWIDTH] = lb_root(l, i, lb_bandwidth_side);
            is_below = 1;
        }
    }
    if (l->curve[last].re < 0.0) {
        const lb_crossing end = {l->grid->frequency_hz[last], l->curve[last], 1};
        take_phase(end, kept, cost);
    }
    kept[PEAK] = lb_nearest(l);
}

static reading gain(const lb_loop *l, lb_crossing at, const lb_slopes *s, double sign)
{
    reading r = {-sign * db * 0.5 * lb_log(lb_square(at.value)), {0.0}, {0.0}};
    const int is_fixed = at.frequency_hz >= l->grid->rate_hz / 2.0;
    for (size_t i = 0; i < l->model->parameters; ++i) {
        r.by_log_f[i] = is_fixed ? 0.0 : -s->by[i].im / s->by_frequency.im;
        r.by[i] = -sign * db * (s->by[i].re + s->by_frequency.re * r.by_log_f[i]);
    }
    return r;
}

static reading phase(const lb_loop *l, lb_crossing at, const lb_slopes *s)
{
    reading r = {lb_angle(negative(at.value)) * degrees, {0.0}, {0.0}};
    for (size_t i = 0; i < l->model->parameters; ++i) {
        r.by_log_f[i] = -s->by[i].re / s->by_frequency.re;
        r.by[i] = degrees * (s->by[i].im + s->by_frequency.im * r.by_log_f[i]);
    }
    return r;
}

static reading delay(const lb_loop *l, lb_crossing at, const lb_slopes *s)
{
    reading r = phase(l, at, s);
    r.value = delay_of(r.value, at.frequency_hz);
    for (size_t i = 0; i < l->model->parameters; ++i) {
        r.by[i] = r.by[i] / 360e-3 / at.frequency_hz - r.value * r.by_log_f[i];
    }
    return r;
}

/* Changes of ln|1 + L| by ln f (the last) and by each parameter. */
static void distance_slopes(const lb_loop *l, double frequency_hz, double by[LB_FIT_PARAMETERS + 1u])
{
    const lb_complex closed = lb_closed(lb_loop_at(l, frequency_hz));
    const lb_slopes s = lb_slopes_at(l, frequency_hz);
    for (size_t i = 0; i < l->model->parameters; ++i) {
        by[i] = closed.re * s.by[i].re - closed.im * s.by[i].im;
    }
    by[LB_FIT_PARAMETERS] = closed.re * s.by_frequency.re - closed.im * s.by_frequency.im;
}

static reading peak(const lb_loop *l, lb_crossing at, const lb_slopes *s)
{
    const lb_complex closed = lb_closed(at.value), near = {1.0 + at.value.re, at.value.im};
    reading r = {1.0 / sqrt(lb_square(near)), {0.0}, {0.0}};
    const int is_fixed = !(at.frequency_hz < l->grid->rate_hz / 2.0);
    double below[LB_FIT_PARAMETERS + 1u] = {0.0}, above[LB_FIT_PARAMETERS + 1u] = {0.0};
    if (!is_fixed) {
        distance_slopes(l, at.frequency_hz * lb_exp(-peak_step), below);
        distance_slopes(l, at.frequency_hz * lb_exp(peak_step), above);
    }
    const double bends = above[LB_FIT_PARAMETERS] - below[LB_FIT_PARAMETERS];
    for (size_t i = 0; i < l->model->parameters; ++i) {
        r.by[i] = -r.value * (closed.re * s->by[i].re - closed.im * s->by[i].im);
        r.by_log_f[i] = is_fixed ? lb_not_a_number() : -(above[i] - below[i]) / bends;
    }
    return r;
}

static reading bandwidth(const lb_loop *l, lb_crossing at, const lb_slopes *s)
{
    const lb_complex one = {1.0, 0.0}, near = {1.0 + at.value.re, at.value.im}, sensitivity = lb_over(one, near);
    const double by_frequency = sensitivity.re * s->by_frequency.re - sensitivity.im * s->by_frequency.im;
    reading r = {at.frequency_hz, {0.0}, {0.0}};
    for (size_t i = 0; i < l->model->parameters; ++i) {
        r.by_log_f[i] = -(sensitivity.re * s->by[i].re - sensitivity.im * s->by[i].im) / by_frequency;
        r.by[i] = at.frequency_hz * r.by_log_f[i];
    }
    return r;
}

/* Sigma of a quantity from its changes per sigma of each parameter. */
static double spread(const lb_loop *l, const double by[LB_FIT_PARAMETERS])
{
    const size_t n = l->model->parameters;
    double variance = 0.0;
    for (size_t i = 0; i < n; ++i) {
        for (size_t j = 0; j < n; ++j) {
            if (l->sigma[i] > 0.0 && l->sigma[j] > 0.0) {
                variance = variance + by[i] * (l->covariance[i * n + j] / l->sigma[i] / l->sigma[j]) * by[j];
            }
        }
    }
    return variance < 0.0 ? 0.0 : sqrt(variance);
}

static void write(const lb_loop *l, const lb_crossing kept[LB_MARGINS], const lb_margin_rows *out, size_t row)
{
    for (size_t i = 0; i < LB_MARGINS; ++i) {
        const size_t to = row * LB_MARGINS + i;
        out->value[to] = i == BANDWIDTH ? lb_not_a_number() : lb_infinity();
        out->sigma[to] = i == BANDWIDTH ? lb_not_a_number() : 0.0;
        out->frequency_hz[to] = out->frequency_sigma_hz[to] = lb_not_a_number();
        if (kept[i].is_found) {
            const lb_slopes s = lb_slopes_at(l, kept[i].frequency_hz);
            const reading r = i == GAIN_MARGIN      ? gain(l, kept[i], &s, 1.0)
                              : i == GAIN_REDUCTION ? gain(l, kept[i], &s, -1.0)
                              : i == PHASE_MARGIN   ? phase(l, kept[i], &s)
                              : i == DELAY_MARGIN   ? delay(l, kept[i], &s)
                              : i == PEAK           ? peak(l, kept[i], &s)
                                                    : bandwidth(l, kept[i], &s);
            out->value[to] = r.value;
            out->sigma[to] = spread(l, r.by);
            out->frequency_hz[to] = kept[i].frequency_hz;
            out->frequency_sigma_hz[to] = kept[i].frequency_hz * spread(l, r.by_log_f);
        }
    }
}

static void write_nothing(const lb_margin_rows *out, size_t row)
{
    for (size_t i = row * LB_MARGINS; i < (row + 1u) * LB_MARGINS; ++i) {
        out->value[i] = out->sigma[i] = out->frequency_hz[i] = out->frequency_sigma_hz[i] = lb_not_a_number();
    }
}

lb_status lb_margins(const lb_fit_model *model, const lb_feedback *feedback, const lb_margin_grid *grid, size_t rows,
                     const double *values, const double *covariance, const lb_margin_rows *out, double *work)
{
    if (!model || !feedback || !feedback->coefficients || !grid || !grid->frequency_hz || !grid->feedback || !out ||
        !work) {
        return LB_ERROR_NULL;
    }
    if (rows && (!values || !covariance || !out->value || !out->sigma || !out->frequency_hz ||
                 !out->frequency_sigma_hz || !out->is_stable)) {
        return LB_ERROR_NULL;
    }
    if (!lb_is_valid(model) || grid->points < 3u || !feedback->pieces || !(feedback->width > 0.0)) {
        return LB_ERROR_SIZE;
    }
    const size_t n = model->parameters;
    for (size_t row = 0; row < rows; ++row) {
        lb_loop l = {0};
        lb_crossing kept[LB_MARGINS] = {{0.0, {0.0, 0.0}, 0}};
        l.model = model;
        l.feedback = feedback;
        l.grid = grid;
        l.covariance = covariance + row * n * n;
        l.curve = (lb_complex *)(void *)work;
        lb_open_loop(&l, values + row * n);
        const lb_status status =
            lb_fit_response(model, grid->rate_hz, 1u, grid->points, 0u, values + row * n, grid->frequency_hz, work);
        LB_ASSERT(status == LB_OK);
        (void)status;
        for (size_t i = 0; i < grid->points; ++i) {
            const lb_complex behind = {grid->feedback[2u * i], grid->feedback[2u * i + 1u]};
            l.curve[i] = lb_times(l.curve[i], behind);
        }
        out->is_stable[row] = (uint8_t)lb_is_stable(&l);
        if (out->is_stable[row]) {
            find_crossings(&l, kept);
            write(&l, kept, out, row);
        } else {
            write_nothing(out, row);
        }
    }
    return LB_OK;
}
