"""The C of the simulated axis under the sanitizers: every branch at once, and the end of a run."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

SOURCE = Path(__file__).parents[2] / "simulation"
DRIVER = r"""
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "axis.h"
int main(void) {
    enum { TICKS = 2000 };
    for (int states = 4; states <= 6; states += 2) {
        lb_axis_config c = {
            .states = states, .motor_inertia_kg_m2 = 0.0028, .pulley_inertia_kg_m2 = 1.8e-4, .radius_m = 0.019,
            .specific_stiffness_n = 3.25e5, .pulley_distance_m = 2.14, .damping_shape = 105, .spots = 1,
            .motor_coulomb_n_m = 0.1, .eccentricity = 0.01, .load_coulomb_n = 15, .load_stribeck_n = 5,
            .stribeck_speed_m_per_s = 0.05, .smoothing_m_per_s = 0.01,
            .torque_ripple_n_m = 0.1, .torque_ripple_per_turn = 24, .rate_hz = 4000,
            .substeps = 4, .halvings = 2, .velocity_ticks = 1, .position_ticks = 2, .delay_ticks = LB_AXIS_DELAY_MAX,
            .velocity_gain_n_m_s = 0.01, .integral_step = 1e-3, .position_gain_per_s = 0.1, .torque_n_m_max = 5,
            .encoder_step_rad = 1e-4, .position_m_min = 0.15, .position_m_max = 1.85};
        c.spot[0] = (lb_axis_spot){0.9, 0.1, 0.2};
        double *input = calloc(LB_AXIS_INPUTS * TICKS, sizeof *input);
        double *output = malloc((size_t)(LB_AXIS_SIGNALS + states) * TICKS * sizeof *output);
        for (int n = 0; n < TICKS; ++n) {
            input[LB_AXIS_EXCITATION * TICKS + n] = sin(0.1 * n);
            input[LB_AXIS_POSITION_REFERENCE * TICKS + n] = 0.8 / 0.019;
            input[LB_AXIS_STIFFNESS * TICKS + n] = input[LB_AXIS_DAMPING * TICKS + n] = 1;
            input[LB_AXIS_FRICTION * TICKS + n] = 1;
            input[LB_AXIS_LOAD * TICKS + n] = n < 1500 ? 6.7 : NAN;
            input[LB_AXIS_GAP * TICKS + n] = 1e-4;
        }
        lb_axis_state state;
        lb_axis_rest(&c, 0.8, &state);
        const size_t done = lb_axis_advance(&c, &state, TICKS, input, output);
        printf("%d %d\n", (int)done, isnan(state.plant[states - 1]));
        free(input);
        free(output);
    }
    return 0;
}
"""


def test_sanitizers_find_nothing_and_a_nan_stops_at_its_tick(tmp_path: Path) -> None:
    gcc = shutil.which("gcc")
    if gcc is None:
        pytest.skip("gcc is not installed")
    (tmp_path / "driver.c").write_text(DRIVER)
    flags = ["-std=c99", "-O1", "-g", "-fsanitize=address,undefined", "-fno-sanitize-recover=all", f"-I{SOURCE}"]
    program = tmp_path / "driver"
    subprocess.run(
        [gcc, *flags, str(tmp_path / "driver.c"), str(SOURCE / "axis.c"), "-o", str(program), "-lm"], check=True
    )
    done = subprocess.run([str(program)], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split("\n")[:2] == ["1501 1", "1501 1"]
