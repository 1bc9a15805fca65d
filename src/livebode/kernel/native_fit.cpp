// The fit in C for livebode.kernel._fit, whose tuples are read here: their order is that of the classes there.
#include "native_fit.h"

#include <nanobind/nanobind.h>

#include <vector>

#include "livebode/margins.h"
#include "native_array.h"

namespace {

using namespace native;

// A line of a fit is as much work as so many numbers of the other stages.
constexpr size_t numbers_of_a_line = 80;

// FitModel: kind, integrators, at_load, lever, arm, ratio, and start, low, high, scale and held of the parameters.
struct Model {
    size_t parameters;
    Array table;
    lb_fit_model model;

    explicit Model(nb::tuple of)
        : parameters(length_of(of[6], 1)), table(of[6], REAL, {5, parameters}),
          model{static_cast<lb_fit_kind>(nb::cast<int>(of[0])),
                parameters,
                nb::cast<int>(of[1]),
                nb::cast<bool>(of[2]),
                nb::cast<double>(of[3]),
                nb::cast<double>(of[4]),
                nb::cast<double>(of[5]),
                column(0),
                column(1),
                column(2),
                column(3),
                column(4)}
    {
    }

  private:
    const double *column(size_t i) const { return table.data<double>() + i * parameters; }
};

void fit(nb::tuple model, nb::handle frequency_hz, double rate_hz, nb::tuple rows, nb::tuple out)
{
    const Model m(model);
    const size_t n = m.parameters, lines = length_of(frequency_hz, 0), count = length_of(rows[0], 0);
    const Array grid_hz(frequency_hz, REAL, {lines});
    const lb_fit_grid grid = {lines, grid_hz, rate_hz};
    const Array value(rows[0], COMPLEX, {count, lines}), sigma(rows[1], REAL, {count, lines});
    const Array use(rows[2], FLAG, {count, lines}), noise_dof(rows[3], REAL, {count});
    const Array start(rows[4], REAL, {count, n}, READ, true), epsilon(rows[5], REAL, {count}, READ, true);
    const lb_fit_rows in = {count, value.data<double>(), sigma, use, noise_dof, start, epsilon};

    const Array values(out[0], REAL, {count, n}, WRITE), covariance(out[1], REAL, {count, n, n}, WRITE);
    const Array status(out[2], INTEGER, {count}, WRITE), of_model(out[3], REAL, {count}, WRITE);
    const Array chi2(out[4], REAL, {count}, WRITE), dof(out[5], REAL, {count}, WRITE);
    const Array response(out[6], COMPLEX, {count, lines}, WRITE), ended(out[7], REAL, {count, n}, WRITE);
    const lb_fit_found found = {values, covariance, status, of_model, chi2, dof, response.data<double>(), ended};
    thread_local std::vector<double> work;
    work.resize(lb_fit_work(&grid));
    double *const numbers = work.data();
    call(numbers_of_a_line * count * lines, [&] { return lb_fit(&m.model, &grid, &in, &found, numbers); });
}

void epsilon_for(nb::handle rest, nb::handle noise, nb::handle size, nb::handle dof, nb::handle out)
{
    const size_t rows = length_of(rest, 0), lines = length_of(rest, 1);
    const Array r(rest, REAL, {rows, lines}), n(noise, REAL, {rows, lines}), s(size, REAL, {rows, lines});
    const Array d(dof, REAL, {rows}), found(out, REAL, {rows}, WRITE);
    expect(lb_fit_epsilon(rows, lines, r, n, s, d, found));
}

// Frequencies (lines,) for all rows, or (rows, lines).
void respond(nb::tuple model, double rate_hz, nb::handle values, nb::handle frequency_hz, bool is_shared,
             nb::handle out)
{
    const Model m(model);
    const size_t rows = length_of(out, 0), lines = length_of(out, 1);
    const Array of(values, REAL, {rows, m.parameters}), response(out, COMPLEX, {rows, lines}, WRITE);
    const Array shared(is_shared ? frequency_hz : nb::none(), REAL, {lines}, READ, true);
    const Array each(is_shared ? nb::none() : frequency_hz, REAL, {rows, lines}, READ, true);
    const double *at = is_shared ? shared.data<double>() : each.data<double>();
    expect(lb_fit_response(&m.model, rate_hz, rows, lines, is_shared ? 0 : lines, of, at, response.data<double>()));
}

// FeedbackSeries and MarginGrid.
void margins(nb::tuple model, nb::tuple feedback, nb::tuple grid, nb::handle values, nb::handle covariance,
             nb::tuple out)
{
    const Model m(model);
    const size_t n = m.parameters, rows = length_of(values, 0), pieces = length_of(feedback[2], 0);
    const size_t points = length_of(grid[0], 0);
    const Array series(feedback[2], COMPLEX, {pieces, LB_FEEDBACK_DEGREE + 1});
    const lb_feedback behind = {nb::cast<double>(feedback[0]), nb::cast<double>(feedback[1]), pieces,
                                series.data<double>()};
    const Array at_hz(grid[0], REAL, {points}), there(grid[1], COMPLEX, {points});
    const lb_margin_grid places = {points, at_hz, there.data<double>(), nb::cast<double>(grid[2])};
    const Array of(values, REAL, {rows, n}), spread(covariance, REAL, {rows, n, n});
    const Array value(out[0], REAL, {rows, LB_MARGINS}, WRITE), sigma(out[1], REAL, {rows, LB_MARGINS}, WRITE);
    const Array frequency(out[2], REAL, {rows, LB_MARGINS}, WRITE);
    const Array frequency_sigma(out[3], REAL, {rows, LB_MARGINS}, WRITE), stable(out[4], FLAG, {rows}, WRITE);
    const lb_margin_rows found = {value, sigma, frequency, frequency_sigma, stable};
    std::vector<double> work(2 * points);
    call(long_work, [&] { return lb_margins(&m.model, &behind, &places, rows, of, spread, &found, work.data()); });
}

} // namespace

void bind_fit(nb::module_ &m)
{
    m.def("fit", &fit);
    m.def("fit_epsilon", &epsilon_for);
    m.def("fit_response", &respond);
    m.def("fit_margins", &margins);
}
