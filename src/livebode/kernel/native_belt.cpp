// Two masses joined by a belt, in C, for livebode.kernel._belt, whose tuples are read here: their order is that of the
// classes there.
#include "native_belt.h"

#include <nanobind/nanobind.h>

#include <vector>

#include "livebode/belt.h"
#include "livebode/curve.h"
#include "native_array.h"

namespace {

using namespace native;

// A line is as much work as so many numbers of the other stages.
constexpr size_t numbers_of_a_line = 4;
constexpr size_t n = LB_BELT_PARAMETERS;

// BeltGrid: rate, step and theta.
struct Grid {
    size_t lines;
    Array step, theta;
    lb_belt_grid grid;

    explicit Grid(nb::tuple of)
        : lines(length_of(of[1], 0)), step(of[1], COMPLEX, {lines}), theta(of[2], REAL, {lines}),
          grid{lines, nb::cast<double>(of[0]), step.data<double>(), theta}
    {
    }
};

double *work_for(size_t lines)
{
    thread_local std::vector<double> work;
    work.resize(lb_belt_work(lines));
    return work.data();
}

void respond(nb::tuple grid, nb::handle parameters, nb::handle out)
{
    const Grid g(grid);
    const size_t rows = length_of(parameters, 0);
    const Array of(parameters, REAL, {rows, n}), response(out, COMPLEX, {rows, g.lines}, WRITE);
    double *const work = work_for(g.lines);
    call(numbers_of_a_line * rows * g.lines,
         [&] { return lb_belt_response(&g.grid, rows, of, response.data<double>(), work); });
}

void each(nb::tuple grid, nb::tuple rows, nb::handle parameters, nb::tuple out)
{
    const Grid g(grid);
    const size_t count = length_of(parameters, 0);
    const Array value(rows[0], COMPLEX, {count, g.lines}), weight(rows[1], REAL, {count, g.lines});
    const Array of(parameters, REAL, {count, n});
    const Array cost(out[0], REAL, {count}, WRITE), gradient(out[1], REAL, {count, n}, WRITE);
    const Array matrix(out[2], REAL, {count, n, n}, WRITE);
    const lb_belt_rows in = {count, value.data<double>(), weight};
    const lb_belt_normal found = {cost, gradient, matrix};
    double *const work = work_for(g.lines);
    call(numbers_of_a_line * count * g.lines, [&] { return lb_belt_each(&g.grid, &in, of, &found, work); });
}

void together(nb::tuple grid, nb::tuple rows, nb::tuple splines, nb::handle unknowns, nb::tuple out)
{
    const Grid g(grid);
    const size_t count = length_of(rows[1], 0), stiffness = length_of(splines[0], 1);
    const size_t damping = length_of(splines[1], 1), all = 3 + stiffness + damping;
    const Array value(rows[0], COMPLEX, {count, g.lines}), weight(rows[1], REAL, {count, g.lines});
    const Array of_stiffness(splines[0], REAL, {count, stiffness}), of_damping(splines[1], REAL, {count, damping});
    const Array known(unknowns, REAL, {all});
    const Array cost(out[0], REAL, {1}, WRITE), gradient(out[1], REAL, {1, all}, WRITE);
    const Array matrix(out[2], REAL, {1, all, all}, WRITE);
    const lb_belt_rows in = {count, value.data<double>(), weight};
    const lb_belt_splines places = {stiffness, damping, of_stiffness, of_damping};
    const lb_belt_normal found = {cost, gradient, matrix};
    double *const work = work_for(g.lines);
    call(numbers_of_a_line * count * g.lines,
         [&] { return lb_belt_together(&g.grid, &in, &places, known, &found, work); });
}

void replay(nb::tuple masses, nb::tuple course, nb::tuple out)
{
    const size_t ticks = length_of(course[1], 0);
    const Array stiffness(course[1], REAL, {ticks}), damping(course[2], REAL, {ticks}),
        torque(course[3], REAL, {ticks});
    const Array motor(out[0], REAL, {ticks}, WRITE), cart(out[1], REAL, {ticks}, WRITE);
    const lb_belt_masses of = {nb::cast<double>(masses[0]), nb::cast<double>(masses[1]), nb::cast<double>(masses[2])};
    const lb_belt_course along = {ticks, nb::cast<double>(course[0]), stiffness, damping, torque};
    call(ticks, [&] { return lb_belt_replay(&of, &along, motor, cart); });
}

// CurveShape: knots, weights, reach, and slopes before and beyond the ends.
struct Knots {
    size_t splines;
    Array table;
    lb_curve_knots knots;

    explicit Knots(nb::handle of)
        : splines(splines_of(of)), table(of, REAL, {splines + LB_CURVE_DEGREE + 1}), knots{splines, table}
    {
    }

  private:
    static size_t splines_of(nb::handle of)
    {
        const size_t length = length_of(of, 0);
        if (length < 2 * (LB_CURVE_DEGREE + 1)) throw nb::value_error("a cubic spline needs eight knots");
        return length - LB_CURVE_DEGREE - 1;
    }
};

void curve_at(nb::tuple shape, nb::handle x, nb::handle out)
{
    const Knots k(shape[0]);
    const size_t count = length_of(x, 0);
    const Array weights(shape[1], REAL, {k.splines}), at(x, REAL, {count}), found(out, REAL, {count}, WRITE);
    const lb_curve_shape of = {weights, nb::cast<double>(shape[2]), nb::cast<double>(shape[3]),
                               nb::cast<double>(shape[4])};
    call(count, [&] { return lb_curve_at(&k.knots, &of, count, at, found); });
}

void curve_splines(nb::handle knots, nb::handle x, nb::handle out)
{
    const Knots k(knots);
    const size_t count = length_of(x, 0);
    const Array at(x, REAL, {count}), found(out, REAL, {count, k.splines}, WRITE);
    call(count, [&] { return lb_curve_splines(&k.knots, count, at, found); });
}

} // namespace

void bind_belt(nb::module_ &m)
{
    m.def("belt_response", &respond);
    m.def("belt_each", &each);
    m.def("belt_together", &together);
    m.def("belt_replay", &replay);
    m.def("curve_at", &curve_at);
    m.def("curve_splines", &curve_splines);
}
