/* Fits without a start: a scan of resonances, at each of which the weights of rigid body and mode are linear. */
#include "fit.h"

static const double quality = 10.0; /* of the scanned resonances */
static const double least = 1e-3;   /* of the largest weight, for one that is negative */
static const int rounds = 30;

static void find_modes(lb_job *j)
{
    const lb_fit_model *m = j->model;
    const lb_transfer body = {1.0, 0.0, 0.0, 1.0, 0.0, 0.0, m->integrators, 0, 0.0};
    const lb_sampled of_body = lb_sampled_of(&body, j->places.tick, 0.0);
    const double low = 2.0 * LB_PI * (j->places.lowest_hz / 2.0), high = 2.0 * LB_PI * (j->places.highest_hz * 2.0);
    const double step = lb_log(high / low) / (double)(LB_SCANNED - 1u);
    lb_evaluate(&j->places, &of_body, j->rigid);
    for (size_t k = 0; k < LB_SCANNED; ++k) {
        const double omega = low * lb_exp(step * (double)k);
        /* s/(s² + ωs/Q + ω²), over s for a position */
        lb_transfer mode = {0.0, 1.0, 0.0, omega * omega, omega / quality, 1.0, 0, 0, 0.0};
        if (m->integrators == 2) {
            mode.n0 = 1.0;
            mode.n1 = 0.0;
        }
        const lb_sampled s = lb_sampled_of(&mode, j->places.tick, 0.0);
        lb_evaluate(&j->places, &s, j->modes[k]);
        j->omega[k] = omega;
    }
    j->has_modes = 1;
}

/* What is fitted to the weights of one resonance. */
typedef struct {
    double rigid, mode, cost;
} lb_share;

/* Weights made positive and their cost; basis has one or two curves. 0 if they are not determined. */
static int fit_weights(const lb_job *j, size_t parts, const lb_curve *basis, double *weights, double *cost)
{
    const size_t width = j->places.width;
    const double *square = j->row.weight, lever = j->model->at_load ? j->model->lever : 1.0;
    const lb_curve value = {j->row.re, j->row.im};
    double matrix[2][2] = {{0.0}}, eliminated[LB_FREE][LB_FREE] = {{0.0}}, right[LB_FREE][LB_FREE] = {{0.0}};
    double along[2] = {0.0}, largest = 0.0;
    for (size_t k = 0; k < parts; ++k) {
        right[k][0] = along[k] = lb_product(square, basis[k], value, width) / lever;
        for (size_t l = 0; l <= k; ++l) {
            matrix[k][l] = matrix[l][k] = lb_product(square, basis[k], basis[l], width);
        }
        matrix[k][k] = matrix[k][k] + 1e-9 * matrix[k][k];
    }
    for (size_t k = 0; k < parts; ++k) {
        for (size_t l = 0; l < parts; ++l) {
            eliminated[k][l] = matrix[k][l];
        }
    }
    if (!lb_solve(parts, eliminated, 1u, right)) {
        return 0;
    }
    for (size_t k = 0; k < parts; ++k) {
        largest = fabs(right[k][0]) > largest ? fabs(right[k][0]) : largest;
    }
    *cost = 0.0;
    for (size_t k = 0; k < parts; ++k) {
        weights[k] = right[k][0] > least * largest + 1e-300 ? right[k][0] : least * largest + 1e-300;
    }
    for (size_t k = 0; k < parts; ++k) {
        for (size_t l = 0; l < parts; ++l) {
            *cost = *cost + weights[k] * matrix[k][l] * weights[l];
        }
        *cost = *cost - 2.0 * weights[k] * along[k];
    }
    return 1;
}

static int fit_resonance(const lb_job *j, size_t k, lb_share *to)
{
    const lb_fit_model *m = j->model;
    const double ratio = m->at_load ? -1.0 : m->kind == LB_FIT_TWO_MASS ? m->ratio : 0.0;
    lb_curve basis[2] = {j->rigid, j->modes[k]};
    double weights[2] = {0.0};
    if (ratio != 0.0) {
        for (size_t i = 0; i < j->places.width; ++i) {
            j->shape.re[i] = j->rigid.re[i] + ratio * j->modes[k].re[i];
            j->shape.im[i] = j->rigid.im[i] + ratio * j->modes[k].im[i];
        }
        basis[0] = j->shape;
    }
    if (!fit_weights(j, ratio != 0.0 ? 1u : 2u, basis, weights, &to->cost)) {
        return 0;
    }
    to->rigid = weights[0];
    to->mode = ratio == 0.0 ? weights[1] : fabs(ratio) * weights[0];
    if (m->at_load) {
        to->mode = weights[0] * (m->ratio > 0.0 ? m->ratio : 1.0);
    }
    return 1;
}

/* Values of the model from a resonance: the others as declared, within the bounds, and the fixed ones. */
static void start_at(const lb_fit_model *m, const lb_share *share, double omega, double *values)
{
    const double total = share->rigid + share->mode;
    double found[LB_FIT_PARAMETERS] = {0.0};
    if (m->kind == LB_FIT_RIGID) {
        found[0] = (m->at_load ? m->lever : 1.0) / share->rigid;
    } else if (m->kind == LB_FIT_TWO_MASS) {
        const size_t next = m->ratio > 0.0 ? 1u : 2u;
        const double motor = 1.0 / total, load = share->mode / (share->rigid * total);
        const double spring = motor * load * share->rigid * (omega * omega);
        found[0] = motor;
        found[1] = load / m->arm;
        found[next] = spring / m->arm;
        found[next + 1u] = spring / (omega * quality) / m->arm;
    } else {
        const double high = omega / (2.0 * LB_PI);
        found[0] = share->rigid;
        found[1] = high * sqrt(share->rigid / total);
        found[2] = high;
        found[3] = found[4] = 0.5 / quality;
    }
    for (size_t i = 0; i < m->parameters; ++i) {
        const double x = lb_finite(found[i]) ? found[i] : m->start[i];
        values[i] = m->held[i] == m->held[i] ? m->held[i] : lb_clipped(x, m->low[i], m->high[i]);
    }
}

/* Up to four minima of the cost over the resonances, the least first. */
static size_t choose(const lb_share *shares, size_t *chosen)
{
    size_t count = 0;
    for (size_t k = 0; k < LB_SCANNED; ++k) {
        const int is_least = (k == 0u || shares[k].cost <= shares[k - 1u].cost) &&
                             (k + 1u == LB_SCANNED || shares[k].cost <= shares[k + 1u].cost);
        size_t at = count < LB_TRIED ? count : LB_TRIED;
        if (!is_least) {
            continue;
        }
        while (at > 0u && shares[k].cost < shares[chosen[at - 1u]].cost) {
            --at;
        }
        if (at == LB_TRIED) {
            continue;
        }
        for (size_t i = count < LB_TRIED ? count : LB_TRIED - 1u; i > at; --i) {
            chosen[i] = chosen[i - 1u];
        }
        chosen[at] = k;
        count += count < LB_TRIED ? 1u : 0u;
    }
    return count;
}

static int fit_from(lb_job *j, int is_first, const lb_share *share, double omega)
{
    start_at(j->model, share, omega, j->now.values);
    if (!lb_minimise(j, rounds)) {
        return 0;
    }
    const double cost = j->now.is_settled ? j->now.cost : j->now.cost + 1e300;
    const double least_cost = j->best.is_settled ? j->best.cost : j->best.cost + 1e300;
    if (is_first || cost < least_cost) {
        lb_exchange(&j->now, &j->best);
    }
    return 1;
}

int lb_scan(lb_job *j)
{
    lb_share shares[LB_SCANNED];
    size_t chosen[LB_TRIED] = {0}, count = 1;
    if (!j->has_modes) {
        find_modes(j);
    }
    if (j->model->kind == LB_FIT_RIGID) {
        double weight[2] = {0.0};
        if (!fit_weights(j, 1u, &j->rigid, weight, &shares[0].cost)) {
            return 0;
        }
        shares[0].rigid = weight[0];
        shares[0].mode = 0.0;
    } else {
        for (size_t k = 0; k < LB_SCANNED; ++k) {
            if (!fit_resonance(j, k, &shares[k])) {
                return 0;
            }
        }
        count = choose(shares, chosen);
    }
    LB_ASSERT(count <= LB_TRIED);
    /* Without a minimum, costs are not numbers: the first start fails as any other. */
    for (size_t i = 0; i < (count ? count : 1u); ++i) {
        if (!fit_from(j, i == 0u, &shares[chosen[i]], j->omega[chosen[i]])) {
            return 0;
        }
    }
    lb_exchange(&j->now, &j->best);
    return 1;
}
