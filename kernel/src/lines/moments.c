/* Running moments of line spectra. */
#include "moments.h"

/* A window with the start or end of the excitation has no noise: the mean is of the others. */
static void complete_noise(double *mean, double share, size_t count, double *now)
{
    for (size_t i = 0; i < count; ++i) {
        mean[i] = mean[i] != mean[i] ? now[i] : mean[i];
        now[i] = now[i] != now[i] && share < 1.0 ? mean[i] : now[i];
    }
}

void lb_moments_add(const lb_line_moments *m, size_t at, double forgetting, double share, size_t count, lb_window *now)
{
    double deviation[LB_LINE_MEANS][LB_TOGETHER];
    const size_t step = lb_step(m);
    const double kept = 1.0 - share;
    LB_ASSERT(count <= LB_TOGETHER && share > 0.0 && share <= 1.0);
    complete_noise(m->means + NOISE_POWER * step + at, share, count, now->of[NOISE_POWER]);
    for (size_t q = 0; q < LB_LINE_MEANS; ++q) {
        double *mean = m->means + q * step + at;
        for (size_t i = 0; i < count; ++i) {
            deviation[q][i] = now->of[q][i] - mean[i];
            mean[i] += deviation[q][i] * share;
        }
    }
    const double *nr = deviation[NUM_RE], *ni = deviation[NUM_IM], *dr = deviation[DEN_RE], *di = deviation[DEN_IM];
    double *num = m->scatter + at, *den = num + step, *re = den + step, *im = re + step;
    for (size_t i = 0; i < count; ++i) {
        num[i] = num[i] * forgetting + (nr[i] * nr[i] + ni[i] * ni[i]) * kept;
        den[i] = den[i] * forgetting + (dr[i] * dr[i] + di[i] * di[i]) * kept;
        re[i] = re[i] * forgetting + (nr[i] * dr[i] + ni[i] * di[i]) * kept;
        im[i] = im[i] * forgetting + (ni[i] * dr[i] - nr[i] * di[i]) * kept;
    }
}

static void read_window(const lb_line_moments *m, size_t rows, const double *spectra, const double *powers, size_t at,
                        size_t count, lb_window *now)
{
    for (size_t s = 0; s < 3u; ++s) {
        const double *from = spectra + 2u * (s * rows * m->lines + at);
        for (size_t i = 0; i < count; ++i) {
            now->of[2u * s][i] = from[2u * i];
            now->of[2u * s + 1u][i] = from[2u * i + 1u];
        }
    }
    for (size_t p = 0; p < 4u; ++p) {
        const double *from = powers + p * rows * m->lines + at;
        for (size_t i = 0; i < count; ++i) {
            now->of[REF_POWER + p][i] = from[i];
        }
    }
}

/* The quantities of some lines, into those of a row. */
static void copy(const double *from, size_t from_step, double *to, size_t to_step, size_t quantities, size_t count)
{
    for (size_t q = 0; q < quantities; ++q) {
        for (size_t i = 0; i < count; ++i) {
            to[q * to_step + i] = from[q * from_step + i];
        }
    }
}

lb_status lb_lines_add(const lb_line_weights *weights, const lb_line_moments *m, size_t place, size_t rows,
                       const double *spectra, const double *powers, const uint8_t *usable, int64_t *after,
                       double *means, double *scatter)
{
    if (!weights || !m || !m->count || !m->means || !m->scatter) {
        return LB_ERROR_NULL;
    }
    if (rows && (!spectra || !powers || !usable || !after || !means || !scatter)) {
        return LB_ERROR_NULL;
    }
    if (place >= m->places || (weights->forgetting != 1.0 && !(weights->table && weights->length))) {
        return LB_ERROR_SIZE;
    }
    for (size_t row = 0; row < rows; ++row, place = place + 1u < m->places ? place + 1u : 0u) {
        m->count[place] += usable[row] ? 1 : 0;
        after[row] = m->count[place];
        const double share = 1.0 / lb_sums_of(weights, after[row]).one;
        for (size_t first = 0; first < m->lines; first += LB_TOGETHER) {
            const size_t count = m->lines - first < LB_TOGETHER ? m->lines - first : LB_TOGETHER;
            const size_t at = lb_place(m, place, first), to = row * m->lines + first;
            if (usable[row]) {
                lb_window now;
                read_window(m, rows, spectra, powers, to, count, &now);
                lb_moments_add(m, at, weights->forgetting, share, count, &now);
            }
            copy(m->means + at, lb_step(m), means + to, rows * m->lines, LB_LINE_MEANS, count);
            copy(m->scatter + at, lb_step(m), scatter + to, rows * m->lines, LB_LINE_SCATTER, count);
        }
    }
    return LB_OK;
}
