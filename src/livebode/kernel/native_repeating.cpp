// Errors that repeat with the excitation, in C, for livebode.kernel._repeating, whose tuples are read here: their order
// is that of the classes there.
#include "native_repeating.h"

#include <nanobind/nanobind.h>

#include <exception>
#include <limits>
#include <list>
#include <memory>

#include "livebode/repeating.h"
#include "native_array.h"

namespace nb = nanobind;

namespace {

using namespace native;

// RepeatingSettings: what all calls have in common. Holds the arrays, and has checked every place in them.
class Plan {
  public:
    explicit Plan(nb::tuple of)
    {
        plan_.window = nb::cast<size_t>(of[0]);
        plan_.signals = nb::cast<size_t>(of[1]);
        const nb::tuple signals = nb::cast<nb::tuple>(of[2]);
        for (size_t i = 0; i < 3; ++i) plan_.of_signal[i] = nb::cast<size_t>(signals[i]);
        const size_t lines = plan_.lines = length_of(of[6], 0), beside = length_of(of[12], 0), bins = lines + beside;
        const size_t spectrum = plan_.window / 2 + 1;
        plan_.bin = places(of[3], {bins}, spectrum);
        if (!of[4].is_none()) plan_.after = hold(of[4], COMPLEX, {3, bins}).data<double>();
        plan_.instrument = nb::cast<bool>(of[5]);
        plan_.of_step = hold(of[6], REAL, {lines});
        plan_.judged_every = nb::cast<size_t>(of[7]);
        lb_mains &mains = plan_.mains;
        mains.bins = length_of(of[8], 0);
        mains.bin = places(of[8], {mains.bins}, spectrum);
        mains.multiples = hold(of[9], FLAG, {LB_MAINS, lines});
        for (size_t i = 0; i < LB_MAINS; ++i) mains.free[i] = tones(nb::cast<nb::tuple>(of[10][i]));
        mains.excited = tones(nb::cast<nb::tuple>(of[11]));
        lb_distortion &distortion = plan_.distortion;
        distortion.bins = beside;
        distortion.left = places(of[12], {beside}, lines);
        distortion.right = places(of[13], {beside}, lines);
        distortion.share = hold(of[14], REAL, {beside});
        distortion.beside = places(of[15], {2, lines, LB_BESIDE}, beside ? beside : 1);
        distortion.member = hold(of[16], FLAG, {2, lines, LB_BESIDE});
        distortion.position = hold(of[17], REAL, {lines});
        const bool has_signals = plan_.of_signal[0] < plan_.signals && plan_.of_signal[1] < plan_.signals &&
                                 plan_.of_signal[2] < plan_.signals;
        if (!has_signals || !plan_.judged_every || (mains.bins && mains.excited.count != lines)) refuse();
    }

    Plan(const Plan &) = delete;
    Plan &operator=(const Plan &) = delete;

    const lb_repeating_plan &get() const { return plan_; }

  private:
    lb_repeating_plan plan_{};
    std::list<Array> arrays_; // does not move what it holds

    const Array &hold(nb::handle array, const char *formats, std::initializer_list<size_t> shape)
    {
        return arrays_.emplace_back(array, formats, shape);
    }
    const int64_t *places(nb::handle array, std::initializer_list<size_t> shape, size_t limit)
    {
        const int64_t *found = hold(array, INTEGER, shape);
        size_t count = 1;
        for (const size_t length : shape) count *= length;
        for (size_t i = 0; i < count; ++i)
            if (found[i] < 0 || static_cast<uint64_t>(found[i]) >= limit) refuse();
        return found;
    }
    lb_tones tones(nb::tuple of)
    {
        const size_t count = length_of(of[0], 0), beside = length_of(of[1], 1), limit = plan_.mains.bins;
        if (beside > LB_NEIGHBOURS_MAX) refuse();
        return {count,
                beside,
                places(of[0], {count}, limit),
                places(of[1], {count, beside}, limit),
                hold(of[2], FLAG, {count, beside}),
                hold(of[3], REAL, {count}),
                hold(of[4], FLAG, {count}),
                hold(of[5], REAL, {count})};
    }
    [[noreturn]] static void refuse() { throw nb::value_error("the settings of repeating errors were refused"); }
};

// The functions of Python for what is rarely needed. C has no exceptions: the first one is raised after it returned.
struct Rare {
    nb::handle step_of, by_chance;
    std::exception_ptr failure;

    template <typename Work> double number(Work work)
    {
        nb::gil_scoped_acquire acquire;
        try {
            if (!failure) return nb::cast<double>(work());
        } catch (...) {
            failure = std::current_exception();
        }
        return std::numeric_limits<double>::quiet_NaN();
    }
    static double step(void *context, size_t period)
    {
        Rare &rare = *static_cast<Rare *>(context);
        return rare.number([&] { return rare.step_of(period); });
    }
    static double chance(void *context, size_t known, double dof)
    {
        Rare &rare = *static_cast<Rare *>(context);
        return rare.number([&] { return rare.by_chance(known, dof); });
    }
};

// PeriodState and PeriodSpectra in, PeriodVerdicts out; returns the first two numbers of the state.
nb::tuple judge_periods(const Plan &of, nb::tuple state, nb::tuple periods, nb::tuple out)
{
    const lb_repeating_plan &plan = of.get();
    const size_t lines = plan.lines, bins = lines + plan.distortion.bins, kinds = LB_VERDICT_KINDS;
    const Array windows(state[2], INTEGER, {1}, WRITE), means(state[3], REAL, {LB_LINE_MEANS, 1, bins}, WRITE);
    const Array scatter(state[4], REAL, {LB_LINE_SCATTER, 1, bins}, WRITE);
    const Array output(state[5], COMPLEX, {plan.mains.bins}, WRITE);
    const Array silent(state[6], REAL, {LB_SILENT_PERIODS, lines}, WRITE), hum(state[7], REAL, {lines}, WRITE);
    const Array low(state[8], REAL, {lines}, WRITE), counts(state[9], REAL, {2}, WRITE);
    const Array told(state[10], FLAG, {kinds, lines}, WRITE);
    lb_repeating_state now = {nb::cast<double>(state[0]),
                              nb::cast<double>(state[1]),
                              {1, bins, windows, means, scatter, nullptr, nullptr},
                              output.data<double>(),
                              silent,
                              hum,
                              low,
                              counts,
                              told};

    const nb::handle spectra = periods[0];
    const size_t count = length_of(spectra, 1);
    const Array every(spectra, COMPLEX, {plan.signals, count, plan.window / 2 + 1});
    const Array usable(periods[1], FLAG, {count}), moves(periods[2], FLAG, {count});
    const Array before(periods[3], REAL, {lines}), against(periods[4], FLAG, {kinds, lines});
    Rare rare{periods[5], periods[6], nullptr};
    const std::unique_ptr<double[]> scratch(new double[lb_repeating_scratch(&plan)]);
    const lb_periods in = {
        count, every.data<double>(), usable, moves, before, against, scratch.get(), {&rare, Rare::step, Rare::chance}};

    const size_t rows = count + 1;
    const Array distortion(out[0], REAL, {rows, lines}, WRITE), reasons(out[1], FLAG, {rows, kinds, lines}, WRITE);
    const Array invalid(out[2], FLAG, {rows, lines}, WRITE), happened(out[3], BYTE, {count}, WRITE);
    const Array news(out[4], BYTE, {count, kinds, lines}, WRITE), pair(out[5], COMPLEX, {count, 2, lines}, WRITE);
    const Array steps(out[6], REAL, {count, lines}, WRITE);
    const lb_verdicts found = {distortion, reasons, invalid, happened, news, pair.data<double>(), steps};
    call(count * bins, [&] { return lb_repeating_process(&plan, &now, &in, &found); });
    if (rare.failure) std::rethrow_exception(rare.failure);
    return nb::make_tuple(now.largest, now.step);
}

} // namespace

void bind_repeating(nb::module_ &m)
{
    nb::class_<Plan>(m, "RepeatingPlan").def(nb::init<nb::tuple>());
    m.def("judge_periods", &judge_periods);
}
