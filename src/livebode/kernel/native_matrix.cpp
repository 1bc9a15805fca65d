// Matrices of responses in C for livebode.kernel._matrix, whose tuples are read here: their order is that of the
// classes there.
#include "native_matrix.h"

#include <nanobind/nanobind.h>

#include "livebode/matrix.h"
#include "native_array.h"

namespace nb = nanobind;

namespace {

using namespace native;

lb_matrix_settings settings_of(nb::tuple of)
{
    return {nb::cast<size_t>(of[0]),
            nb::cast<size_t>(of[1]),
            nb::cast<size_t>(of[2]),
            nb::cast<size_t>(of[3]),
            nb::cast<size_t>(of[4]),
            nb::cast<size_t>(of[5]),
            nb::cast<size_t>(of[6]),
            nb::cast<bool>(of[7]),
            nb::cast<bool>(of[8]),
            nb::cast<double>(of[9]),
            static_cast<lb_instruction_set>(nb::cast<int>(of[10]))};
}

void process(nb::tuple settings, nb::tuple history, nb::tuple windows, nb::tuple out)
{
    const lb_matrix_settings s = settings_of(settings);
    const size_t outputs = s.outputs, inputs = s.inputs, lines = s.lines;
    const size_t all = outputs + inputs + s.beside, length = length_of(history[0], 0);
    const Array ring(history[0], REAL, {length, all, 2, lines}, WRITE);
    const Array complete(history[1], FLAG, {length}, WRITE), work(history[2], REAL, {3, inputs, lines}, WRITE);
    const lb_matrix_history h = {length, ring, complete, work};

    const size_t of = length_of(windows[1], 1), bins = length_of(windows[1], 2);
    const Array spectrum(windows[1], COMPLEX, {all, of, bins});
    const size_t rows = length_of(windows[2], 0);
    const Array row(windows[2], INTEGER, {rows}), clean(windows[3], FLAG, {of});
    const lb_matrix_windows in = {nb::cast<size_t>(windows[0]), rows, of, bins, spectrum, row, clean};

    const Array value(out[0], COMPLEX, {rows, lines, outputs, inputs}, WRITE);
    const Array noise(out[1], COMPLEX, {rows, lines, outputs, outputs}, WRITE);
    const Array spread(out[2], COMPLEX, {rows, lines, inputs, inputs}, WRITE);
    const Array coherence(out[3], REAL, {rows, lines, outputs}, WRITE);
    const Array condition(out[4], REAL, {rows, lines}, WRITE), dof(out[5], REAL, {rows}, WRITE);
    const Array count(out[6], INTEGER, {rows}, WRITE), sure(out[7], FLAG, {rows, lines}, WRITE);
    const lb_matrix_rows results = {value, noise, spread, coherence, condition, dof, count, sure};
    call(rows * lines * s.experiments * s.repetitions * outputs * inputs,
         [&] { return lb_matrix_process(&s, &h, &in, &results); });
}

} // namespace

void bind_matrix(nb::module_ &m) { m.def("process_matrices", &process); }
