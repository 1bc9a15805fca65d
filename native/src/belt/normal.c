/* Responses, and normal equations of their fits. */
#include "belt.h"

size_t lb_belt_work(size_t lines)
{
    return lb_tiles(lines) * ((sizeof(lb_belt_tile) + sizeof(lb_lanes)) / sizeof(double));
}

lb_status lb_belt_response(const lb_belt_grid *grid, size_t rows, const double *parameters, double *response,
                           double *work)
{
    if (!grid || !grid->step || !work || (rows && grid->lines && (!parameters || !response))) {
        return LB_ERROR_NULL;
    }
    lb_belt_tile *const tiles = (lb_belt_tile *)(void *)work;
    const size_t lines = grid->lines;
    lb_belt_tiles_of(grid, tiles);
    for (size_t row = 0; row < rows; ++row) {
        const lb_mode m = lb_mode_of(parameters + row * LB_BELT_PARAMETERS, 1.0 / grid->rate_hz);
        for (size_t first = 0; first < lines; first += LB_LANES) {
            lb_lanes g;
            lb_belt_evaluate(&m, &tiles[first / LB_LANES], &g);
            for (size_t k = 0; k < LB_LANES && first + k < lines; ++k) {
                response[2u * (row * lines + first + k)] = g.re[k];
                response[2u * (row * lines + first + k) + 1u] = g.im[k];
            }
        }
    }
    return LB_OK;
}

/* Measured values, turned by `turn` where there is one, and squares of their weights. */
static void load(const lb_belt_rows *rows, size_t row, size_t lines, size_t first, const lb_lanes *turn,
                 lb_lanes *value, double *square)
{
    for (size_t k = 0; k < LB_LANES; ++k) {
        const int is_line = first + k < lines;
        const size_t at = row * lines + (is_line ? first + k : 0u);
        const double re = rows->value[2u * at], im = rows->value[2u * at + 1u], weight = rows->weight[at];
        value->re[k] = turn ? re * turn->re[k] - im * turn->im[k] : re;
        value->im[k] = turn ? re * turn->im[k] + im * turn->re[k] : im;
        square[k] = is_line ? weight * weight : 0.0;
    }
}

/* Sums over the lines of weight²·Re(conj(a)·b) of the first `count` slopes with each other (row by row of the lower
 * triangle), then with the rest, last of the rest with itself. */
static void add_row(const lb_mode *m, const lb_belt_tile *tiles, const lb_belt_rows *rows, size_t row, size_t lines,
                    const lb_lanes *turns, size_t count, double *term)
{
    double sum[LB_TERMS][LB_LANES] = {{0.0}};
    size_t terms = 0;
    for (size_t first = 0; first < lines; first += LB_LANES) {
        lb_lanes g, value, curve[LB_SLOPES + 1u];
        double square[LB_LANES];
        lb_belt_slopes(m, &tiles[first / LB_LANES], &g, curve);
        load(rows, row, lines, first, turns ? &turns[first / LB_LANES] : turns, &value, square);
        for (size_t k = 0; k < LB_LANES; ++k) {
            curve[count].re[k] = g.re[k] - value.re[k];
            curve[count].im[k] = g.im[k] - value.im[k];
        }
        terms = 0;
        for (size_t i = 0; i <= count; ++i) {
            for (size_t j = 0; j <= i; ++j, ++terms) {
                for (size_t k = 0; k < LB_LANES; ++k) {
                    sum[terms][k] += square[k] * (curve[i].re[k] * curve[j].re[k] + curve[i].im[k] * curve[j].im[k]);
                }
            }
        }
    }
    LB_ASSERT(terms <= LB_TERMS);
    for (size_t i = 0; i < terms; ++i) {
        const double *s = sum[i];
        term[i] = ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
    }
}

/* Place of a pair among the terms. */
static size_t term_of(size_t i, size_t j) { return i >= j ? i * (i + 1u) / 2u + j : j * (j + 1u) / 2u + i; }

lb_status lb_belt_each(const lb_belt_grid *grid, const lb_belt_rows *rows, const double *parameters,
                       const lb_belt_normal *out, double *work)
{
    enum { n = LB_BELT_PARAMETERS };
    if (!grid || !grid->step || !rows || !rows->value || !rows->weight || !parameters || !out || !work) {
        return LB_ERROR_NULL;
    }
    lb_belt_tile *const tiles = (lb_belt_tile *)(void *)work;
    lb_belt_tiles_of(grid, tiles);
    for (size_t row = 0; row < rows->rows; ++row) {
        const lb_mode m = lb_mode_of(parameters + row * n, 1.0 / grid->rate_hz);
        double term[LB_TERMS];
        add_row(&m, tiles, rows, row, grid->lines, (const lb_lanes *)0, n, term);
        for (size_t i = 0; i < n; ++i) {
            out->gradient[row * n + i] = term[term_of(n, i)];
            for (size_t j = 0; j < n; ++j) {
                out->matrix[(row * n + i) * n + j] = term[term_of(i, j)];
            }
        }
        out->cost[row] = term[term_of(n, n)];
    }
    return LB_OK;
}

/* Where the unknowns of one parameter begin, how many there are, and the slope of the parameter by each. */
typedef struct {
    size_t at, count;
    const double *share;
} part;

static void find_parts(const lb_belt_splines *s, size_t row, part parts[LB_SLOPES])
{
    static const double one = 1.0;
    const part found[LB_SLOPES] = {{0u, 1u, &one},
                                   {1u, 1u, &one},
                                   {2u, s->stiffness, s->stiffness_basis + row * s->stiffness},
                                   {2u + s->stiffness, s->damping, s->damping_basis + row * s->damping},
                                   {2u + s->stiffness + s->damping, 1u, &one}};
    for (size_t i = 0; i < LB_SLOPES; ++i) {
        parts[i] = found[i];
    }
}

/* From the slopes by the parameters of a row to those by the unknowns: the lower triangle. */
static void add_to(const lb_belt_normal *out, size_t unknowns, const part parts[LB_SLOPES], const double *term)
{
    for (size_t i = 0; i < LB_SLOPES; ++i) {
        for (size_t a = 0; a < parts[i].count; ++a) {
            const double share = parts[i].share[a];
            double *const row = out->matrix + (parts[i].at + a) * unknowns;
            if (share == 0.0) { /* most splines are zero at a place */
                continue;
            }
            out->gradient[parts[i].at + a] += share * term[term_of(LB_SLOPES, i)];
            for (size_t j = 0; j <= i; ++j) {
                const double both = share * term[term_of(i, j)];
                for (size_t b = 0; b < parts[j].count; ++b) {
                    row[parts[j].at + b] += both * parts[j].share[b];
                }
            }
        }
    }
    out->cost[0] += term[term_of(LB_SLOPES, LB_SLOPES)];
}

lb_status lb_belt_together(const lb_belt_grid *grid, const lb_belt_rows *rows, const lb_belt_splines *splines,
                           const double *unknowns, const lb_belt_normal *out, double *work)
{
    if (!grid || !grid->step || !grid->theta || !rows || !rows->value || !rows->weight || !splines || !unknowns ||
        !out || !work) {
        return LB_ERROR_NULL;
    }
    const size_t count = 3u + splines->stiffness + splines->damping;
    const double ticks = unknowns[count - 1u];
    lb_belt_tile *const tiles = (lb_belt_tile *)(void *)work;
    lb_lanes *const turns = (lb_lanes *)(void *)(tiles + lb_tiles(grid->lines));
    lb_belt_tiles_of(grid, tiles);
    for (size_t i = 0; i < lb_tiles(grid->lines) * LB_LANES; ++i) {
        const lb_complex turned = lb_turned(tiles[i / LB_LANES].theta[i % LB_LANES] * ticks);
        turns[i / LB_LANES].re[i % LB_LANES] = turned.re;
        turns[i / LB_LANES].im[i % LB_LANES] = turned.im;
    }
    out->cost[0] = 0.0;
    for (size_t i = 0; i < count; ++i) {
        out->gradient[i] = 0.0;
        for (size_t j = 0; j < count; ++j) {
            out->matrix[i * count + j] = 0.0;
        }
    }
    for (size_t row = 0; row < rows->rows; ++row) {
        part parts[LB_SLOPES];
        double parameters[LB_BELT_PARAMETERS], term[LB_TERMS];
        find_parts(splines, row, parts);
        for (size_t i = 0; i < LB_BELT_PARAMETERS; ++i) {
            parameters[i] = 0.0;
            for (size_t a = 0; a < parts[i].count; ++a) {
                parameters[i] += parts[i].share[a] * unknowns[parts[i].at + a];
            }
        }
        const lb_mode m = lb_mode_of(parameters, 1.0 / grid->rate_hz);
        add_row(&m, tiles, rows, row, grid->lines, turns, LB_SLOPES, term);
        add_to(out, count, parts, term);
    }
    for (size_t i = 0; i < count; ++i) {
        for (size_t j = i + 1u; j < count; ++j) {
            out->matrix[i * count + j] = out->matrix[j * count + i];
        }
    }
    return LB_OK;
}
