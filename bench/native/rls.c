/* Recursive least squares with 6 parameters, as fast as we could make it and honest: g_i·g_j is formed before it is
 * scaled, so that the covariance stays symmetric to the bit and does not explode within 3e4 samples. ARX: y(n) from
 * y(n−1 … n−3) and u(n−1 … n−3), forgetting factor lambda. */
#include <stddef.h>
#include <string.h>

#define P 6

/* Plain loops over rows padded to 8, for the compiler to vectorise. Returns something to use. */
double rls_loops(const double *u, const double *y, size_t length, double lambda)
{
    double C[P][8] = {{0}}, theta[8] = {0}, phi[8] = {0}, g[8];
    for (int i = 0; i < P; ++i) {
        C[i][i] = 1e3;
    }
    const double keep = 1.0 / lambda;
    for (size_t n = 0; n < length; ++n) {
        double against = lambda, predicted = 0.0;
        memset(g, 0, sizeof g);
        for (int i = 0; i < P; ++i) {
            for (int j = 0; j < 8; ++j) {
                g[j] += C[i][j] * phi[i];
            }
        }
        for (int j = 0; j < 8; ++j) {
            against += g[j] * phi[j];
            predicted += theta[j] * phi[j];
        }
        const double scale = 1.0 / against, gain = (y[n] - predicted) * scale;
        for (int j = 0; j < 8; ++j) {
            theta[j] += g[j] * gain;
        }
        for (int i = 0; i < P; ++i) {
            for (int j = 0; j < 8; ++j) {
                C[i][j] = (C[i][j] - (g[i] * g[j]) * scale) * keep;
            }
        }
        phi[2] = phi[1], phi[1] = phi[0], phi[0] = -y[n];
        phi[5] = phi[4], phi[4] = phi[3], phi[3] = u[n];
    }
    return theta[0] + theta[3];
}

typedef double four __attribute__((vector_size(32)));
typedef double two __attribute__((vector_size(16)));

/* Rows of four and two, in registers; sums as trees; the two divisions side by side; everything that does not wait
 * for the newest covariance is off the long way. */
double rls_rows(const double *u, const double *y, size_t length, double lambda)
{
    four A[P] = {{0}}, theta_a = {0}, a = {0};
    two B[P] = {{0}}, theta_b = {0}, b = {0};
    double p0 = 0, p1 = 0, p2 = 0, p3 = 0, p4 = 0, p5 = 0;
    for (int i = 0; i < P; ++i) {
        if (i < 4) {
            A[i][i] = 1e3;
        } else {
            B[i][i - 4] = 1e3;
        }
    }
    const double keep = 1.0 / lambda;
    const two forget = {lambda, 0.0};
    for (size_t n = 0; n < length; ++n) {
        const four ga = (A[0] * p0 + A[1] * p1) + (A[2] * p2 + A[3] * p3) + (A[4] * p4 + A[5] * p5);
        const two gb = (B[0] * p0 + B[1] * p1) + (B[2] * p2 + B[3] * p3) + (B[4] * p4 + B[5] * p5);
        const four pa = ga * a, ea = theta_a * a;
        const two pb = gb * b + forget, eb = theta_b * b;
        const two ps = ((two){pa[0], pa[1]} + pb) + (two){pa[2], pa[3]};
        const two es = ((two){ea[0], ea[1]} + eb) + (two){ea[2], ea[3]};
        const double against = ps[0] + ps[1];
        const double shrink = keep / against, gain = (y[n] - (es[0] + es[1])) / against;
        for (int i = 0; i < P; ++i) {
            const double gi = i < 4 ? ga[i] : gb[i - 4];
            A[i] = A[i] * keep - (gi * ga) * shrink;
            B[i] = B[i] * keep - (gi * gb) * shrink;
        }
        theta_a += ga * gain;
        theta_b += gb * gain;
        p2 = p1, p1 = p0, p0 = -y[n];
        p5 = p4, p4 = p3, p3 = u[n];
        a = (four){p0, p1, p2, p3};
        b = (two){p4, p5};
    }
    return theta_a[0] + theta_a[3];
}

/* The upper triangle alone: 21 numbers instead of 48. */
double rls_triangle(const double *u, const double *y, size_t length, double lambda)
{
    double C[P][P] = {{0}}, theta[P] = {0}, phi[P] = {0}, g[P];
    for (int i = 0; i < P; ++i) {
        C[i][i] = 1e3;
    }
    const double keep = 1.0 / lambda;
    for (size_t n = 0; n < length; ++n) {
        double against = lambda, error = y[n];
        for (int i = 0; i < P; ++i) {
            double s = 0.0;
            for (int j = 0; j < P; ++j) {
                s += (i < j ? C[i][j] : C[j][i]) * phi[j];
            }
            g[i] = s;
            against += s * phi[i];
            error -= theta[i] * phi[i];
        }
        const double scale = 1.0 / against, gain = error * scale;
        for (int i = 0; i < P; ++i) {
            theta[i] += g[i] * gain;
            for (int j = i; j < P; ++j) {
                C[i][j] = (C[i][j] - (g[i] * g[j]) * scale) * keep;
            }
        }
        phi[2] = phi[1], phi[1] = phi[0], phi[0] = -y[n];
        phi[5] = phi[4], phi[4] = phi[3], phi[3] = u[n];
    }
    return theta[0] + theta[3];
}
