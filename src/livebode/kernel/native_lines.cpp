// The line stage in C for livebode.kernel._lines, whose tuples are read here: their order is that of the classes there.
#include "native_lines.h"

#include <nanobind/nanobind.h>

#include "native_array.h"

namespace nb = nanobind;

namespace {

using namespace native;

// LineMoments: windows, means, scatter, moment; and the weights of LineSettings.
struct Moments {
    size_t places, lines;
    Array count, means, scatter, moment, table;
    lb_line_weights weights;
    lb_line_moments moments;

    Moments(nb::tuple of, double forgetting, nb::handle sums)
        : places(length_of(of[1], 1)), lines(length_of(of[1], 2)), count(of[0], INTEGER, {places}, WRITE),
          means(of[1], REAL, {LB_LINE_MEANS, places, lines}, WRITE),
          scatter(of[2], REAL, {LB_LINE_SCATTER, places, lines}, WRITE), moment(of[3], REAL, {3, places}, WRITE),
          table(sums, REAL, {3, length_of(sums, 1)}), weights{forgetting, table, length_of(sums, 1)},
          moments{places, lines, count, means, scatter, moment}
    {
    }
};

double process(nb::tuple settings, nb::tuple moments, nb::tuple windows, nb::tuple out)
{
    const Moments m(moments, nb::cast<double>(settings[0]), settings[1]);
    const nb::handle spectrum = windows[2];
    const size_t signals = length_of(spectrum, 0), rows = length_of(spectrum, 1), bins = length_of(spectrum, 2);
    const size_t lines = m.lines, denominator = nb::cast<size_t>(settings[3]),
                 reference = nb::cast<size_t>(settings[4]);
    if (denominator >= signals || reference >= signals || bins < lines)
        throw nb::value_error("the spectra have too few signals or lines");
    const lb_line_settings set = {nb::cast<bool>(settings[2]), denominator == reference,
                                  static_cast<lb_line_noise>(nb::cast<int>(settings[5])), nb::cast<double>(settings[6]),
                                  nb::cast<double>(windows[10])};

    const Array spectra(spectrum, COMPLEX, {signals, rows, bins});
    const Array noise(windows[3], REAL, {rows, lines}, READ, true);
    const Array whole(windows[4], FLAG, {rows}), clean(windows[5], FLAG, {rows});
    const Array aside(windows[6], FLAG, {rows}, READ, true), moving(windows[7], FLAG, {rows}, READ, true);
    const Array distortion(windows[8], REAL, {rows, lines}, READ, true);
    const Array invalid(windows[9], FLAG, {rows, lines}, READ, true), moment(windows[11], REAL, {3, rows});
    const double *first = spectra.data<double>();
    const size_t signal = 2 * rows * bins;
    const lb_line_windows in = {nb::cast<size_t>(windows[1]),
                                rows,
                                bins,
                                first,
                                first + denominator * signal,
                                first + reference * signal,
                                noise,
                                whole,
                                clean,
                                aside,
                                moving,
                                distortion,
                                invalid,
                                moment};

    const Array value(out[0], COMPLEX, {rows, lines}, WRITE), variance(out[1], REAL, {rows, lines}, WRITE);
    const Array coherence(out[2], REAL, {rows, lines}, WRITE), of_input(out[3], REAL, {rows, lines}, WRITE);
    const Array weight(out[4], COMPLEX, {rows, lines}, WRITE), errors(out[5], REAL, {rows, lines}, WRITE);
    const Array valid(out[6], FLAG, {rows, lines}, WRITE), dof(out[7], REAL, {rows}, WRITE);
    const Array centre(out[8], REAL, {3, rows}, WRITE), usable(out[9], FLAG, {rows}, WRITE);
    const lb_line_rows rows_out = {
        value.data<double>(), variance, coherence, of_input, weight.data<double>(), errors, valid, dof, centre, usable};
    double largest = nb::cast<double>(windows[0]);
    call(rows * lines, [&] { return lb_lines_process(&m.weights, &m.moments, &largest, &set, &in, &rows_out); });
    return largest;
}

} // namespace

void bind_lines(nb::module_ &m) { m.def("process_lines", &process); }
