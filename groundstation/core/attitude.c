/* How bodies turn between frames; in NumPy: tests/oracles/attitude_motion.py. */
#include "core.h"
#include "rotation.h"

#include <math.h>
#include <string.h>

/* What turns a body: its inertia or NULL, and the rate of the orbit whose gravity it feels, 0 for none. */
typedef struct {
    const double *inertia;
    double n;
} Body;

/* Rate, and the orbit's upward axis and normal in the body. */
typedef struct {
    double w[3], e[3], z[3];
} Turning;

static void acceleration(const Body *body, const double w[3], const double e[3], double out[3])
{
    const double *J = body->inertia;
    const double spin[3] = {J[0] * w[0], J[1] * w[1], J[2] * w[2]};
    cross3(spin, w, out);
    if (body->n != 0.0) {
        const double drawn[3] = {J[0] * e[0], J[1] * e[1], J[2] * e[2]};
        double pull[3];
        cross3(e, drawn, pull);
        for (int k = 0; k < 3; k++) out[k] += 3.0 * body->n * body->n * pull[k];
    }
    for (int k = 0; k < 3; k++) out[k] /= J[k];
}

static Turning slopes(const Body *body, const Turning *at)
{
    Turning found = {{0.0}, {0.0}, {0.0}};
    acceleration(body, at->w, at->e, found.w);
    if (body->n != 0.0) {
        double by_orbit[3], by_body[3];
        cross3(at->z, at->e, by_orbit);
        cross3(at->w, at->e, by_body);
        for (int k = 0; k < 3; k++) found.e[k] = body->n * by_orbit[k] - by_body[k];
        cross3(at->w, at->z, by_body);
        for (int k = 0; k < 3; k++) found.z[k] = -by_body[k];
    }
    return found;
}

static Turning stepped(const Turning *at, const Turning *slope, double h)
{
    Turning found;
    for (int k = 0; k < 3; k++) {
        found.w[k] = at->w[k] + h * slope->w[k];
        found.e[k] = at->e[k] + h * slope->e[k];
        found.z[k] = at->z[k] + h * slope->z[k];
    }
    return found;
}

/* A step of Runge and Kutta. */
static Turning after(const Body *body, const Turning *at, const Turning *k1, double h)
{
    const Turning half = stepped(at, k1, 0.5 * h), k2 = slopes(body, &half);
    const Turning again = stepped(at, &k2, 0.5 * h), k3 = slopes(body, &again);
    const Turning whole = stepped(at, &k3, h), k4 = slopes(body, &whole);
    Turning mean;
    for (int k = 0; k < 3; k++) {
        mean.w[k] = k1->w[k] + 2.0 * (k2.w[k] + k3.w[k]) + k4.w[k];
        mean.e[k] = k1->e[k] + 2.0 * (k2.e[k] + k3.e[k]) + k4.e[k];
        mean.z[k] = k1->z[k] + 2.0 * (k2.z[k] + k3.z[k]) + k4.z[k];
    }
    return stepped(at, &mean, h / 6.0);
}

/* Derivatives of a step's turn and rate by the rate before it; k is the cross matrix of the turn. */
static void sensitivity(const Body *body, const double middle[3], const double k[9], double h, double by_rate[9],
                        double ratio[9])
{
    double w[9] = {0.0}, kk[9], kw[9], ww[9];
    if (body->inertia) {
        const double a = body->inertia[0], b = body->inertia[1], c = body->inertia[2];
        const double p = h * (b - c) / a, q = h * (c - a) / b, r = h * (a - b) / c;
        w[1] = p * middle[2], w[2] = p * middle[1];
        w[3] = q * middle[2], w[5] = q * middle[0];
        w[6] = r * middle[1], w[7] = r * middle[0];
    }
    product3(k, k, kk);
    product3(k, w, kw);
    product3(w, w, ww);
    for (int i = 0; i < 9; i++) {
        const double one = i % 4 == 0 ? 1.0 : 0.0;
        by_rate[i] = h * (one + 0.5 * (w[i] - k[i]) + (kk[i] - kw[i] + ww[i]) / 6.0);
        ratio[i] = one + w[i] + 0.5 * ww[i];
    }
}

/* A Magnus step of fourth order: how far the body turns while its rate goes from one value to another. */
static void turned_by(const Turning *begin, const Turning *end, const Turning *slope_begin, const Turning *slope_end,
                      double h, double middle[3], double vector[3])
{
    double twist[3];
    cross3(begin->w, end->w, twist);
    for (int k = 0; k < 3; k++) {
        middle[k] = 0.5 * (begin->w[k] + end->w[k]) + 0.125 * h * (slope_begin->w[k] - slope_end->w[k]);
        vector[k] = h / 6.0 * (begin->w[k] + 4.0 * middle[k] + end->w[k]) + h * h / 12.0 * twist[k];
    }
}

static void turn_one(const Body *body, Turning at, double h, int64_t steps, double *rate, double *turned,
                     double *angle_by_rate, double *rate_by_rate)
{
    static const double eye[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    memcpy(turned, eye, sizeof eye);
    memcpy(rate_by_rate, eye, sizeof eye);
    memset(angle_by_rate, 0, sizeof eye);
    for (int64_t step = 0; step < steps; step++) {
        const Turning begin = at;
        Turning slope_begin = {{0.0}, {0.0}, {0.0}}, slope_end = slope_begin;
        if (body->inertia) {
            slope_begin = slopes(body, &begin);
            at = after(body, &begin, &slope_begin, h);
            acceleration(body, at.w, at.e, slope_end.w);
        }
        double middle[3], vector[3], by[9], by_rate[9], ratio[9], next[9], led[9];
        turned_by(&begin, &at, &slope_begin, &slope_end, h, middle, vector);
        turn(vector, by);
        const double k[9] = {0.0, -vector[2], vector[1], vector[2], 0.0, -vector[0], -vector[1], vector[0], 0.0};
        sensitivity(body, middle, k, h, by_rate, ratio);
        back_product3(by, angle_by_rate, next);
        product3(by_rate, rate_by_rate, led);
        for (int i = 0; i < 9; i++) angle_by_rate[i] = next[i] + led[i];
        product3(ratio, rate_by_rate, next);
        memcpy(rate_by_rate, next, sizeof next);
        product3(turned, by, next);
        memcpy(turned, next, sizeof next);
    }
    memcpy(rate, at.w, sizeof at.w);
}

void gs_turn_on(int64_t m, const double *rates, const double *inertia, double dt_s, const double *up,
                const double *normal, double orbital_rate, double step_rad, int64_t most_steps, double *rates_after,
                double *turns, double *angle_by_rate, double *rate_by_rate)
{
    const Body body = {inertia, inertia && up ? orbital_rate : 0.0};
    double fastest = 0.0;
    for (int64_t i = 0; i < m; i++) {
        const double *w = rates + 3 * i;
        fastest = fmax(fastest, w[0] * w[0] + w[1] * w[1] + w[2] * w[2]);
    }
    const double wanted = fmin(ceil(sqrt(fastest) * fabs(dt_s) / step_rad), (double)most_steps);
    const int64_t steps = wanted > 1.0 ? (int64_t)wanted : 1;
    for (int64_t i = 0; i < m; i++) {
        Turning at = {{0.0}, {0.0}, {0.0}};
        memcpy(at.w, rates + 3 * i, sizeof at.w);
        if (body.n != 0.0) {
            memcpy(at.e, up + 3 * i, sizeof at.e);
            memcpy(at.z, normal + 3 * i, sizeof at.z);
        }
        turn_one(&body, at, dt_s / (double)steps, steps, rates_after + 3 * i, turns + 9 * i, angle_by_rate + 9 * i,
                 rate_by_rate + 9 * i);
    }
}
