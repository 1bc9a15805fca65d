/* Levenberg–Marquardt. */
#include "fit.h"

static const double step_of_slope = 1e-7, tolerance = 1e-10, rise = 10.0, fall = 0.2;
static const double enough = 1e-4;      /* of chi²: a step of 1 % of sigma */
static const double largest_step = 0.7; /* of a logarithm: a factor of two */

double lb_coordinate(const lb_fit_model *m, size_t at, double value)
{
    return m->low[at] > 0.0 ? lb_log(fabs(value)) : value / m->scale[at];
}

static double value_of(const lb_fit_model *m, size_t at, double x)
{
    return m->low[at] > 0.0 ? lb_exp(x) : x * m->scale[at];
}

/* Cost, gradient and matrix at the coordinates of a point; an infinite cost where they are not numbers. */
static void measure(lb_job *j, lb_point *p)
{
    const size_t width = j->places.width;
    const double *weight = j->row.weight;
    int is_finite = 1;
    for (size_t k = 0; k < j->free; ++k) {
        p->values[j->at[k]] = value_of(j->model, j->at[k], p->x[k]);
    }
    lb_respond(&j->places, j->model, p->values, p->response);
    for (size_t k = 0; k < j->free; ++k) {
        const size_t at = j->at[k];
        const double value = p->values[at];
        const lb_curve slope = p->slope[k];
        p->values[at] = value_of(j->model, at, p->x[k] + step_of_slope);
        lb_respond(&j->places, j->model, p->values, slope);
        p->values[at] = value;
        for (size_t i = 0; i < width; ++i) {
            slope.re[i] = (slope.re[i] - p->response.re[i]) / step_of_slope;
            slope.im[i] = (slope.im[i] - p->response.im[i]) / step_of_slope;
        }
    }
    const lb_curve rest = j->shape;
    for (size_t i = 0; i < width; ++i) {
        rest.re[i] = p->response.re[i] - j->row.re[i];
        rest.im[i] = p->response.im[i] - j->row.im[i];
    }
    p->cost = lb_product(weight, rest, rest, width);
    is_finite = lb_finite(p->cost);
    for (size_t k = 0; k < j->free; ++k) {
        p->gradient[k] = lb_product(weight, p->slope[k], rest, width);
        is_finite = is_finite && lb_finite(p->gradient[k]);
        for (size_t l = 0; l <= k; ++l) {
            p->matrix[k][l] = p->matrix[l][k] = lb_product(weight, p->slope[k], p->slope[l], width);
            is_finite = is_finite && lb_finite(p->matrix[k][l]);
        }
    }
    if (!is_finite) {
        p->cost = lb_infinity();
        for (size_t k = 0; k < j->free; ++k) {
            p->gradient[k] = 0.0;
            for (size_t l = 0; l < j->free; ++l) {
                p->matrix[k][l] = k == l ? 1.0 : 0.0;
            }
        }
    }
}

/* The point after a step within the bounds, whose step is `step`. A parameter that its bound blocks is left out. */
static int take_step(const lb_job *j, double damping, double x[LB_FREE], double step[LB_FREE])
{
    const lb_point *p = &j->now;
    double matrix[LB_FREE][LB_FREE] = {{0.0}}, right[LB_FREE][LB_FREE] = {{0.0}}, low[LB_FREE], high[LB_FREE];
    double largest = 0.0;
    int is_kept[LB_FREE];
    for (size_t k = 0; k < j->free; ++k) {
        low[k] = lb_coordinate(j->model, j->at[k], j->model->low[j->at[k]]);
        high[k] = lb_coordinate(j->model, j->at[k], j->model->high[j->at[k]]);
        is_kept[k] = (p->x[k] <= low[k] && p->gradient[k] > 0.0) || (p->x[k] >= high[k] && p->gradient[k] < 0.0);
    }
    for (size_t k = 0; k < j->free; ++k) {
        right[k][0] = is_kept[k] ? 0.0 : p->gradient[k];
        for (size_t l = 0; l < j->free; ++l) {
            matrix[k][l] = !is_kept[k] && !is_kept[l] ? p->matrix[k][l] : k == l ? 1.0 : 0.0;
        }
        largest = matrix[k][k] > largest ? matrix[k][k] : largest;
    }
    for (size_t k = 0; k < j->free; ++k) {
        matrix[k][k] = matrix[k][k] + (damping * matrix[k][k] + (1e-12 * largest + 1e-300));
    }
    if (!lb_solve(j->free, matrix, 1u, right)) {
        return 0;
    }
    for (size_t k = 0; k < j->free; ++k) {
        x[k] = lb_clipped(p->x[k] + lb_clipped(-right[k][0], -largest_step, largest_step), low[k], high[k]);
        step[k] = x[k] - p->x[k];
    }
    return 1;
}

/* Whether the step is the last: it is small, or promises too little. */
static int is_last(const lb_job *j, const double step[LB_FREE])
{
    double promised = 0.0;
    int is_small = 1;
    for (size_t k = 0; k < j->free; ++k) {
        promised = promised - step[k] * j->now.gradient[k];
        is_small = is_small && fabs(step[k]) < tolerance;
    }
    promised = promised / 2.0;
    return is_small || (promised >= 0.0 && promised < enough);
}

int lb_minimise(lb_job *j, int rounds)
{
    double damping = 1e-3;
    LB_ASSERT(j->free > 0u && rounds > 0);
    for (size_t k = 0; k < j->free; ++k) {
        j->now.x[k] = lb_coordinate(j->model, j->at[k], j->now.values[j->at[k]]);
    }
    j->now.is_settled = 0;
    measure(j, &j->now);
    for (size_t k = 0; k < j->model->parameters; ++k) {
        j->tried.values[k] = j->now.values[k];
    }
    for (int i = 0; i < rounds; ++i) {
        double step[LB_FREE];
        if (!take_step(j, damping, j->tried.x, step)) {
            return 0;
        }
        if (is_last(j, step)) {
            for (size_t k = 0; k < j->free; ++k) {
                j->now.x[k] = j->tried.x[k];
                j->now.values[j->at[k]] = value_of(j->model, j->at[k], j->now.x[k]);
            }
            j->now.is_settled = lb_finite(j->now.cost);
            return 1;
        }
        measure(j, &j->tried);
        if (j->tried.cost < j->now.cost) {
            lb_exchange(&j->now, &j->tried);
            damping = damping * fall;
        } else {
            damping = damping * rise;
        }
    }
    j->now.is_settled = 0;
    return 1;
}
