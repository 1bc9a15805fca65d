/* Fits of rows: from measured values to parameters with covariance, or the reason for a failure. */
#include "fit.h"

static const double first_epsilon = 0.1, same = 0.01, epsilon_max = 0.5, lacking = 0.03;
static const double uncertain = 0.5;  /* of a logarithm */
static const double suspicious = 4.0; /* of a reduced chi², ε and all */
static const double near_bound = 1e-6;
static const double explained = 0.5; /* of ε, by a friction */
static const int warm_rounds = 12, rounds = 30, reweighted = 8, friction_rounds = 15;

#define LB_CURVES_OF_PLACES 8u
#define LB_ARRAYS_OF_ROW 8u
#define LB_POINTS 4u

static size_t width_of(size_t lines) { return (lines + LB_LANES - 1u) / LB_LANES * LB_LANES; }

size_t lb_fit_work(const lb_fit_grid *grid)
{
    const size_t curves = LB_CURVES_OF_PLACES + LB_POINTS * (1u + LB_FREE) + 2u + LB_SCANNED;
    return grid ? width_of(grid->lines) * (1u + LB_ARRAYS_OF_ROW + 2u * curves) : 0u;
}

static double *array_of(double **work, size_t width)
{
    double *found = *work;
    *work += width;
    return found;
}

static lb_curve curve_of(double **work, size_t width)
{
    lb_curve found;
    found.re = array_of(work, width);
    found.im = array_of(work, width);
    return found;
}

static void divide_work(lb_job *j, double *work)
{
    const size_t width = j->places.width;
    lb_places *p = &j->places;
    lb_curve *curves[LB_CURVES_OF_PLACES] = {&p->w,         &p->square, &p->before,     &p->once,
                                             &p->once_late, &p->twice,  &p->twice_late, &p->turned};
    double **arrays[LB_ARRAYS_OF_ROW] = {&j->row.re,     &j->row.im,   &j->row.use,  &j->row.noise,
                                         &j->row.weight, &j->row.rest, &j->row.size, &j->row.each};
    lb_point *points[LB_POINTS] = {&j->now, &j->tried, &j->best, &j->other};
    p->theta = array_of(&work, width);
    for (size_t i = 0; i < LB_CURVES_OF_PLACES; ++i) {
        *curves[i] = curve_of(&work, width);
    }
    for (size_t i = 0; i < LB_ARRAYS_OF_ROW; ++i) {
        *arrays[i] = array_of(&work, width);
    }
    for (size_t i = 0; i < LB_POINTS; ++i) {
        points[i]->response = curve_of(&work, width);
        for (size_t k = 0; k < LB_FREE; ++k) {
            points[i]->slope[k] = curve_of(&work, width);
        }
    }
    j->shape = curve_of(&work, width);
    j->rigid = curve_of(&work, width);
    for (size_t k = 0; k < LB_SCANNED; ++k) {
        j->modes[k] = curve_of(&work, width);
    }
}

/* A row into padded arrays, with the measured sizes; returns the number of its lines in use. */
static size_t read_row(lb_job *j, const lb_fit_rows *in, size_t row)
{
    lb_row *r = &j->row;
    size_t count = 0;
    for (size_t i = 0; i < j->places.width; ++i) {
        const size_t at = row * j->places.lines + i;
        const int is_used = i < j->places.lines && in->use[at];
        const double sigma = is_used ? in->sigma[at] : 0.0;
        count += is_used ? 1u : 0u;
        r->use[i] = is_used ? 1.0 : 0.0;
        r->re[i] = is_used ? in->value[2u * at] : 0.0;
        r->im[i] = is_used ? in->value[2u * at + 1u] : 0.0;
        r->noise[i] = sigma > 0.0 ? sigma * sigma : 0.0;
        r->size[i] = r->re[i] * r->re[i] + r->im[i] * r->im[i];
        r->rest[i] = r->each[i] = 0.0;
    }
    return count;
}

/* From the start, and where this fails the best fit of a scan. */
static int begin(lb_job *j, const double *start, double dof)
{
    const lb_fit_model *m = j->model;
    if (!start) {
        return lb_scan(j);
    }
    for (size_t i = 0; i < m->parameters; ++i) {
        j->now.values[i] = m->held[i] == m->held[i] ? m->held[i] : start[i];
    }
    if (!lb_minimise(j, warm_rounds)) {
        return 0;
    }
    if (j->now.is_settled && !(j->now.cost > suspicious * dof)) {
        return 1;
    }
    lb_exchange(&j->now, &j->other);
    if (!lb_scan(j)) {
        return 0;
    }
    if (j->other.is_settled && !(j->now.cost < j->other.cost)) {
        lb_exchange(&j->now, &j->other);
    }
    return 1;
}

static double own_epsilon(lb_job *j, double dof)
{
    return lb_epsilon_for(j->places.width, j->row.rest, j->row.noise, j->row.size, dof);
}

/* Fits repeated with the ε of their residuals until it stays. */
static int reweigh(lb_job *j, double dof, double *epsilon)
{
    *epsilon = first_epsilon;
    for (int i = 0; i < reweighted; ++i) {
        lb_take_residuals(&j->row, j->places.width, j->now.response);
        const double now = own_epsilon(j, dof);
        if (fabs(now - *epsilon) <= same * now) {
            break;
        }
        *epsilon = now;
        lb_weigh(&j->row, j->places.width, now);
        if (!lb_minimise(j, rounds)) {
            return 0;
        }
    }
    return 1;
}

/* A row with a much larger model error than the previous ones is less certain than they were. */
static double widened(lb_job *j, double dof, double epsilon)
{
    lb_take_residuals(&j->row, j->places.width, j->now.response);
    return own_epsilon(j, suspicious * dof) > epsilon ? own_epsilon(j, dof) : epsilon;
}

static double chi_squared(const lb_row *r, size_t width)
{
    double s[LB_LANES] = {0.0};
    int is_known = 0;
    for (size_t i = 0; i < width; ++i) {
        is_known = is_known || r->noise[i] > 0.0;
        s[i % LB_LANES] += r->noise[i] > 0.0 ? 2.0 * r->rest[i] / r->noise[i] : 0.0;
    }
    return is_known ? lb_sum(s, LB_LANES) : lb_not_a_number();
}

static int is_at_bound(const lb_job *j)
{
    const lb_fit_model *m = j->model;
    int found = 0;
    for (size_t k = 0; k < j->free; ++k) {
        const size_t at = j->at[k];
        const double x = lb_coordinate(m, at, j->now.values[at]);
        found = found || x - lb_coordinate(m, at, m->low[at]) < near_bound ||
                lb_coordinate(m, at, m->high[at]) - x < near_bound;
    }
    return found;
}

static int is_unseen(const lb_job *j, double covariance[LB_FREE][LB_FREE])
{
    int found = 0;
    for (size_t k = 0; k < j->free; ++k) {
        for (size_t l = 0; l < j->free; ++l) {
            found = found || !lb_finite(covariance[k][l]);
        }
        found = found || (j->model->low[j->at[k]] > 0.0 && !(sqrt(covariance[k][k]) <= uncertain));
    }
    return found;
}

static void write_response(const lb_job *j, const double *re, const double *im, double *to)
{
    for (size_t i = 0; i < j->places.lines; ++i) {
        to[2u * i] = re[i];
        to[2u * i + 1u] = im[i];
    }
}

/* A row without a number but its degrees of freedom. */
static void write_none(const lb_job *j, const lb_fit_found *out, size_t row, double dof, lb_fit_status status)
{
    const size_t n = j->model->parameters, lines = j->places.lines;
    const double nan = lb_not_a_number();
    for (size_t i = 0; i < n; ++i) {
        out->values[row * n + i] = out->ended[row * n + i] = nan;
    }
    for (size_t i = 0; i < n * n; ++i) {
        out->covariance[row * n * n + i] = nan;
    }
    for (size_t i = 0; i < 2u * lines; ++i) {
        out->response[2u * row * lines + i] = nan;
    }
    out->status[row] = status;
    out->epsilon[row] = out->chi2[row] = nan;
    out->dof[row] = dof;
}

static void write_covariance(const lb_job *j, double small[LB_FREE][LB_FREE], double *to)
{
    const lb_fit_model *m = j->model;
    double outward[LB_FREE];
    for (size_t k = 0; k < j->free; ++k) {
        const size_t at = j->at[k];
        outward[k] = m->low[at] > 0.0 ? j->now.values[at] : m->scale[at];
    }
    for (size_t k = 0; k < j->free; ++k) {
        for (size_t l = 0; l < j->free; ++l) {
            to[j->at[k] * m->parameters + j->at[l]] = outward[k] * small[k][l] * outward[l];
        }
    }
}

/* Status, covariance and numbers of the fit `now`. */
static int judge(lb_job *j, const lb_fit_rows *in, const lb_fit_found *out, size_t row, size_t count, double epsilon)
{
    const size_t n = j->model->parameters, width = j->places.width;
    const double dof = 2.0 * (double)count - (double)j->free, nan = lb_not_a_number();
    double small[LB_FREE][LB_FREE] = {{0.0}};
    lb_take_residuals(&j->row, width, j->now.response);
    lb_weigh(&j->row, width, epsilon);
    if (!lb_covariance(j, in->noise_dof[row], 2.0 * (double)count, small)) {
        return 0;
    }
    const int is_wrong = lb_reduced(&j->row, width, epsilon_max * epsilon_max) > dof;
    const lb_fit_status status = !j->now.is_settled    ? LB_FIT_NOT_CONVERGED
                                 : is_at_bound(j)      ? LB_FIT_AT_BOUND
                                 : is_unseen(j, small) ? LB_FIT_NOT_SEEN
                                 : is_wrong            ? LB_FIT_NO_MODEL
                                                       : LB_FIT_OK;
    for (size_t i = 0; i < n; ++i) {
        out->ended[row * n + i] = j->now.values[i];
        out->values[row * n + i] = status == LB_FIT_OK ? j->now.values[i] : nan;
    }
    for (size_t i = 0; i < n * n; ++i) {
        out->covariance[row * n * n + i] = status == LB_FIT_OK ? 0.0 : nan;
    }
    if (status == LB_FIT_OK) {
        write_covariance(j, small, out->covariance + row * n * n);
    }
    write_response(j, j->now.response.re, j->now.response.im, out->response + 2u * row * j->places.lines);
    out->status[row] = status;
    out->epsilon[row] = status == LB_FIT_OK ? epsilon : nan;
    out->chi2[row] = chi_squared(&j->row, width);
    out->dof[row] = dof;
    return 1;
}

/* Whether ε falls to less than half as soon as one viscous friction is fitted too: dry friction at standstill acts on
 * such a small motion much like a viscous one, and a real viscous one biases stiffness and inertia alike. */
static int is_explained(lb_job *j, const lb_fit_rows *in, size_t row, size_t at, const double *values, double dof)
{
    const lb_fit_model *model = j->model;
    const double epsilon = own_epsilon(j, dof),
                 arm = model->kind == LB_FIT_TWO_MASS && at + 2u == model->parameters ? model->arm : 1.0;
    double scale[LB_FIT_PARAMETERS];
    lb_fit_model wider = *model;
    for (size_t i = 0; i < model->parameters; ++i) {
        j->now.values[i] = values[i];
        scale[i] = model->scale[i];
    }
    /* A friction that stops the motor in as long as ten of the lowest line's radians take. */
    j->now.values[at] = scale[at] = values[0] * (2.0 * LB_PI * j->places.lowest_hz / 10.0) / arm;
    wider.scale = scale;
    read_row(j, in, row);
    lb_weigh(&j->row, j->places.width, epsilon / 2.0);
    j->model = &wider;
    j->at[j->free++] = at;
    const int is_possible = lb_minimise(j, friction_rounds);
    j->model = model;
    --j->free;
    lb_take_residuals(&j->row, j->places.width, j->now.response);
    return is_possible && own_epsilon(j, dof - 1.0) < explained * epsilon;
}

/* Of a row that is fitted with a large error. */
static void examine_friction(lb_job *j, const lb_fit_rows *in, const lb_fit_found *out, size_t row)
{
    const lb_fit_model *m = j->model;
    const size_t n = m->parameters, first = m->kind == LB_FIT_RIGID ? 1u : n - 3u;
    double values[LB_FIT_PARAMETERS];
    const lb_curve fitted = j->shape;
    for (size_t i = 0; i < n; ++i) {
        values[i] = out->ended[row * n + i];
    }
    for (size_t at = first; at + 1u < n && out->status[row] == LB_FIT_OK; ++at) {
        for (size_t i = 0; i < j->places.width; ++i) {
            const size_t from = 2u * (row * j->places.lines + (i < j->places.lines ? i : 0u));
            fitted.re[i] = out->response[from];
            fitted.im[i] = out->response[from + 1u];
        }
        read_row(j, in, row);
        lb_take_residuals(&j->row, j->places.width, fitted);
        if (is_explained(j, in, row, at, values, out->dof[row])) {
            out->status[row] = LB_FIT_FRICTION;
        }
    }
    for (size_t i = 0; i < n * n && out->status[row] == LB_FIT_FRICTION; ++i) {
        out->values[row * n + i % n] = out->covariance[row * n * n + i] = lb_not_a_number();
        out->epsilon[row] = lb_not_a_number();
    }
}

static void fit_row(lb_job *j, const lb_fit_rows *in, const lb_fit_found *out, size_t row)
{
    const size_t count = read_row(j, in, row), n = j->model->parameters;
    const double dof = 2.0 * (double)count - (double)j->free;
    double epsilon = in->epsilon ? in->epsilon[row] : first_epsilon;
    if (!(dof > 0.0)) {
        write_none(j, out, row, dof, LB_FIT_NO_RESPONSE);
        return;
    }
    lb_weigh(&j->row, j->places.width, epsilon);
    int is_possible = begin(j, in->start ? in->start + row * n : NULL, dof);
    if (is_possible && in->epsilon) {
        epsilon = widened(j, dof, epsilon);
    } else if (is_possible) {
        is_possible = reweigh(j, dof, &epsilon);
    }
    if (!is_possible || !judge(j, in, out, row, count, epsilon)) {
        write_none(j, out, row, dof, LB_FIT_NOT_CONVERGED);
    }
    const int has_friction = j->model->kind != LB_FIT_TWO_MASS_GAIN;
    if (has_friction && out->status[row] == LB_FIT_OK &&
        lb_reduced(&j->row, j->places.width, lacking * lacking) > dof) {
        examine_friction(j, in, out, row);
    }
}

static int is_grid_valid(const lb_fit_grid *g)
{
    int valid = g->lines > 0u && g->rate_hz > 0.0;
    for (size_t i = 0; i < g->lines; ++i) {
        valid = valid && g->frequency_hz[i] > 0.0 && g->frequency_hz[i] <= g->rate_hz / 2.0;
    }
    return valid;
}

lb_status lb_fit(const lb_fit_model *model, const lb_fit_grid *grid, const lb_fit_rows *in, const lb_fit_found *out,
                 double *work)
{
    if (!lb_is_complete(model) || !grid || !grid->frequency_hz || !in || !out || !work) {
        return LB_ERROR_NULL;
    }
    if (in->rows && (!in->value || !in->sigma || !in->use || !in->noise_dof || !out->values || !out->covariance ||
                     !out->status || !out->epsilon || !out->chi2 || !out->dof || !out->response || !out->ended)) {
        return LB_ERROR_NULL;
    }
    lb_job j = {0};
    j.model = model;
    j.places.lines = grid->lines;
    j.places.width = width_of(grid->lines);
    for (size_t i = 0; lb_is_valid(model) && i < model->parameters; ++i) {
        if (model->held[i] != model->held[i]) {
            j.at[j.free++] = i;
        }
    }
    if (j.free == 0u || !is_grid_valid(grid)) {
        return LB_ERROR_SIZE;
    }
    divide_work(&j, work);
    lb_find_places(&j.places, grid->frequency_hz, grid->rate_hz);
    for (size_t row = 0; row < in->rows; ++row) {
        fit_row(&j, in, out, row);
    }
    return LB_OK;
}
