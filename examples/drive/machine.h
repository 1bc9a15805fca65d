/* A machine to try the drive on: two masses on a spring, turning at a speed that a controller holds. */
#ifndef MACHINE_H
#define MACHINE_H

/* What the encoder says now, rad/s, with its noise. */
float machine_velocity(void);

/* The torque that the speed controller asks for. */
float machine_controller(float velocity_rad_s);

/* 1/4000 s under this torque. */
void machine_step(float torque_n_m);

#endif
