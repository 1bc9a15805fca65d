/* Covariance of a fit. */
#include "fit.h"

static const double least_dof = 3.0, condition_max = 1e11, rounding = 1e-14;

/* Where a weight has few degrees of freedom, weighted least squares scatter more than the weights indicate. */
static void scattered_weights(lb_job *j, double noise_dof, double count)
{
    const double d = noise_dof != noise_dof ? lb_infinity() : noise_dof > least_dof ? noise_dof : least_dof;
    const double factor = 2.0 / (d - 2.0) * (1.0 - (double)j->free / count);
    for (size_t i = 0; i < j->places.width; ++i) {
        const double share = j->row.noise[i] * j->row.weight[i] / 2.0;
        j->row.each[i] = j->row.weight[i] * (1.0 + share * share * factor);
    }
}

static int is_any(int found[LB_FREE][LB_FREE], size_t n)
{
    int any = 0;
    for (size_t k = 0; k < n; ++k) {
        for (size_t l = 0; l < n; ++l) {
            any = any || found[k][l];
        }
    }
    return any;
}

/* The inverse of the matrix scaled to a diagonal of ones, without the scale again; 0 if it is singular. */
static int invert(size_t n, double matrix[LB_FREE][LB_FREE], double inverse[LB_FREE][LB_FREE])
{
    double scaled[LB_FREE][LB_FREE] = {{0.0}}, scale[LB_FREE] = {0.0};
    int is_bad[LB_FREE][LB_FREE] = {{0}};
    for (size_t k = 0; k < n; ++k) {
        scale[k] = sqrt(matrix[k][k]);
    }
    for (size_t k = 0; k < n; ++k) {
        for (size_t l = 0; l < n; ++l) {
            scaled[k][l] = matrix[k][l] / (scale[k] * scale[l]);
            is_bad[k][l] = !lb_finite(scaled[k][l]);
        }
    }
    const int is_finite = !is_any(is_bad, n);
    for (size_t k = 0; k < n; ++k) {
        for (size_t l = 0; l < n; ++l) {
            const double unit = k == l ? 1.0 : 0.0;
            scaled[k][l] = (is_finite ? scaled[k][l] : unit) + rounding * unit;
            inverse[k][l] = unit;
        }
    }
    if (!lb_solve(n, scaled, n, inverse)) {
        return 0;
    }
    for (size_t k = 0; k < n; ++k) {
        for (size_t l = 0; l < n; ++l) {
            is_bad[k][l] = !(fabs(inverse[k][l]) < condition_max);
            inverse[k][l] = inverse[k][l] / (scale[k] * scale[l]);
        }
    }
    const int is_determined = is_finite && !is_any(is_bad, n);
    for (size_t k = 0; k < n && !is_determined; ++k) {
        for (size_t l = 0; l < n; ++l) {
            inverse[k][l] = lb_not_a_number();
        }
    }
    return 1;
}

static void multiply(size_t n, double a[LB_FREE][LB_FREE], double b[LB_FREE][LB_FREE], double to[LB_FREE][LB_FREE])
{
    for (size_t k = 0; k < n; ++k) {
        for (size_t l = 0; l < n; ++l) {
            double x = 0.0;
            for (size_t i = 0; i < n; ++i) {
                x = x + a[k][i] * b[i][l];
            }
            to[k][l] = x;
        }
    }
}

int lb_covariance(lb_job *j, double noise_dof, double count, double to[LB_FREE][LB_FREE])
{
    const size_t n = j->free, width = j->places.width;
    double matrix[LB_FREE][LB_FREE] = {{0.0}}, scattered[LB_FREE][LB_FREE] = {{0.0}};
    double inverse[LB_FREE][LB_FREE] = {{0.0}}, half[LB_FREE][LB_FREE] = {{0.0}};
    LB_ASSERT(n > 0u && n <= LB_FREE);
    scattered_weights(j, noise_dof, count);
    for (size_t k = 0; k < n; ++k) {
        for (size_t l = 0; l <= k; ++l) {
            const lb_curve a = j->now.slope[k], b = j->now.slope[l];
            matrix[k][l] = matrix[l][k] = lb_product(j->row.weight, a, b, width);
            scattered[k][l] = scattered[l][k] = lb_product(j->row.each, a, b, width);
        }
    }
    if (!invert(n, matrix, inverse)) {
        return 0;
    }
    multiply(n, inverse, scattered, half);
    multiply(n, half, inverse, to);
    return 1;
}
