// The simulated axis as a Python class: settings as a dict of numbers, chunks of ticks as arrays.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

#include "../kernel/native_claim.h"

extern "C" {
#include "axis.h"
#include "late.h"
#include "two_masses.h"
}

namespace nb = nanobind;

namespace {

using Rows = nb::ndarray<const double, nb::shape<LB_AXIS_INPUTS, -1>, nb::c_contig, nb::device::cpu>;
using Out = nb::ndarray<double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;
using Column = std::array<double, LB_AXIS_INPUTS>;

double number(const nb::dict &settings, const char *name) { return nb::cast<double>(settings[name]); }
int whole(const nb::dict &settings, const char *name) { return nb::cast<int>(settings[name]); }

lb_axis_config config_of(const nb::dict &s)
{
    lb_axis_config c{};
    c.states = whole(s, "states");
    c.motor_inertia_kg_m2 = number(s, "motor_inertia_kg_m2");
    c.pulley_inertia_kg_m2 = number(s, "pulley_inertia_kg_m2");
    c.radius_m = number(s, "radius_m");
    c.eccentricity = number(s, "eccentricity");
    c.specific_stiffness_n = number(s, "specific_stiffness_n");
    c.pulley_distance_m = number(s, "pulley_distance_m");
    c.damping_shape = number(s, "damping_shape");
    c.frozen = whole(s, "frozen");
    c.frozen_position_m = number(s, "frozen_position_m");
    for (nb::handle spot : nb::cast<nb::list>(s["spots"])) {
        if (c.spots == LB_AXIS_SPOTS_MAX) throw nb::value_error("too many soft spots");
        c.spot[c.spots++] = {nb::cast<double>(spot[0]), nb::cast<double>(spot[1]), nb::cast<double>(spot[2])};
    }
    c.motor_coulomb_n_m = number(s, "motor_coulomb_n_m");
    c.motor_viscous_n_m_s = number(s, "motor_viscous_n_m_s");
    c.motor_stribeck_n_m = number(s, "motor_stribeck_n_m");
    c.load_coulomb_n = number(s, "load_coulomb_n");
    c.load_viscous_n_s_per_m = number(s, "load_viscous_n_s_per_m");
    c.load_stribeck_n = number(s, "load_stribeck_n");
    c.stribeck_speed_m_per_s = number(s, "stribeck_speed_m_per_s");
    c.smoothing_m_per_s = number(s, "smoothing_m_per_s");
    c.torque_ripple_n_m = number(s, "torque_ripple_n_m");
    c.torque_ripple_per_turn = number(s, "torque_ripple_per_turn");
    c.rate_hz = number(s, "rate_hz");
    c.substeps = whole(s, "substeps");
    c.halvings = whole(s, "halvings");
    c.velocity_ticks = whole(s, "velocity_ticks");
    c.position_ticks = whole(s, "position_ticks");
    c.delay_ticks = whole(s, "delay_ticks");
    c.velocity_gain_n_m_s = number(s, "velocity_gain_n_m_s");
    c.integral_step = number(s, "integral_step");
    c.position_gain_per_s = number(s, "position_gain_per_s");
    c.velocity_feedforward = number(s, "velocity_feedforward");
    c.torque_n_m_max = number(s, "torque_n_m_max");
    c.encoder_step_rad = number(s, "encoder_step_rad");
    c.encoder_eccentricity_rad = number(s, "encoder_eccentricity_rad");
    c.velocity_differenced = whole(s, "velocity_differenced");
    c.position_m_min = number(s, "position_m_min");
    c.position_m_max = number(s, "position_m_max");
    const bool usable = (c.states == 4 || c.states == 6) && c.substeps >= 1 && c.halvings >= 0 &&
                        c.velocity_ticks >= 1 && c.position_ticks >= 1 && c.delay_ticks >= 0 &&
                        c.delay_ticks <= LB_AXIS_DELAY_MAX;
    if (!usable) throw nb::value_error("states, steps, ticks or delay outside what the simulation takes");
    return c;
}

class Engine {
  public:
    Engine(const nb::dict &settings, double position_m) : config_(config_of(settings))
    {
        lb_axis_rest(&config_, position_m, &state_);
    }

    size_t advance(const Rows &input, const Out &output)
    {
        const size_t ticks = input.shape(1);
        const auto rows = static_cast<size_t>(LB_AXIS_SIGNALS + config_.states);
        if (output.shape(0) != rows || output.shape(1) != ticks)
            throw nb::value_error("the output needs 3 rows and one for each state, as long as the input");
        const native::Claim mine(used_, refusal);
        nb::gil_scoped_release release;
        return lb_axis_advance(&config_, &state_, ticks, input.data(), output.data());
    }

    std::vector<double> plant()
    {
        const native::Claim mine(used_, refusal);
        return {state_.plant, state_.plant + config_.states};
    }

    std::vector<double> derivative(const std::vector<double> &now, double torque, const std::vector<double> &state)
    {
        if (now.size() != LB_AXIS_INPUTS || state.size() != static_cast<size_t>(config_.states))
            throw nb::value_error("wrong number of inputs or states");
        std::vector<double> slope(state.size());
        lb_axis_derivative(&config_, now.data(), torque, state.data(), slope.data());
        return slope;
    }

  private:
    static constexpr const char *refusal = "another thread advances this simulated axis; give each thread its own";

    native::Flag used_;
    lb_axis_config config_;
    lb_axis_state state_{};
};

using Line = nb::ndarray<const double, nb::ndim<1>, nb::c_contig, nb::device::cpu>;
using Table = nb::ndarray<const double, nb::ndim<2>, nb::c_contig, nb::device::cpu>;

void two_masses(double rate_hz, double radius_m, const Table &pairs, const Line &stiffness, const Line &damping,
                const Table &torque, const Out &motor, const Out &cart)
{
    const size_t ticks = stiffness.shape(0), count = pairs.shape(0), torques = torque.shape(0);
    const bool usable = pairs.shape(1) == 4 && damping.shape(0) == ticks && torque.shape(1) == ticks &&
                        (torques == 1 || torques == count) && motor.shape(0) == count && motor.shape(1) == ticks &&
                        (cart.shape(0) == count || cart.shape(0) == 0) && cart.shape(1) == ticks;
    if (!usable) throw nb::value_error("shapes of pairs, stiffness, damping, torque and outputs disagree");
    const lb_two_masses_course course{ticks, rate_hz, radius_m, stiffness.data(), damping.data()};
    std::vector<lb_two_masses> pair(count);
    for (size_t i = 0; i < count; ++i) {
        const double *of = pairs.data() + 4 * i;
        pair[i] = {of[0], of[1], of[2], of[3]};
    }
    nb::gil_scoped_release release;
    lb_two_masses_advance(&course, count, pair.data(), torque.data(), torques == 1 ? 0 : ticks, motor.data(),
                          cart.shape(0) ? cart.data() : nullptr);
}

void late(const Table &rows, double samples, const Out &out)
{
    const size_t count = rows.shape(0), ticks = rows.shape(1);
    if (out.shape(0) != count || out.shape(1) != ticks || ticks == 0)
        throw nb::value_error("rows and output need the same shape, with a sample or more");
    nb::gil_scoped_release release;
    std::vector<double> work((ticks + 2 * LB_LATE_PAD) * LB_LATE_LANES);
    lb_late(count, ticks, samples, rows.data(), out.data(), work.data());
}

} // namespace

NB_MODULE(_axis, m)
{
    nb::class_<Engine>(m, "Engine")
        .def(nb::init<const nb::dict &, double>(), nb::arg("settings"), nb::arg("position_m"))
        .def_prop_ro("plant", &Engine::plant)
        .def("advance", &Engine::advance, nb::arg("input"), nb::arg("output"))
        .def("derivative", &Engine::derivative, nb::arg("now"), nb::arg("torque_n_m"), nb::arg("state"));
    m.def("two_masses", &two_masses, nb::arg("rate_hz"), nb::arg("radius_m"), nb::arg("pairs"), nb::arg("stiffness"),
          nb::arg("damping"), nb::arg("torque"), nb::arg("motor"), nb::arg("cart"));
    m.def("late", &late, nb::arg("rows"), nb::arg("samples"), nb::arg("out"));
}
