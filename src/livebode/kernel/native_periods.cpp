// Periods of a signal, in C, for livebode.kernel._periods.
#include "native_periods.h"

#include <nanobind/nanobind.h>

#include <vector>

#include "livebode/periods.h"
#include "native_array.h"

namespace {

using namespace native;

// Periods (periods, window).
struct Periods {
    size_t periods, window;
    Array x;
    lb_periods of;

    Periods(nb::handle data, int set)
        : periods(length_of(data, 0)), window(length_of(data, 1)), x(data, REAL, {periods, window}),
          of{periods, window, x, static_cast<lb_instruction_set>(set)}
    {
    }
    size_t size() const { return periods * window; }
};

void typical(nb::handle data, int set, nb::handle out)
{
    const Periods p(data, set);
    const Array found(out, REAL, {p.window}, WRITE);
    call(p.size(), [&] { return lb_periods_typical(&p.of, found); });
}

void levels(nb::handle data, nb::handle less, int set, nb::handle out)
{
    const Periods p(data, set);
    const Array other(less, REAL, {p.window}, READ, true), found(out, REAL, {p.periods}, WRITE);
    std::vector<double> work(LB_PERIODS_WORK(p.window));
    call(p.size(), [&] { return lb_periods_levels(&p.of, other, work.data(), found); });
}

// Drift: position, its middle, level, slopes before and behind, and what remains of all.
void straighten(nb::handle data, nb::tuple drift, int set, nb::handle out)
{
    const Periods p(data, set);
    const Array position(drift[0], REAL, {p.window}), level(drift[2], REAL, {p.periods}),
        before(drift[3], REAL, {p.periods}), behind(drift[4], REAL, {p.periods}),
        found(out, REAL, {p.periods, p.window}, WRITE);
    const lb_periods_drift of = {position, nb::cast<size_t>(drift[1]), level, before,
                                 behind,   nb::cast<double>(drift[5])};
    call(p.size(), [&] { return lb_periods_straighten(&p.of, &of, found); });
}

void reach(nb::handle data, nb::handle typical_one, int set, nb::handle far, nb::handle size)
{
    const Periods p(data, set);
    const Array one(typical_one, REAL, {p.window}), away(far, REAL, {p.periods}, WRITE),
        sizes(size, REAL, {p.periods}, WRITE);
    call(p.size(), [&] { return lb_periods_reach(&p.of, one, away, sizes); });
}

} // namespace

void bind_periods(nb::module_ &m)
{
    m.def("periods_typical", &typical);
    m.def("periods_levels", &levels, nb::arg(), nb::arg().none(), nb::arg(), nb::arg());
    m.def("periods_straighten", &straighten);
    m.def("periods_reach", &reach);
}
