/* What motion does to a picture (tests/oracles/motion.py, where the formulas stand). */
#include <string.h>

#include "star_tracker.h"

/* The model -i a q - b of a streak at q. */
static Point streak_at(Smear smear, Point q)
{
    return (Point){smear.turn_rad * q.y - smear.path_m.x, -smear.turn_rad * q.x - smear.path_m.y};
}

/* Signs and motion in turn, from a first model; gives the median misfit. */
static double alternate(int64_t rounds, int64_t n, const Point *q, const Point *streak, Point *model, double *weight,
                        double *misfit, double *sorted, Smear *smear)
{
    double middle = INFINITY;
    for (int64_t i = 0; i < n; i++) {
        weight[i] = 1.0;
    }
    for (int64_t round = 0; round < rounds; round++) {
        double total = 0.0, along = 0.0, spread = 0.0;
        Point q_mean = {0.0, 0.0}, s_mean = {0.0, 0.0};
        for (int64_t i = 0; i < n; i++) {
            const double sign = dot(streak[i], model[i]) < 0.0 ? -weight[i] : weight[i];
            total += weight[i];
            q_mean = add(q_mean, scaled(q[i], weight[i]));
            s_mean = add(s_mean, scaled(streak[i], sign));
        }
        q_mean = scaled(q_mean, 1.0 / total);
        s_mean = scaled(s_mean, 1.0 / total);
        /* s = -i a q - b: a by the rotation about the mean, then b. */
        for (int64_t i = 0; i < n; i++) {
            const double sign = dot(streak[i], model[i]) < 0.0 ? -1.0 : 1.0;
            const Point arm = sub(q[i], q_mean), rest = sub(scaled(streak[i], sign), s_mean);
            along += weight[i] * (rest.x * arm.y - rest.y * arm.x);
            spread += weight[i] * dot(arm, arm);
        }
        smear->turn_rad = along / spread;
        smear->path_m = (Point){smear->turn_rad * q_mean.y - s_mean.x, -smear->turn_rad * q_mean.x - s_mean.y};
        for (int64_t i = 0; i < n; i++) {
            model[i] = streak_at(*smear, q[i]);
            misfit[i] = fmin(length_of(sub(streak[i], model[i])), length_of(add(streak[i], model[i])));
        }
        memcpy(sorted, misfit, (size_t)n * sizeof *sorted);
        middle = middle_value(sorted, n);
        const double scale = middle > 1e-9 ? middle : 1e-9;
        for (int64_t i = 0; i < n; i++) {
            const double ratio = misfit[i] / scale;
            weight[i] = 1.0 / (1.0 + ratio * ratio);
        }
    }
    return middle;
}

/* Whether the streaks of the picture tell one motion, and which; scratch holds 9 n. */
int smear_from_streaks(const SearchSettings *settings, int64_t n, const Point *q, const double *streak_px,
                       const double *jacobian, double *scratch, Smear *smear)
{
    Point *place = (Point *)scratch, *streak = place + n, *model = streak + n;
    double *weight = (double *)(model + n), *misfit = weight + n, *sorted = misfit + n;
    int64_t count = 0;
    for (int64_t i = 0; i < n; i++) {
        const double du = streak_px[2 * i], dv = streak_px[2 * i + 1];
        if (sqrt(du * du + dv * dv) > settings->min_streak_px) {
            const double *j = jacobian + 4 * i;
            place[count] = q[i];
            streak[count++] = (Point){j[0] * du + j[1] * dv, j[2] * du + j[3] * dv};
        }
    }
    const double needed = settings->min_streak_share * (double)n;
    if (count < settings->min_streaks || (double)count < needed) {
        return 0;
    }
    Point mean = {0.0, 0.0};
    for (int64_t i = 0; i < count; i++) {
        mean = add(mean, place[i]);
    }
    mean = scaled(mean, 1.0 / (double)count);
    const Smear starts[3] = {
        {0.0, {-streak[0].x, -streak[0].y}}, /* a pure shift */
        {1.0, {mean.y, -mean.x}},            /* a turn about the mean: -i (q - mean) */
        {1.0, {0.0, 0.0}},                   /* a turn about the body */
    };
    double least = INFINITY;
    for (int start = 0; start < 3; start++) {
        Smear end;
        for (int64_t i = 0; i < count; i++) {
            model[i] = streak_at(starts[start], place[i]);
        }
        const double found =
            alternate(settings->smear_rounds, count, place, streak, model, weight, misfit, sorted, &end);
        if (start == 0 || found < least) {
            least = found;
            *smear = end;
        }
    }
    for (int64_t i = 0; i < count; i++) {
        sorted[i] = length_of(streak[i]);
    }
    return least < settings->max_misfit_ratio * middle_value(sorted, count);
}

/* Mean places over an exposure brought to the places at its middle; out may be q. */
void unbend(int64_t n, const Point *q, Smear smear, Point *out)
{
    const double a = smear.turn_rad;
    const Point b = smear.path_m;
    for (int64_t i = 0; i < n; i++) {
        out[i].x = q[i].x + (a * a * q[i].x + 2.0 * a * b.y) / 24.0;
        out[i].y = q[i].y + (a * a * q[i].y - 2.0 * a * b.x) / 24.0;
    }
}

/* Spots as at the middle of the middle row's exposure, the motion being known. */
void to_middle(const StarPicture *picture, const SearchSettings *settings, double picture_rows, const Point *q,
               Point turn, Point *out)
{
    const int64_t n = picture->spots;
    const Point velocity = turned_back(turn, (Point){picture->vx_table_m_s, picture->vy_table_m_s});
    if (settings->exposure_s > 0.0) {
        const double exposure_s = settings->exposure_s;
        unbend(n, q, (Smear){picture->rate_rad_s * exposure_s, scaled(velocity, exposure_s)}, out);
    } else {
        memcpy(out, q, (size_t)n * sizeof *out);
    }
    if (settings->readout_s > 0.0) {
        for (int64_t i = 0; i < n; i++) {
            const double delay_s = (picture->v_px[i] / (picture_rows - 1.0) - 0.5) * settings->readout_s;
            out[i] = add(turned(unit_at(picture->rate_rad_s * delay_s), out[i]), scaled(velocity, delay_s));
        }
    }
}
