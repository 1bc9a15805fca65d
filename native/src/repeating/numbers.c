/* Sums and quotients with NumPy's rounding. */
#include "repeating.h"

#define UNROLLED 8u
#define PAIRWISE_FROM 128u

double lb_sum(const double *x, size_t count)
{
    if (count < UNROLLED) {
        double sum = 0.0;
        for (size_t i = 0; i < count; ++i) {
            sum += x[i];
        }
        return sum;
    }
    if (count > PAIRWISE_FROM) {
        const size_t half = count / 2u - count / 2u % UNROLLED;
        return lb_sum(x, half) + lb_sum(x + half, count - half);
    }
    double r[UNROLLED];
    size_t i = UNROLLED;
    for (size_t k = 0; k < UNROLLED; ++k) {
        r[k] = x[k];
    }
    for (; i < count - count % UNROLLED; i += UNROLLED) {
        for (size_t k = 0; k < UNROLLED; ++k) {
            r[k] += x[i + k];
        }
    }
    double sum = ((r[0] + r[1]) + (r[2] + r[3])) + ((r[4] + r[5]) + (r[6] + r[7]));
    for (; i < count; ++i) {
        sum += x[i];
    }
    return sum;
}

void lb_times(const double *a, const double *b, double *out)
{
    const double re = a[0] * b[0] - a[1] * b[1], im = a[0] * b[1] + a[1] * b[0];
    out[0] = re;
    out[1] = im;
}

void lb_divide(const double *a, const double *b, double *out)
{
    const double re = lb_absolute(b[0]), im = lb_absolute(b[1]);
    if (re == 0.0 && im == 0.0) {
        out[0] = a[0] / re;
        out[1] = a[1] / re;
    } else if (re >= im) {
        const double ratio = b[1] / b[0], scale = 1.0 / (b[0] + b[1] * ratio);
        out[0] = (a[0] + a[1] * ratio) * scale;
        out[1] = (a[1] - a[0] * ratio) * scale;
    } else {
        const double ratio = b[0] / b[1], scale = 1.0 / (b[1] + b[0] * ratio);
        out[0] = (a[0] * ratio + a[1]) * scale;
        out[1] = (a[1] * ratio - a[0]) * scale;
    }
}
