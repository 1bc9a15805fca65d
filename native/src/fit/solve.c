/* Small systems of linear equations. */
#include "fit.h"

static void exchange(double *a, double *b, size_t n)
{
    for (size_t i = 0; i < n; ++i) {
        const double x = a[i];
        a[i] = b[i];
        b[i] = x;
    }
}

int lb_solve(size_t n, double matrix[LB_FREE][LB_FREE], size_t columns, double right[LB_FREE][LB_FREE])
{
    LB_ASSERT(n > 0u && n <= LB_FREE);
    LB_ASSERT(columns > 0u && columns <= LB_FREE);
    for (size_t k = 0; k < n; ++k) {
        size_t pivot = k;
        for (size_t i = k + 1u; i < n; ++i) {
            pivot = fabs(matrix[i][k]) > fabs(matrix[pivot][k]) ? i : pivot;
        }
        if (matrix[pivot][k] == 0.0) {
            return 0;
        }
        if (pivot != k) {
            exchange(matrix[pivot], matrix[k], n);
            exchange(right[pivot], right[k], columns);
        }
        for (size_t i = k + 1u; i < n; ++i) {
            const double share = matrix[i][k] / matrix[k][k];
            for (size_t c = k + 1u; c < n; ++c) {
                matrix[i][c] = matrix[i][c] - share * matrix[k][c];
            }
            for (size_t c = 0; c < columns; ++c) {
                right[i][c] = right[i][c] - share * right[k][c];
            }
        }
    }
    for (size_t k = n; k-- > 0u;) {
        for (size_t c = 0; c < columns; ++c) {
            double x = right[k][c];
            for (size_t i = k + 1u; i < n; ++i) {
                x = x - matrix[k][i] * right[i][c];
            }
            right[k][c] = x / matrix[k][k];
        }
    }
    return 1;
}
