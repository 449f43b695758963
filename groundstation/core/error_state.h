/* The filter's states and their order: groundstation/fusion/error_state.py. Behind them stand two slopes per node of
 * the learned surface (learned_surface.py). */
#ifndef GROUNDSTATION_ERROR_STATE_H
#define GROUNDSTATION_ERROR_STATE_H

enum { THETA, VX, VY, PX, PY, GYRO_BIAS, ACC_BIAS_X, ACC_BIAS_Y, SLOPE_X, SLOPE_Y, GYRO_SCALE, LEVER_X, LEVER_Y };
enum { WAVE_X = 13, WAVE_Y, MXX, MXY, MYX, MYY, GYRO_TEMPCO, ACC_TEMPCO_X, ACC_TEMPCO_Y, FIX_DELAY, SIZE };
enum { MOVING = 5 };

#endif
