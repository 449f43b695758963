/* One candidate pose made a fix or refused: matched, refined, put to the test (tests/oracles/settling.py). */
#include <string.h>

#include "star_tracker.h"

/* Spots as at the middle of the exposure, under the present guess of the heading. */
static const Point *at_middle(SkySearch *s, Point turn)
{
    if (!s->picture->has_motion) {
        return s->q;
    }
    to_middle(s->picture, s->settings, s->rays->picture_rows, s->q, turn, s->q_middle);
    return s->q_middle;
}

/* Pair spots with stars within the gate, in the order of the spots; of two spots at one star the nearer one. */
static int64_t match(SkySearch *s, const Point *q, Point turn, Point shift_m, double gate_m)
{
    const Sky *sky = s->sky;
    const double gate2 = gate_m * gate_m;
    int64_t count = 0;
    for (int64_t i = 0; i < s->picture->spots; i++) {
        double distance2;
        const int64_t star = nearest_star(sky, add(turned(turn, q[i]), shift_m), &distance2);
        if (!(distance2 < gate2) || sky->is_dropped[star]) {
            continue;
        }
        const int32_t taken = s->spot_of_star[star]; /* 1 + the place of its match, 0 for none */
        if (taken && s->distance2[taken - 1] <= distance2) {
            continue;
        }
        if (taken) {
            s->spot[taken - 1] = -1;
        }
        s->spot[count] = (int32_t)i;
        s->star[count] = (int32_t)star;
        s->distance2[count++] = distance2;
        s->spot_of_star[star] = (int32_t)count;
    }
    int64_t left = 0;
    for (int64_t i = 0; i < count; i++) {
        s->spot_of_star[s->star[i]] = 0;
        if (s->spot[i] >= 0) {
            s->spot[left] = s->spot[i];
            s->star[left++] = s->star[i];
        }
    }
    return left;
}

/* Inverse covariances of spot minus star in body axes: J C J^T of the centre, and the star's own. */
static void weigh(SkySearch *s, int64_t n)
{
    const double floor2 = s->settings->centre_floor_px * s->settings->centre_floor_px;
    const double ratio2 = s->settings->streak_floor_ratio * s->settings->streak_floor_ratio;
    for (int64_t i = 0; i < n; i++) {
        const int64_t spot = s->spot[i];
        const double *j = s->jacobian + 4 * spot, *c = s->picture->covariance_px2 + 3 * spot;
        const double *streak = s->picture->streak_px + 2 * spot;
        const double more = floor2 + ratio2 * (streak[0] * streak[0] + streak[1] * streak[1]);
        const double uu = c[0] + more, uv = c[1], vv = c[2] + more;
        const double star = s->sky->variance_m2[s->star[i]];
        const double xx = j[0] * j[0] * uu + 2.0 * j[0] * j[1] * uv + j[1] * j[1] * vv + star;
        const double yy = j[2] * j[2] * uu + 2.0 * j[2] * j[3] * uv + j[3] * j[3] * vv + star;
        const double xy = j[0] * j[2] * uu + (j[0] * j[3] + j[1] * j[2]) * uv + j[1] * j[3] * vv;
        const double determinant = xx * yy - xy * xy;
        s->weight[3 * i] = yy / determinant;
        s->weight[3 * i + 1] = -xy / determinant;
        s->weight[3 * i + 2] = xx / determinant;
    }
}

/* The volume of poses that chance could have had: all of them, or those of the prior. */
static double volume_of(const SkySearch *s, const Pose *pose, int has_prior)
{
    const double two_pi = 6.283185307179586;
    if (!has_prior) {
        return two_pi * s->sky->area_m2;
    }
    const StarPicture *p = s->picture;
    const Point by = turned_back(unit_at(p->prior_heading_rad), pose->turn);
    const double off[3] = {pose->shift_m.x - p->prior_x_m, pose->shift_m.y - p->prior_y_m, atan2(by.y, by.x)};
    double spread[9], x[3], determinant;
    for (int k = 0; k < 9; k++) {
        spread[k] = p->prior_covariance[k] + pose->covariance[k];
    }
    if (!solve_3x3(spread, off, 1, x, &determinant)) {
        return NAN;
    }
    const double surprise = 0.5 * (off[0] * x[0] + off[1] * x[1] + off[2] * x[2]);
    return pow(two_pi, 1.5) * sqrt(determinant) * exp(fmin(surprise, 200.0));
}

static double judge(SkySearch *s, const Point *q, int64_t n, const Pose *pose, int has_prior)
{
    Point mean = {0.0, 0.0};
    double lever2 = 0.0;
    for (int64_t i = 0; i < n; i++) {
        mean = add(mean, scaled(q[i], 1.0 / (double)n));
    }
    for (int64_t i = 0; i < n; i++) {
        const Point arm = sub(q[i], mean);
        const Point off = sub(add(turned(pose->turn, q[i]), pose->shift_m), s->star_matched[i]);
        lever2 += dot(arm, arm);
        s->distance2[i] = dot(off, off);
    }
    const double volume = volume_of(s, pose, has_prior);
    if (!(volume > 0.0)) {
        return -INFINITY; /* a prior that is none */
    }
    return evidence_nats(s->settings, s->sky->density_m2, volume, s->rays->scale_m_px, n, s->distance2, sqrt(lever2),
                         s->picture->spots);
}

static void answer(SkySearch *s, int64_t n, const Pose *pose, double nats, int has_prior)
{
    StarPicture *p = s->picture;
    p->is_fix = 1;
    p->is_tracked = has_prior;
    p->x_m = pose->shift_m.x;
    p->y_m = pose->shift_m.y;
    p->heading_rad = atan2(pose->turn.y, pose->turn.x);
    p->evidence_nats = nats;
    memcpy(p->covariance, pose->covariance, sizeof p->covariance);
    p->stars = 0;
    for (int64_t i = 0; i < n; i++) {
        if (s->kept[i] > 0.5) {
            const Point at = add(turned(pose->turn, s->q_matched[i]), pose->shift_m);
            p->spot_index[p->stars] = s->spot[i];
            p->star_index[p->stars] = s->star[i];
            p->residual_m[p->stars++] = sub(at, s->star_matched[i]);
        }
    }
}

/* Refine one candidate with a shrinking gate and put it to the test; the candidate becomes the refined pose.
 *
 * The answer is written unless the picture has a better one. */
int settle(SkySearch *s, Candidate *candidate, double gate_m, int has_prior, double *nats)
{
    const double tolerance = s->sky->tolerance_m;
    const int64_t needed = has_prior ? s->settings->min_stars_prior : s->settings->min_stars;
    Pose pose = {.turn = candidate->turn, .shift_m = candidate->shift_m};
    int64_t n = 0;
    for (int round = 0; round < 3; round++) {
        const Point *q = at_middle(s, pose.turn);
        n = match(s, q, pose.turn, pose.shift_m, gate_m);
        if (n < needed) {
            return 0;
        }
        weigh(s, n);
        for (int64_t i = 0; i < n; i++) {
            s->q_matched[i] = q[s->spot[i]];
            s->star_matched[i] = s->sky->star[s->star[i]];
        }
        if (!refine_pose(s->settings, n, s->q_matched, s->star_matched, s->weight, s->free, s->kept, &pose)) {
            return 0;
        }
        if (gate_m <= 1.5 * tolerance) {
            break;
        }
        gate_m = fmax(0.4 * gate_m, 1.2 * tolerance);
    }
    candidate->turn = pose.turn;
    candidate->shift_m = pose.shift_m;
    *nats = judge(s, s->q_matched, n, &pose, has_prior);
    StarPicture *p = s->picture;
    if (*nats > p->best_nats) {
        p->best_nats = *nats;
        p->guess[0] = pose.shift_m.x;
        p->guess[1] = pose.shift_m.y;
        p->guess[2] = atan2(pose.turn.y, pose.turn.x);
    }
    if (!(*nats >= s->settings->evidence_nats) || pose.kept < needed) {
        return 0;
    }
    if (!p->is_fix || *nats > p->evidence_nats) {
        answer(s, n, &pose, *nats, has_prior);
    }
    return 1;
}
