#include "machine.h"

#include <stdint.h>

#define MOTOR_KG_M2 1.0e-3f
#define LOAD_KG_M2 1.5e-3f
#define STIFFNESS_N_M_RAD 240.0f /* resonance at 100 Hz, antiresonance at 64 Hz */
#define DAMPING_N_M_S_RAD 0.05f
#define GAIN_N_M_S_RAD 0.2f
#define NOISE_RAD_S 1.0e-3f
#define SPEED_RAD_S 30.0f
#define STEP_S (1.0f / 16000.0f)

/* About the even turning, so that float does not round the motion away. */
static float motor, load, twist;

float machine_velocity(void)
{
    static uint32_t state = 1;
    state = state * 1664525u + 1013904223u;
    return SPEED_RAD_S + motor + NOISE_RAD_S * ((float)(state >> 8) / 8388608.0f - 1.0f);
}

float machine_controller(float velocity_rad_s) { return GAIN_N_M_S_RAD * (SPEED_RAD_S - velocity_rad_s); }

void machine_step(float torque_n_m)
{
    for (int i = 0; i < 4; ++i) {
        const float spring = STIFFNESS_N_M_RAD * twist + DAMPING_N_M_S_RAD * (motor - load);
        motor += STEP_S * (torque_n_m - spring) / MOTOR_KG_M2;
        load += STEP_S * spring / LOAD_KG_M2;
        twist += STEP_S * (motor - load);
    }
}
