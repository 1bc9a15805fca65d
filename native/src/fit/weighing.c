/* Weights of lines: their noise, and the error of the model. */
#include "fit.h"

static const size_t steps = 30;
static const double close = 1e-6;

static int is_any_weighted(const lb_row *r, size_t width)
{
    int found = 0;
    for (size_t i = 0; i < width; ++i) {
        found = found || r->weight[i] > 0.0;
    }
    return found;
}

static void weigh(lb_row *r, size_t width, double square)
{
    for (size_t i = 0; i < width; ++i) {
        const double variance = r->noise[i] + square * r->size[i];
        r->weight[i] = r->use[i] != 0.0 && variance > 0.0 ? 2.0 / variance : 0.0;
    }
}

void lb_weigh(lb_row *r, size_t width, double epsilon)
{
    LB_ASSERT(width % LB_LANES == 0u);
    weigh(r, width, epsilon * epsilon);
    /* Where neither noise nor ε is known, the weight of a line is its size. */
    if (!is_any_weighted(r, width)) {
        weigh(r, width, 1.0);
    }
}

void lb_take_residuals(lb_row *r, size_t width, lb_curve response)
{
    for (size_t i = 0; i < width; ++i) {
        const double re = r->re[i] - response.re[i], im = r->im[i] - response.im[i];
        r->rest[i] = r->use[i] != 0.0 ? re * re + im * im : 0.0;
        r->size[i] = r->use[i] != 0.0 ? response.re[i] * response.re[i] + response.im[i] * response.im[i] : 0.0;
    }
}

/* Σ 2·rest/(noise + square·size), as lb_sum adds. */
static double reduced(size_t count, const double *rest, const double *noise, const double *size, double square)
{
    double s[LB_LANES] = {0.0};
    for (size_t i = 0; i < count; ++i) {
        s[i % LB_LANES] += rest[i] > 0.0 ? 2.0 * rest[i] / (noise[i] + square * size[i]) : 0.0;
    }
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

double lb_reduced(const lb_row *r, size_t width, double square)
{
    return reduced(width, r->rest, r->noise, r->size, square);
}

/* No line has more than all together, which bounds ε² from below. */
static double least_square(size_t count, const double *rest, const double *noise, const double *size, double dof)
{
    double found = 0.0;
    for (size_t i = 0; i < count; ++i) {
        const double least = (2.0 * rest[i] / dof - noise[i]) / size[i];
        found = rest[i] > 0.0 && lb_finite(least) && least > found ? least : found;
    }
    return found;
}

double lb_epsilon_for(size_t count, const double *rest, const double *noise, const double *size, double dof)
{
    if (!(dof > 0.0) || reduced(count, rest, noise, size, 0.0) <= dof) {
        return 0.0;
    }
    /* From there the left side is convex and falls, so that Newton's steps climb to the root and never pass it. */
    double square = least_square(count, rest, noise, size, dof);
    for (size_t k = 0; k < steps; ++k) {
        double total[LB_LANES] = {0.0}, slope[LB_LANES] = {0.0};
        for (size_t i = 0; i < count; ++i) {
            const double share = rest[i] > 0.0 ? 1.0 / (noise[i] + square * size[i]) : 0.0, part = rest[i] * share;
            total[i % LB_LANES] += part;
            slope[i % LB_LANES] += part * (size[i] * share);
        }
        const double all = 2.0 * lb_sum(total, LB_LANES), falls = 2.0 * lb_sum(slope, LB_LANES);
        const double step = falls > 0.0 ? (all - dof) / falls : 0.0;
        square = square + (step > 0.0 || step != step ? step : 0.0);
        if (!(step > close * square)) {
            break;
        }
    }
    return lb_finite(square) ? sqrt(square) : 0.0;
}

lb_status lb_fit_epsilon(size_t rows, size_t lines, const double *rest, const double *noise, const double *size,
                         const double *dof, double *epsilon)
{
    if (rows && (!rest || !noise || !size || !dof || !epsilon)) {
        return LB_ERROR_NULL;
    }
    for (size_t row = 0; row < rows; ++row) {
        const size_t at = row * lines;
        epsilon[row] = lb_epsilon_for(lines, rest + at, noise + at, size + at, dof[row]);
    }
    return LB_OK;
}
