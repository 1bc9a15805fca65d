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
