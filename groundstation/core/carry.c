/* A stretch of stored packets as a whole: motion, error transition and process noise in one pass each; the formulas are
 * explained in tests/oracles/flight.py.
 */
#include "core.h"

#include <math.h>
#include <string.h>

enum { NEIGHBOURS = 25 };

/* First row whose end is beyond (or at) a moment. */
static int64_t row_after(const Packet *p, int64_t count, double t, int or_at) {
    int64_t low = 0, high = count;
    while (low < high) {
        const int64_t middle = (low + high) / 2;
        if (p[middle].end_s < t || (!or_at && p[middle].end_s == t)) low = middle + 1;
        else high = middle;
    }
    return low;
}

/* Find the packets of the stretch; 0 if there is none. */
static int find(Stretch *s) {
    s->first = row_after(s->history, s->count, s->start_s + 1e-9, 0);
    s->last = row_after(s->history, s->count, s->stop_s - 1e-9, 1);
    if (s->last > s->count - 1) s->last = s->count - 1;
    return s->last >= s->first;
}

/* Span of a packet, the outer two cut to the stretch. */
static double span_of(const Stretch *s, int64_t i) {
    const Packet *p = &s->history[i];
    double span = p->span_s;
    if (i == s->first) span = fmin(span, p->end_s - s->start_s);
    if (i == s->last && p->end_s > s->stop_s) span -= p->end_s - s->stop_s;
    return span;
}

typedef struct {
    double fx, fy;
} Force;

/* Specific force in body axes, corrected. */
static Force force_of(const double *x, const Packet *p) {
    const double ux = p->ax - x[ACC_BIAS_X] - x[ACC_TEMPCO_X] * p->warmth;
    const double uy = p->ay - x[ACC_BIAS_Y] - x[ACC_TEMPCO_Y] * p->warmth;
    const Force f = {(1.0 - x[MXX]) * ux - x[MXY] * uy, (1.0 - x[MYY]) * uy - x[MYX] * ux};
    return f;
}

static double rate_of(const double *x, const Packet *p) {
    return (p->rate - x[GYRO_BIAS] - x[GYRO_TEMPCO] * p->warmth) * (1.0 - x[GYRO_SCALE]);
}

/* slope_grid.py, along: bilinear; the mean outside. */
static Force pull_at(const Grid *g, double x_m, double y_m) {
    const double u = (x_m - g->x0_m) / g->step_m, v = (y_m - g->y0_m) / g->step_m;
    if (!(u >= 0.0 && u <= (double)(g->columns - 1) && v >= 0.0 && v <= (double)(g->rows - 1))) {
        const Force mean = {g->mean_x, g->mean_y};
        return mean;
    }
    int64_t i = (int64_t)u, j = (int64_t)v;
    if (i > g->columns - 2) i = g->columns - 2;
    if (j > g->rows - 2) j = g->rows - 2;
    const double a = u - (double)i, b = v - (double)j;
    const int64_t low = j * g->columns + i, high = low + g->columns;
    const Force pull = {
        (1.0 - b) * ((1.0 - a) * g->x[low] + a * g->x[low + 1]) +
            b * ((1.0 - a) * g->x[high] + a * g->x[high + 1]),
        (1.0 - b) * ((1.0 - a) * g->y[low] + a * g->y[low + 1]) +
            b * ((1.0 - a) * g->y[high] + a * g->y[high + 1]),
    };
    return pull;
}

/* Sums over the packets, weighted with their span (0) and their span times the time left behind them (1). */
typedef struct {
    double a[2][2], since_a[2][2], turned_a[2][2], warm_since_a[2][2]; /* [weight][axis] */
    double c[2], s[2], c_fx[2], s_fx[2], c_fy[2], s_fy[2], warm_c[2], warm_s[2];
    double warm;
} Sums;

static void fill_transition(Stretch *s, const Sums *g, double turned_by_scale);
static void fill_noise(Stretch *s, int holes);

/* Integrate the stretch from s->x; and on request also what its covariance needs. Returns the number of packets. */
static int64_t fly(Stretch *s, int wants_covariance) {
    if (!find(s)) return 0;
    const double *x = s->x;
    double T = 0.0;
    for (int64_t i = s->first; i <= s->last; i++) T += span_of(s, i);
    Sums g;
    memset(&g, 0, sizeof g);
    double after = 0.0, elapsed = 0.0, turned = 0.0;
    double push[2] = {0.0, 0.0}, carried[2] = {0.0, 0.0};
    int holes = 0;
    for (int64_t i = s->first; i <= s->last; i++) {
        const Packet *p = &s->history[i];
        const double dt = span_of(s, i), w = rate_of(x, p), step = w * dt;
        after += step;
        elapsed += dt;
        turned = after - 0.5 * step;
        const double theta = turned + (x[THETA] + s->lag_difference_s * w);
        const double c = cos(theta), sn = sin(theta);
        const Force f = force_of(x, p);
        const double a[2] = {c * f.fx - sn * f.fy, sn * f.fx + c * f.fy};
        const double left = T - elapsed + 0.5 * dt;
        double pulled[2] = {a[0], a[1]};
        if (s->map) {
            const double began = elapsed - 0.5 * dt;
            const Force known = pull_at(s->map, x[PX] + x[VX] * began, x[PY] + x[VY] * began);
            pulled[0] += known.fx;
            pulled[1] += known.fy;
        }
        for (int k = 0; k < 2; k++) {
            push[k] += pulled[k] * dt;
            carried[k] += pulled[k] * dt * left;
        }
        if (!wants_covariance) continue;
        holes += p->is_hole != 0.0;
        const double warm = p->warmth * dt, weights[2] = {dt, dt * left};
        const double since = T - left, warm_since = g.warm + 0.5 * warm;
        g.warm += warm;
        for (int k = 0; k < 2; k++) {
            const double weight = weights[k];
            for (int axis = 0; axis < 2; axis++) {
                const double weighted = weight * a[axis];
                g.a[k][axis] += weighted;
                g.since_a[k][axis] += since * weighted;
                g.turned_a[k][axis] += turned * weighted;
                g.warm_since_a[k][axis] += warm_since * weighted;
            }
            g.c[k] += weight * c;
            g.s[k] += weight * sn;
            g.c_fx[k] += weight * c * f.fx;
            g.s_fx[k] += weight * sn * f.fx;
            g.c_fy[k] += weight * c * f.fy;
            g.s_fy[k] += weight * sn * f.fy;
            g.warm_c[k] += weight * p->warmth * c;
            g.warm_s[k] += weight * p->warmth * sn;
        }
    }
    const double gx = x[SLOPE_X] + x[WAVE_X], gy = x[SLOPE_Y] + x[WAVE_Y], half = 0.5 * T * T;
    s->moved[THETA] = x[THETA] + after;
    s->moved[VX] = x[VX] + push[0] + gx * T;
    s->moved[VY] = x[VY] + push[1] + gy * T;
    s->moved[PX] = x[PX] + x[VX] * T + carried[0] + gx * half;
    s->moved[PY] = x[PY] + x[VY] * T + carried[1] + gy * half;
    s->duration_s = T;
    s->turned_rad = turned;
    if (wants_covariance) {
        fill_transition(s, &g, after - s->lag_difference_s * rate_of(x, &s->history[s->first]));
        fill_noise(s, holes);
    }
    return s->last - s->first + 1;
}

int64_t gs_stretch_fly(Stretch *s) { return fly(s, 0); }

int64_t gs_stretch_carry(Stretch *s) { return fly(s, 1); }

static void fill_transition(Stretch *s, const Sums *g, double turned_by_scale) {
    const double T = s->duration_s;
    memset(s->F, 0, sizeof s->F);
    double *heading = s->F + THETA * SIZE;
    for (int i = 0; i < MOVING; i++) s->F[i * SIZE + i] = 1.0;
    s->F[PX * SIZE + VX] = s->F[PY * SIZE + VY] = T;
    heading[GYRO_BIAS] = -T;
    heading[GYRO_SCALE] = -turned_by_scale;
    heading[GYRO_TEMPCO] = -g->warm;
    for (int k = 0; k < 2; k++) {
        double *x = s->F + (k ? PX : VX) * SIZE, *y = x + SIZE;
        x[THETA] = -g->a[k][1], y[THETA] = g->a[k][0];
        x[GYRO_BIAS] = g->since_a[k][1], y[GYRO_BIAS] = -g->since_a[k][0];
        x[GYRO_SCALE] = g->turned_a[k][1], y[GYRO_SCALE] = -g->turned_a[k][0];
        x[GYRO_TEMPCO] = g->warm_since_a[k][1], y[GYRO_TEMPCO] = -g->warm_since_a[k][0];
        x[ACC_BIAS_X] = -g->c[k], y[ACC_BIAS_X] = -g->s[k];
        x[ACC_BIAS_Y] = g->s[k], y[ACC_BIAS_Y] = -g->c[k];
        x[ACC_TEMPCO_X] = -g->warm_c[k], y[ACC_TEMPCO_X] = -g->warm_s[k];
        x[ACC_TEMPCO_Y] = g->warm_s[k], y[ACC_TEMPCO_Y] = -g->warm_c[k];
        x[MXX] = -g->c_fx[k], y[MXX] = -g->s_fx[k];
        x[MXY] = -g->c_fy[k], y[MXY] = -g->s_fy[k];
        x[MYX] = g->s_fx[k], y[MYX] = -g->c_fx[k];
        x[MYY] = g->s_fy[k], y[MYY] = -g->c_fy[k];
        const double span = k ? 0.5 * T * T : T;
        x[SLOPE_X] = y[SLOPE_Y] = x[WAVE_X] = y[WAVE_Y] = span;
    }
}

/* What a packet that was not measured adds: a force and a rate as large as those around it. */
static void add_hole(Stretch *s, int64_t hole, double left, double *vv, double *vp, double *pp) {
    int64_t from = hole - NEIGHBOURS, to = hole + NEIGHBOURS - 1;
    if (from < s->first) from = s->first;
    if (to > s->last) to = s->last;
    const double n = (double)(to - from + 1);
    double mean[3] = {0.0, 0.0, 0.0}, spread[3] = {0.0, 0.0, 0.0};
    for (int pass = 0; pass < 2; pass++) {
        for (int64_t i = from; i <= to; i++) {
            const Packet *p = &s->history[i];
            const Force f = force_of(s->x, p);
            const double value[3] = {f.fx, f.fy, p->rate};
            for (int k = 0; k < 3; k++) {
                if (pass == 0) mean[k] += value[k] / n;
                else spread[k] += (value[k] - mean[k]) * (value[k] - mean[k]) / n;
            }
        }
    }
    const double span = span_of(s, hole), knocked = fmax(spread[0], spread[1]) * span * span;
    *vv += knocked;
    *vp += knocked * left;
    *pp += knocked * left * left;
    s->Q[THETA * MOVING + THETA] += spread[2] * span * span;
}

/* valve_knocks.py: one knock wherever the mean force of a group of packets differs abruptly from the last group's. */
static void add_knocks(const Stretch *s, double *vv, double *vp, double *pp) {
    const double knock = s->knock_m_s * s->knock_m_s, group = (double)s->knock_group;
    double elapsed = 0.0, left = 0.0;
    Force sum = {0.0, 0.0}, before = {0.0, 0.0};
    for (int64_t i = s->first; i <= s->last; i++) {
        const int64_t place = (i - s->first) % s->knock_group;
        const double dt = span_of(s, i);
        const Force f = force_of(s->x, &s->history[i]);
        elapsed += dt;
        if (place == 0) {
            left = s->duration_s - elapsed + 0.5 * dt;
            sum = f;
        } else {
            sum.fx += f.fx;
            sum.fy += f.fy;
        }
        if (place != s->knock_group - 1) continue;
        const Force mean = {sum.fx / group, sum.fy / group};
        if (i - s->first >= s->knock_group && (fabs(mean.fx - before.fx) > s->knock_step_m_s2 ||
                                               fabs(mean.fy - before.fy) > s->knock_step_m_s2)) {
            *vv += knock;
            *vp += knock * left;
            *pp += knock * left * left;
        }
        before = mean;
    }
}

static void fill_noise(Stretch *s, int holes) {
    const double T = s->duration_s, qa = s->acc_density * s->acc_density;
    double vv = qa * T, vp = qa * T * T / 2.0, pp = qa * (T * T * T) / 3.0;
    double *Q = s->Q;
    memset(Q, 0, sizeof s->Q);
    Q[THETA * MOVING + THETA] = s->gyro_density * s->gyro_density * T;
    double elapsed = 0.0;
    for (int64_t i = s->first; holes && i <= s->last; i++) {
        const double dt = span_of(s, i);
        elapsed += dt;
        if (s->history[i].is_hole != 0.0) add_hole(s, i, T - elapsed + 0.5 * dt, &vv, &vp, &pp);
    }
    add_knocks(s, &vv, &vp, &pp);
    Q[VX * MOVING + VX] = Q[VY * MOVING + VY] = vv;
    Q[VX * MOVING + PX] = Q[PX * MOVING + VX] = Q[VY * MOVING + PY] = Q[PY * MOVING + VY] = vp;
    Q[PX * MOVING + PX] = Q[PY * MOVING + PY] = pp;
}
