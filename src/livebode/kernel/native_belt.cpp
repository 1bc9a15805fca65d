// Two masses joined by a belt, in C, for livebode.kernel._belt, whose tuples are read here: their order is that of the
// classes there.
#include "native_belt.h"

#include <nanobind/nanobind.h>

#include <vector>

#include "livebode/belt.h"
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

} // namespace

void bind_belt(nb::module_ &m)
{
    m.def("belt_response", &respond);
    m.def("belt_each", &each);
    m.def("belt_together", &together);
}
