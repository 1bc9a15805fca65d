/* Responses of a model at any frequencies. */
#include "fit.h"

#define LB_PIECE 64u

typedef struct {
    double theta[LB_PIECE], numbers[9u][2][LB_PIECE];
} lb_tables;

static void prepare(lb_places *p, lb_tables *t, lb_curve *to)
{
    lb_curve *curves[] = {&p->w,     &p->square,     &p->before, &p->once, &p->once_late,
                          &p->twice, &p->twice_late, &p->turned, to};
    p->theta = t->theta;
    for (size_t i = 0; i < sizeof curves / sizeof *curves; ++i) {
        curves[i]->re = t->numbers[i][0];
        curves[i]->im = t->numbers[i][1];
    }
}

lb_status lb_fit_response(const lb_fit_model *model, double rate_hz, size_t rows, size_t lines, size_t stride,
                          const double *values, const double *frequency_hz, double *response)
{
    if (!model || (rows && lines && (!values || !frequency_hz || !response))) {
        return LB_ERROR_NULL;
    }
    if (!lb_is_valid(model) || !(rate_hz > 0.0) || (stride && stride < lines)) {
        return LB_ERROR_SIZE;
    }
    lb_tables tables;
    lb_places p = {0};
    lb_curve found;
    prepare(&p, &tables, &found);
    for (size_t first = 0; first < lines; first += LB_PIECE) {
        p.lines = lines - first < LB_PIECE ? lines - first : LB_PIECE;
        p.width = (p.lines + LB_LANES - 1u) / LB_LANES * LB_LANES;
        for (size_t row = 0; row < rows; ++row) {
            if (row == 0u || stride) {
                lb_find_places(&p, frequency_hz + row * stride + first, rate_hz);
            }
            lb_respond(&p, model, values + row * model->parameters, found);
            for (size_t i = 0; i < p.lines; ++i) {
                response[2u * (row * lines + first + i)] = found.re[i];
                response[2u * (row * lines + first + i) + 1u] = found.im[i];
            }
        }
    }
    return LB_OK;
}
