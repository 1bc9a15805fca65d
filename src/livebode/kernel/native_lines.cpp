// The line stage in C for livebode.kernel._lines, whose tuples are read here: their order is that of the classes there.
#include "native_lines.h"

#include <nanobind/nanobind.h>

#include <cmath>
#include <cstring>
#include <deque>
#include <limits>
#include <memory>
#include <vector>

#include "livebode/sizes.h"
#include "native_array.h"

namespace nb = nanobind;

namespace {

using namespace native;

// LineMoments: windows, means, scatter, change, moment; and the weights of LineSettings.
struct Moments {
    size_t places, lines;
    Array count, means, scatter, change, moment, table;
    lb_line_weights weights;
    lb_line_moments moments;

    Moments(nb::tuple of, double forgetting, nb::handle sums)
        : places(length_of(of[1], 1)), lines(length_of(of[1], 2)), count(of[0], INTEGER, {places}, WRITE),
          means(of[1], REAL, {LB_LINE_MEANS, places, lines}, WRITE),
          scatter(of[2], REAL, {LB_LINE_SCATTER, places, lines}, WRITE),
          change(of[3], REAL, {LB_LINE_CHANGES, places, lines}, WRITE),
          moment(of[4], REAL, {LB_LINE_PLACE, places}, WRITE), table(sums, REAL, {LB_LINE_SUMS, length_of(sums, 1)}),
          weights{forgetting, table, length_of(sums, 1)}, moments{places, lines, count, means, scatter, change, moment}
    {
    }
};

lb_instruction_set instruction_set_of(nb::tuple settings)
{
    return static_cast<lb_instruction_set>(nb::cast<int>(settings[7]));
}

double process(nb::tuple settings, nb::tuple moments, nb::tuple windows, nb::tuple out)
{
    const Moments m(moments, nb::cast<double>(settings[0]), settings[1]);
    const nb::handle spectrum = windows[2];
    const size_t signals = length_of(spectrum, 0), rows = length_of(spectrum, 1), bins = length_of(spectrum, 2);
    const size_t lines = m.lines, denominator = nb::cast<size_t>(settings[3]),
                 reference = nb::cast<size_t>(settings[4]);
    if (denominator >= signals || reference >= signals || bins < lines)
        throw nb::value_error("the spectra have too few signals or lines");
    const lb_line_settings set = {nb::cast<bool>(settings[2]),
                                  denominator == reference,
                                  static_cast<lb_line_noise>(nb::cast<int>(settings[5])),
                                  nb::cast<double>(settings[6]),
                                  nb::cast<double>(windows[11]),
                                  instruction_set_of(settings)};

    const Array spectra(spectrum, COMPLEX, {signals, rows, bins});
    const Array noise(windows[3], REAL, {rows, lines}, READ, true);
    const Array whole(windows[4], FLAG, {rows}), clean(windows[5], FLAG, {rows});
    const Array aside(windows[6], FLAG, {rows}, READ, true), moving(windows[7], FLAG, {rows}, READ, true);
    const size_t verdicts = windows[8].is_none() ? 0 : length_of(windows[8], 0);
    const Array distortion(windows[8], REAL, {verdicts, lines}, READ, true);
    const Array invalid(windows[9], FLAG, {verdicts, lines}, READ, true);
    const Array verdict(windows[10], INTEGER, {rows}, READ, true), moment(windows[12], REAL, {3, rows});
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
                                verdict,
                                verdicts,
                                moment};

    const Array value(out[0], COMPLEX, {rows, lines}, WRITE), sigma(out[1], REAL, {rows, lines}, WRITE);
    const Array coherence(out[2], REAL, {rows, lines}, WRITE), of_input(out[3], REAL, {rows, lines}, WRITE);
    const Array weight(out[4], COMPLEX, {rows, lines}, WRITE), errors(out[5], REAL, {rows, lines}, WRITE);
    const Array variation(out[6], REAL, {rows, lines}, WRITE), valid(out[7], FLAG, {rows, lines}, WRITE);
    const Array dof(out[8], REAL, {rows}, WRITE), centre(out[9], REAL, {3, rows}, WRITE);
    const Array usable(out[10], FLAG, {rows}, WRITE);
    const lb_line_rows rows_out = {value.data<double>(),
                                   sigma,
                                   coherence,
                                   of_input,
                                   weight.data<double>(),
                                   errors,
                                   variation,
                                   valid,
                                   dof,
                                   centre,
                                   usable};
    double largest = nb::cast<double>(windows[0]);
    call(rows * lines, [&] { return lb_lines_process(&m.weights, &m.moments, &largest, &set, &in, &rows_out); });
    return largest;
}

// LineMoments of one of several stages with the same settings, places and lines.
struct StageMoments {
    Array count, means, scatter, change, moment;

    StageMoments(nb::tuple of, size_t places, size_t lines)
        : count(of[0], INTEGER, {places}, WRITE), means(of[1], REAL, {LB_LINE_MEANS, places, lines}, WRITE),
          scatter(of[2], REAL, {LB_LINE_SCATTER, places, lines}, WRITE),
          change(of[3], REAL, {LB_LINE_CHANGES, places, lines}, WRITE),
          moment(of[4], REAL, {LB_LINE_PLACE, places}, WRITE)
    {
    }
};

double magnitude(const double *x) { return std::hypot(x[0], x[1]); }

// Largest magnitudes (signals, rows) of spectra (signals, rows, bins); NaN where one is not a number.
void largest_magnitudes(nb::handle spectrum, nb::handle out)
{
    const size_t signals = length_of(spectrum, 0), rows = length_of(spectrum, 1), bins = length_of(spectrum, 2);
    const Array spectra(spectrum, COMPLEX, {signals, rows, bins}), largest(out, REAL, {signals, rows}, WRITE);
    const double *x = spectra.data<double>();
    double *found = largest;
    for (size_t i = 0; i < signals * rows; ++i) {
        found[i] = 0.0;
        for (size_t k = 0; k < bins; ++k, x += 2) {
            const double size = magnitude(x);
            if (size > found[i] || std::isnan(size)) found[i] = size;
            if (std::isnan(found[i])) {
                x += 2 * (bins - k);
                break;
            }
        }
    }
}

// What is known of one of several machines: its moments, largest magnitudes of the period so far and their limits.
struct Machine {
    StageMoments moments;
    Array sizes, limits;
    bool ends;

    Machine(nb::tuple of, size_t places, size_t lines, size_t signals)
        : moments(nb::cast<nb::tuple>(of[0]), places, lines), sizes(of[1], REAL, {signals}, WRITE),
          limits(of[2], REAL, {signals}, WRITE), ends(nb::cast<bool>(of[3]))
    {
    }
};

// The largest magnitudes of the chosen lines of a machine's spectrum, which is copied; false for one that is not usual.
bool copy_usual(const Array &sums, const Array &signals, const Array &columns, size_t machine, size_t machines,
                size_t bins, size_t rows, size_t lines, const Machine &about, double *spectrum, double *sizes)
{
    const int64_t *signal = signals, *column = columns;
    const double *limit = about.limits, *before = about.sizes;
    for (size_t s = 0; s < rows; ++s) {
        const double *from = sums.data<double>() + 2 * (signal[s] * machines + machine) * bins;
        double largest = before[s];
        for (size_t k = 0; k < lines; ++k, spectrum += 2) {
            spectrum[0] = from[2 * column[k]];
            spectrum[1] = from[2 * column[k] + 1];
            const double size = magnitude(spectrum);
            if (!std::isfinite(size)) return false;
            if (size > largest) largest = size;
        }
        if (largest > limit[s]) return false;
        sizes[s] = largest;
    }
    return true;
}

// One window of each of several machines with the same settings, from sums (all signals, machines, all bins). The
// results of those whose spectrum is due, finite and within its limits are the first rows, and `taken` tells which
// these are; others do not change. Where a period ends, the limits become `factor` times its largest magnitudes.
// Everything is checked before the first moments change. Returns the number of rows.
size_t process_newest(nb::tuple settings, nb::list each, nb::handle largest_so_far, nb::handle place, nb::handle sums,
                      nb::tuple chosen, nb::handle windows, double factor, nb::tuple out, nb::handle taken)
{
    const size_t machines = each.size(), all = length_of(sums, 0), bins = length_of(sums, 2);
    if (!machines) return 0;
    const nb::tuple first = nb::cast<nb::tuple>(nb::cast<nb::tuple>(each[0])[0]);
    const size_t places = length_of(first[1], 1), lines = length_of(first[1], 2);
    const size_t signals = length_of(chosen[0], 0);
    const size_t denominator = nb::cast<size_t>(settings[3]), reference = nb::cast<size_t>(settings[4]);
    if (denominator >= signals || reference >= signals || length_of(chosen[1], 0) != lines)
        throw nb::value_error("the spectra have too few signals or lines");
    const Array table(settings[1], REAL, {LB_LINE_SUMS, length_of(settings[1], 1)});
    const lb_line_weights weights = {nb::cast<double>(settings[0]), table, length_of(settings[1], 1)};
    const lb_line_settings set = {nb::cast<bool>(settings[2]), denominator == reference, LB_NOISE_SCATTER, 0.0, 0.0,
                                  instruction_set_of(settings)};
    std::deque<Machine> about;
    for (const nb::handle one : each) about.emplace_back(nb::cast<nb::tuple>(one), places, lines, signals);
    const Array largest(largest_so_far, REAL, {machines}, WRITE), at(place, INTEGER, {machines});
    const Array every(sums, COMPLEX, {all, machines, bins}), moment(windows, REAL, {machines, 3});
    const Array rows_of(chosen[0], INTEGER, {signals}), columns(chosen[1], INTEGER, {lines});
    const int64_t *place_of = at, *row_of = rows_of, *column_of = columns;
    for (size_t i = 0; i < machines; ++i)
        if (place_of[i] < 0 || static_cast<size_t>(place_of[i]) >= places)
            throw nb::value_error("the period does not have this place");
    for (size_t s = 0; s < signals; ++s)
        if (row_of[s] < 0 || static_cast<size_t>(row_of[s]) >= all) throw nb::value_error("there is no such signal");
    for (size_t k = 0; k < lines; ++k)
        if (column_of[k] < 0 || static_cast<size_t>(column_of[k]) >= bins)
            throw nb::value_error("there is no such bin");

    const Array value(out[0], COMPLEX, {machines, lines}, WRITE), sigma(out[1], REAL, {machines, lines}, WRITE);
    const Array coherence(out[2], REAL, {machines, lines}, WRITE), of_input(out[3], REAL, {machines, lines}, WRITE);
    const Array weight(out[4], COMPLEX, {machines, lines}, WRITE), errors(out[5], REAL, {machines, lines}, WRITE);
    const Array variation(out[6], REAL, {machines, lines}, WRITE), valid(out[7], FLAG, {machines, lines}, WRITE);
    const Array dof(out[8], REAL, {machines}, WRITE), centre(out[9], REAL, {machines, 3}, WRITE);
    const Array usable(out[10], FLAG, {machines}, WRITE);
    const Array is_taken(taken, FLAG, {machines}, WRITE);
    std::vector<double> spectrum(2 * signals * lines), sizes(signals);
    const uint8_t yes = 1;
    size_t row = 0;
    call(machines * lines, [&] {
        lb_status status = LB_OK;
        for (size_t i = 0; i < machines && status == LB_OK; ++i) {
            const Machine &of = about[i];
            uint8_t &is_due = is_taken.data<uint8_t>()[i];
            is_due = is_due && copy_usual(every, rows_of, columns, i, machines, bins, signals, lines, of,
                                          spectrum.data(), sizes.data());
            if (!is_due) continue;
            const StageMoments &past = of.moments;
            const lb_line_moments m = {places, lines, past.count, past.means, past.scatter, past.change, past.moment};
            const lb_line_windows in = {static_cast<size_t>(place_of[i]),
                                        1,
                                        lines,
                                        spectrum.data(),
                                        spectrum.data() + 2 * denominator * lines,
                                        spectrum.data() + 2 * reference * lines,
                                        nullptr,
                                        &yes,
                                        &yes,
                                        nullptr,
                                        nullptr,
                                        nullptr,
                                        nullptr,
                                        nullptr,
                                        0,
                                        moment.data<double>() + 3 * i};
            const size_t to = row * lines;
            const lb_line_rows rows = {
                value.data<double>() + 2 * to,   sigma.data<double>() + to,      coherence.data<double>() + to,
                of_input.data<double>() + to,    weight.data<double>() + 2 * to, errors.data<double>() + to,
                variation.data<double>() + to,   valid.data<uint8_t>() + to,     dof.data<double>() + row,
                centre.data<double>() + 3 * row, usable.data<uint8_t>() + row};
            status = lb_lines_process(&weights, &m, largest.data<double>() + i, &set, &in, &rows);
            double *size = of.sizes, *limit = of.limits;
            for (size_t s = 0; s < signals; ++s) {
                size[s] = of.ends ? 0.0 : sizes[s];
                if (of.ends) limit[s] = sizes[s] > 0 ? factor * sizes[s] : std::numeric_limits<double>::infinity();
            }
            ++row;
        }
        return status;
    });
    return row;
}

// Samples (signals, any), contiguous along the last axis, and their largest sizes (signals, stretches).
void largest_sizes(nb::handle samples, size_t begun, size_t window, int set, nb::handle out)
{
    Py_buffer rows;
    if (PyObject_GetBuffer(samples.ptr(), &rows, PyBUF_STRIDES | PyBUF_FORMAT) != 0) throw nb::python_error();
    const std::unique_ptr<Py_buffer, void (*)(Py_buffer *)> held(&rows, PyBuffer_Release);
    const bool fits = rows.ndim == 2 && std::strcmp(rows.format, REAL) == 0 && rows.strides[1] == sizeof(double);
    if (!fits || !begun || !window) throw nb::value_error("an array has another type or shape");
    const size_t signals = rows.shape[0], count = rows.shape[1];
    const size_t stretches = 1 + (count > begun ? (count - begun + window - 1) / window : 0);
    double *found = Array(out, REAL, {signals, stretches}, WRITE);
    const char *first = static_cast<const char *>(rows.buf);
    call(signals * count, [&] {
        lb_status status = LB_OK;
        for (size_t i = 0; i < signals && status == LB_OK; ++i) {
            const double *x = reinterpret_cast<const double *>(first + static_cast<Py_ssize_t>(i) * rows.strides[0]);
            status =
                lb_largest_sizes(x, count, begun, window, static_cast<lb_instruction_set>(set), found + i * stretches);
        }
        return status;
    });
}

} // namespace

void bind_lines(nb::module_ &m)
{
    m.def("process_lines", &process);
    m.def("process_newest", &process_newest);
    m.def("largest_magnitudes", &largest_magnitudes);
    m.def("largest_sizes", &largest_sizes);
}
