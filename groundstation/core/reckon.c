/* One IMU packet after another, integrated from the state that the last fix left: tests/oracles/reckoner.py
 * does it sum for sum in the same order, so that both give the same bits.
 */
#include "core.h"

#include <math.h>

static int within(double limit, double value) { return -limit <= value && value <= limit; }

static int is_beyond_scale(const Reckoner *r, Readings at) {
    return !(within(r->full_rate, at.rate) && within(r->full_force, at.ax) && within(r->full_force, at.ay));
}

/* A vehicle that nobody listened to has had time to turn faster; its forces are what the valves can do, as ever. */
enum { TURNS_FASTER_AFTER = 10 }; /* packets */

static int is_near(const Reckoner *r, Readings at, Readings other, double packets) {
    const double rate_step = r->max_rate_step * fmax(1.0, packets / TURNS_FASTER_AFTER);
    return within(rate_step, at.rate - other.rate) && within(r->max_force_step, at.ax - other.ax) &&
           within(r->max_force_step, at.ay - other.ay);
}

/* tests/oracles/packet_screen.py: one packet that jumps away and back is not motion. */
static int is_wild(Reckoner *r, Readings at, double packets) {
    if (!r->has_last) {
        if (is_beyond_scale(r, at)) return 1;
        r->last = at;
        r->has_last = 1;
        return 0;
    }
    if (is_near(r, at, r->last, packets)) {
        r->last = at;
        r->has_suspect = 0;
        return 0;
    }
    if (is_beyond_scale(r, at)) return 1;
    if (r->has_suspect && is_near(r, at, r->suspect, 1.0)) {
        r->last = at;
        r->has_suspect = 0;
        return 0;
    }
    r->suspect = at;
    r->has_suspect = 1;
    return 1;
}

/* Heat goes slowly through a block: what its thermometer says beyond this is its thermometer. */
static int is_heat(const Reckoner *r, double temperature_c, double t) {
    const double coldest_c = -60.0, hottest_c = 150.0, step_c = 3.0, fastest_c_s = 1.0;
    if (!(coldest_c <= temperature_c && temperature_c <= hottest_c)) return 0;
    return isnan(r->temperature_c) ||
           within(step_c + fastest_c_s * (t - r->warmed_s), temperature_c - r->temperature_c);
}

void gs_reckoner_warm(Reckoner *r) {
    r->bg = r->gyro_bias + r->gyro_tempco * r->warmth;
    r->bax = r->acc_bias_x + r->acc_tempco_x * r->warmth;
    r->bay = r->acc_bias_y + r->acc_tempco_y * r->warmth;
}

/* Write one stretch of constant readings into `row` and integrate it. */
static void advance(Reckoner *r, Packet *row, double t, double dt, Readings read, double hole) {
    *row = (Packet){t, dt, read.rate, read.ax, read.ay, r->warmth, hole};
    if ((r->rest_from_s <= t && t <= r->rest_to_s) || !r->has_pose) return;
    const double w = (read.rate - r->bg) * r->gyro_gain;
    const double ux = read.ax - r->bax, uy = read.ay - r->bay;
    const double fx = r->mxx * ux - r->mxy * uy;
    const double fy = r->myy * uy - r->myx * ux;
    const double turn = w * dt;
    const double theta = r->theta + 0.5 * turn + r->lag_difference_s * w;
    const double c = cos(theta), s = sin(theta);
    const double ax = c * fx - s * fy + r->gx;
    const double ay = s * fx + c * fy + r->gy;
    const double vx = r->vx, vy = r->vy;
    r->force_x = ax;
    r->force_y = ay;
    r->px += (vx + 0.5 * ax * dt) * dt;
    r->py += (vy + 0.5 * ay * dt) * dt;
    r->vx = vx + ax * dt;
    r->vy = vy + ay * dt;
    r->theta += turn;
    r->rate = w;
}

void gs_reckoner_report(Reckoner *r) {
    const double off = (double)(r->newest_ns - r->origin_ns) * 1e-9 - r->newest_s;
    const double w = r->rate, lag = r->acc_lag_s + off, vx = r->vx, vy = r->vy, gx = r->gx, gy = r->gy;
    const double theta = r->theta + (r->gyro_lag_s + off) * w;
    const double c = cos(theta), s = sin(theta);
    const double lever_x = c * r->lever_x - s * r->lever_y;
    const double lever_y = s * r->lever_x + c * r->lever_y;
    const double tau = r->newest_s - r->checkpoint_s;
    const double *x = r->variance, *y = x + 5, *h = x + 10;
    PlanarState *state = &r->state;
    state->t_ns = r->newest_ns;
    state->x_m = r->px + lag * vx - lever_x;
    state->y_m = r->py + lag * vy - lever_y;
    state->heading_rad = theta;
    state->vx_m_s = vx + lag * r->force_x + w * lever_y;
    state->vy_m_s = vy + lag * r->force_y - w * lever_x;
    state->rate_rad_s = w;
    state->bias_rate_rad_s = r->bg;
    state->bias_ax_m_s2 = r->bax - c * gx - s * gy;
    state->bias_ay_m_s2 = r->bay + s * gx - c * gy;
    state->sigma_x_m = sqrt(x[0] + tau * (x[1] + tau * (x[2] + tau * (x[3] + tau * x[4]))));
    state->sigma_y_m = sqrt(y[0] + tau * (y[1] + tau * (y[2] + tau * (y[3] + tau * y[4]))));
    state->sigma_heading_rad = sqrt(h[0] + tau * (h[1] + tau * h[2]));
}

int gs_reckoner_add(Reckoner *r) {
    const ImuPacket asked = r->asked;
    const int64_t t_ns = asked.t_ns;
    const double period = r->period_s;
    double dt = asked.dt_s;
    int flags = 0;
    if (t_ns <= r->newest_ns && !r->is_restarted) return BEHIND;
    if (r->is_begun && !r->is_restarted &&
        (double)(t_ns - r->origin_ns) * 1e-9 - (r->newest_s + dt) > r->max_ahead_s)
        return AHEAD;
    r->is_restarted = 0;
    if (!r->is_begun) { /* whatever came before the first packet is not a hole in the packets */
        dt = period;
        r->newest_s = (double)(t_ns - r->origin_ns) * 1e-9 - dt;
        r->is_begun = 1;
    }
    double t = r->newest_s + dt;
    const double off = (double)(t_ns - r->origin_ns) * 1e-9 - t;
    if (-r->max_jitter_s < off && off < r->max_jitter_s) {
        t += r->stamp_gain * off;
    } else {
        flags |= DISAGREE;
        t += off;
        dt = t - r->newest_s;
    }
    r->newest_ns = t_ns;
    r->newest_s = t;
    const double temperature_c = asked.temperature_c;
    if (temperature_c == r->temperature_c) {
        r->warmed_s = t;
    } else if (is_heat(r, temperature_c, t)) {
        r->temperature_c = temperature_c;
        r->warmed_s = t;
        if (isnan(r->reference_c)) r->reference_c = temperature_c;
        r->warmth = temperature_c - r->reference_c;
        gs_reckoner_warm(r);
    } else if (!isnan(temperature_c)) {
        flags |= HEAT;
    }
    Readings read = {asked.rate_rad_s, asked.ax_m_s2, asked.ay_m_s2};
    double hole = 0.0;
    if (is_wild(r, read, dt / period)) {
        flags |= WILD;
        read = r->good;
        hole = 1.0;
    }
    if (dt > 1.5 * period) {
        flags |= HOLE;
        const double gap = dt - period;
        dt = period;
        const Readings between = {0.5 * (read.rate + r->good.rate), 0.5 * (read.ax + r->good.ax),
                                  0.5 * (read.ay + r->good.ay)};
        advance(r, &r->hole_row, t - dt, gap, between, 1.0);
    }
    r->good = read;
    advance(r, &r->row, t, dt, read, hole);
    if (r->has_pose) gs_reckoner_report(r);
    return flags;
}
