/* One IMU packet after another, integrated from the state that the last fix left: the twin of
 * groundstation/fusion/reckoner.py, sum for sum in the same order, so that both give the same bits.
 */
#include "core.h"

#include <math.h>

enum {
    ROW = 7,        /* columns of the history: end, span, omega, ax, ay, warmth, made up */
    BEHIND = 1,     /* the stamp is not after the last one's: nothing was done */
    WILD = 2,       /* the readings jumped away: the last good ones were taken */
    HOLE = 4,       /* packets are missing before this one: there is a row for them too */
    DISAGREE = 8,   /* the stamp is too far from the tick: it was followed */
};

typedef struct {
    double omega, ax, ay;
} Readings;

/* Laid out field by field in compiled_reckoner.py. All fields are 8 bytes wide. */
typedef struct {
    /* asked: one packet */
    int64_t t_ns;
    double dt_s;
    Readings read;
    double temperature_c;
    int64_t is_restarted; /* take the packet although its stamp lies behind */

    /* answered: the state of the centre of mass, as PlanarState; then new rows of the history, that of a hole before the packet's */
    int64_t state_t_ns;
    double state[12];
    int64_t is_lost;
    double row[ROW], hole_row[ROW];

    /* constants */
    double period_s, max_jitter_s, stamp_gain;
    double gyro_lag_s, acc_lag_s, lag_difference_s;
    double max_rate_step, max_force_step, full_rate, full_force;

    /* clock */
    int64_t origin_ns, newest_ns;
    double newest_s;
    int64_t is_begun; /* a packet has come */

    /* screen */
    int64_t has_last, has_suspect;
    Readings last, suspect;

    /* what holds since the last fix */
    int64_t has_pose;
    double rest_from_s, rest_to_s, checkpoint_s;
    double variance[13];
    double gyro_bias, gyro_tempco, gyro_gain;
    double acc_bias_x, acc_bias_y, acc_tempco_x, acc_tempco_y;
    double mxx, mxy, myx, myy;
    double gx, gy; /* slope, wave and what a map says */
    double lever_x, lever_y;

    /* now */
    double theta, vx, vy, px, py;
    double omega, force_x, force_y;
    double warmth, temperature_c_last, reference_c;
    double bg, bax, bay; /* at the present temperature */
    Readings good;       /* the newest that were integrated */
} Reckoner;

GS_EXPORT size_t gs_reckoner_size(void) { return sizeof(Reckoner); }

static int within(double limit, double value) { return -limit <= value && value <= limit; }

static int is_beyond_scale(const Reckoner *r, Readings at) {
    return !(within(r->full_rate, at.omega) && within(r->full_force, at.ax) && within(r->full_force, at.ay));
}

static int is_near(const Reckoner *r, Readings at, Readings other) {
    return within(r->max_rate_step, at.omega - other.omega) && within(r->max_force_step, at.ax - other.ax) &&
           within(r->max_force_step, at.ay - other.ay);
}

/* packet_screen.py: one packet that jumps away and back is not motion. */
static int is_wild(Reckoner *r, Readings at) {
    if (!r->has_last) {
        if (is_beyond_scale(r, at)) return 1;
        r->last = at;
        r->has_last = 1;
        return 0;
    }
    if (is_near(r, at, r->last)) {
        r->last = at;
        r->has_suspect = 0;
        return 0;
    }
    if (is_beyond_scale(r, at)) return 1;
    if (r->has_suspect && is_near(r, at, r->suspect)) {
        r->last = at;
        r->has_suspect = 0;
        return 0;
    }
    r->suspect = at;
    r->has_suspect = 1;
    return 1;
}

/* Biases at the present temperature. */
GS_EXPORT void gs_reckoner_warm(Reckoner *r) {
    r->bg = r->gyro_bias + r->gyro_tempco * r->warmth;
    r->bax = r->acc_bias_x + r->acc_tempco_x * r->warmth;
    r->bay = r->acc_bias_y + r->acc_tempco_y * r->warmth;
}

/* Write one stretch of constant readings into `row` and integrate it. */
static void advance(Reckoner *r, double *row, double t, double dt, Readings read, double hole) {
    row[0] = t;
    row[1] = dt;
    row[2] = read.omega;
    row[3] = read.ax;
    row[4] = read.ay;
    row[5] = r->warmth;
    row[6] = hole;
    if ((r->rest_from_s <= t && t <= r->rest_to_s) || !r->has_pose) return;
    const double w = (read.omega - r->bg) * r->gyro_gain;
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
    r->omega = w;
}

/* The state of the centre of mass now: sensor lag undone, lever arm taken off. */
GS_EXPORT void gs_reckoner_report(Reckoner *r) {
    const double off = (double)(r->newest_ns - r->origin_ns) * 1e-9 - r->newest_s;
    const double w = r->omega, lag = r->acc_lag_s + off, vx = r->vx, vy = r->vy, gx = r->gx, gy = r->gy;
    const double theta = r->theta + (r->gyro_lag_s + off) * w;
    const double c = cos(theta), s = sin(theta);
    const double lever_x = c * r->lever_x - s * r->lever_y;
    const double lever_y = s * r->lever_x + c * r->lever_y;
    const double tau = r->newest_s - r->checkpoint_s;
    const double *x = r->variance, *y = x + 5, *h = x + 10;
    double *state = r->state;
    r->state_t_ns = r->newest_ns;
    state[0] = r->px + lag * vx - lever_x;
    state[1] = r->py + lag * vy - lever_y;
    state[2] = theta;
    state[3] = vx + lag * r->force_x + w * lever_y;
    state[4] = vy + lag * r->force_y - w * lever_x;
    state[5] = w;
    state[6] = r->bg;
    state[7] = r->bax - c * gx - s * gy;
    state[8] = r->bay + s * gx - c * gy;
    state[9] = sqrt(x[0] + tau * (x[1] + tau * (x[2] + tau * (x[3] + tau * x[4]))));
    state[10] = sqrt(y[0] + tau * (y[1] + tau * (y[2] + tau * (y[3] + tau * y[4]))));
    state[11] = sqrt(h[0] + tau * (h[1] + tau * h[2]));
}

/* Take one packet and report; return what happened, see the flags above. */
GS_EXPORT int gs_reckoner_add(Reckoner *r) {
    const int64_t t_ns = r->t_ns;
    const double period = r->period_s;
    double dt = r->dt_s;
    int flags = 0;
    if (t_ns <= r->newest_ns && !r->is_restarted) return BEHIND;
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
    const double temperature_c = r->temperature_c;
    if (temperature_c != r->temperature_c_last && temperature_c - temperature_c == 0.0) {
        r->temperature_c_last = temperature_c;
        if (isnan(r->reference_c)) r->reference_c = temperature_c;
        r->warmth = temperature_c - r->reference_c;
        gs_reckoner_warm(r);
    }
    Readings read = r->read;
    double hole = 0.0;
    if (is_wild(r, read)) {
        flags |= WILD;
        read = r->good;
        hole = 1.0;
    }
    if (dt > 1.5 * period) {
        flags |= HOLE;
        const double gap = dt - period;
        dt = period;
        const Readings between = {0.5 * (read.omega + r->good.omega), 0.5 * (read.ax + r->good.ax),
                                  0.5 * (read.ay + r->good.ay)};
        advance(r, r->hole_row, t - dt, gap, between, 1.0);
    }
    r->good = read;
    advance(r, r->row, t, dt, read, hole);
    if (r->has_pose) gs_reckoner_report(r);
    return flags;
}
