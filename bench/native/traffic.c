/* What dense rows need of the memory, without arithmetic: a table of twiddle factors is read forth and back, one row
 * for each sample, and a row of numbers is written. */
#include <stddef.h>

typedef double eight __attribute__((vector_size(64), aligned(8), may_alias));

/* table[table_rows][blocks][16]; out[rows][2·bins] and room for one block more */
void dense_traffic(const double *table, size_t table_rows, size_t blocks, double *out, size_t rows, size_t bins)
{
    size_t at = 0;
    int backwards = 0;
    for (size_t i = 0; i < rows; ++i, out += 2 * bins) {
        const double *row = table + at * blocks * 16;
        for (size_t b = blocks; b-- > 0;) {
            const eight cosine = *(const eight *)(row + 16 * b), sine = *(const eight *)(row + 16 * b + 8);
            *(eight *)(out + 16 * b) = cosine;
            *(eight *)(out + 16 * b + 8) = sine;
        }
        backwards = at + 1 == table_rows || (at && backwards);
        at = backwards ? at - 1 : at + 1;
    }
}
