/* Whether a picture that gave a fix shows stars at two places: torn, or with blocks that stand elsewhere.
 *
 * What tears a picture leaves its upper part in place and moves what follows (rows rolled, bytes lost), or puts the
 * upper part of an older picture before the newer rest. A fix rests on the stars of the larger part, which may be the
 * wrong one. The other part tells: at one end of the picture none of the stars that should be there is, and there are
 * lights that are none of them; or, where the parts are hardly a pixel apart, the residuals make a step.
 */
#include <string.h>

#include "star_tracker.h"

static const double EDGE_PX = 7.0;       /* spots so near to the edge may have been dropped as cut by it */
static const double NEAR_TOLERANCES = 2.5; /* a light so near to a star's place is no other star's */
static const double USUAL_NATS = 8.0;
static const double SPARSE_NATS = 12.0, SPARSE_RATIO = 0.8; /* of missing stars over good ones: a sky gone dark */
static const double STREAK_RATIO = 0.02; /* residuals of streaks are worse by so much of their length */
static const int NEWTON_STEPS = 4;
enum { FEWEST_BESIDE_STEP = 4 };

/* The pixel that sees a place, by Newton's method on the table; far outside the picture it is only outside. */
static void pixel_of(const Rays *rays, Point q, double *u_px, double *v_px)
{
    double u = 0.5 * rays->step_px * (double)(rays->columns - 1), v = 0.5 * rays->step_px * (double)(rays->rows - 1);
    for (int step = 0; step < NEWTON_STEPS; step++) {
        Point seen;
        double j[4];
        look_up_rays(rays, 1, &u, &v, &seen, j);
        const Point off = sub(q, seen);
        const double determinant = j[0] * j[3] - j[1] * j[2];
        u += (j[3] * off.x - j[1] * off.y) / determinant;
        v += (j[0] * off.y - j[2] * off.x) / determinant;
    }
    *u_px = u;
    *v_px = v;
}

/* Counts at the four ends of the picture: before the first good star by column and by row, behind the last one. */
typedef struct {
    double low[2], high[2]; /* of the good stars: column, row */
    double share[4];        /* of the picture */
    int64_t missing[6], stray[6]; /* at each end; at none of them; everywhere */
} Ends;

static void count(const Ends *ends, int64_t counts[6], double u_px, double v_px)
{
    const double at[2] = {u_px, v_px};
    int is_at_end = 0;
    for (int axis = 0; axis < 2; axis++) {
        const int is_low = at[axis] < ends->low[axis], is_high = at[axis] > ends->high[axis];
        counts[2 * axis] += is_low;
        counts[2 * axis + 1] += is_high;
        is_at_end |= is_low | is_high;
    }
    counts[4] += !is_at_end;
    counts[5]++;
}

/* Log likelihood that one end of the picture shows other stars, over missing stars and stray lights as frequent there as
 * among the good stars, at none of the ends; the best of the four. */
static double end_nats(const Ends *ends, int64_t good)
{
    const double seen = (double)good + 0.5, missing = (double)ends->missing[4] + 1.0, stray = (double)ends->stray[4] + 0.5;
    double best = 0.0;
    const int64_t gone = ends->missing[5], foreign = ends->stray[5];
    for (int k = 0; k < 4; k++) {
        if (ends->missing[k] == 0 || ends->stray[k] == 0) {
            continue;
        }
        /* Lights as dense as the stars elsewhere, over as dense as stray lights elsewhere: two Poisson processes. */
        const double area = ends->share[k] / fmax(1.0 - ends->share[k], 0.1), ratio = fmax(seen / stray, 1.0);
        const double nats = (double)ends->missing[k] * log((seen + missing) / missing) +
                            (double)ends->stray[k] * log(ratio) - area * (seen - fmin(stray, seen));
        best = fmax(best, nats);
    }
    /* Where stars are missing and lights stray all over the picture, some are at its ends too. */
    const double usual = fmin((double)ends->missing[4], (double)ends->stray[4]) + 0.5 * (double)ends->stray[4];
    return best - fmin(usual, USUAL_NATS) - (foreign <= good ? SPARSE_NATS * fmax((double)gone / (double)good - SPARSE_RATIO, 0.0) : 0.0);
}

/* Sums over the residuals of one part of the picture. */
typedef struct {
    double n, cross, q2, e2;
    Point q, e;
} Part;

static Part with(Part p, Point q, Point e, double sign)
{
    p.n += sign;
    p.q = add(p.q, scaled(q, sign));
    p.e = add(p.e, scaled(e, sign));
    p.q2 += sign * dot(q, q);
    p.e2 += sign * dot(e, e);
    p.cross += sign * (q.x * e.y - q.y * e.x);
    return p;
}

/* Sum of squares that is left of a part's residuals when it is shifted and turned by itself. */
static double left_over(Part p)
{
    const double q2 = p.q2 - dot(p.q, p.q) / p.n, e2 = p.e2 - dot(p.e, p.e) / p.n;
    const double cross = p.cross - (p.q.x * p.e.y - p.q.y * p.e.x) / p.n;
    return fmax(e2 - cross * cross / fmax(q2, 1e-12), 0.0);
}

/* Twice the residuals' root mean square, where two motions, one above and one below a row, leave `ratio` times less of
 * it than one does: no outlier among four stars or more does that. e is in the order of rows. */
static double two_motions(const Point *q, const Point *e, int64_t n, double ratio)
{
    Part above = {0}, below = {0};
    for (int64_t i = 0; i < n; i++) {
        below = with(below, q[i], e[i], 1.0);
    }
    const double whole = left_over(below), freedom = 2.0 * (double)n - 3.0;
    double least = INFINITY;
    for (int64_t i = 0; i + FEWEST_BESIDE_STEP < n; i++) {
        above = with(above, q[i], e[i], 1.0);
        below = with(below, q[i], e[i], -1.0);
        if (i + 1 >= FEWEST_BESIDE_STEP) {
            least = fmin(least, left_over(above) + left_over(below));
        }
    }
    /* Two motions have three unknowns more. */
    const int is_torn = freedom > 6.0 && whole / freedom > ratio * ratio * least / (freedom - 3.0);
    return is_torn ? 2.0 * sqrt(whole / (double)n) : 0.0;
}

/* Upper median of residuals from..to along one axis; sorted has room for them. */
static double middle_of(const Point *e, int64_t from, int64_t to, int axis, double *sorted)
{
    for (int64_t i = from; i < to; i++) {
        sorted[i - from] = axis ? e[i].y : e[i].x;
    }
    return middle_value(sorted, to - from);
}

/* The largest step between the residuals before and behind a row, where it is `ratio` times the scatter on both sides.
 * e is in the order of rows. A wrong lens makes slopes, whose scatter is as large as their steps. */
static double largest_step(const Point *e, int64_t n, double ratio, double *sorted)
{
    double largest = 0.0;
    for (int64_t cut = FEWEST_BESIDE_STEP; cut + FEWEST_BESIDE_STEP <= n; cut++) {
        Point middle[2];
        for (int side = 0; side < 2; side++) {
            const int64_t from = side ? cut : 0, to = side ? n : cut;
            middle[side] = (Point){middle_of(e, from, to, 0, sorted), middle_of(e, from, to, 1, sorted)};
        }
        const double step = length_of(sub(middle[1], middle[0]));
        if (step <= largest) {
            continue;
        }
        for (int64_t i = 0; i < n; i++) {
            sorted[i] = length_of(sub(e[i], middle[i >= cut]));
        }
        if (step > ratio * middle_value(sorted, n)) {
            largest = step;
        }
    }
    return largest;
}

/* Look at a picture that gs_star_solve has found a fix in; answers tear_nats and tear_px. */
void gs_star_tears(const Sky *sky, const Rays *rays, const SearchSettings *settings, StarPicture *picture)
{
    SkySearch s = begin_search(sky, rays, settings, picture);
    const Point turn = unit_at(picture->heading_rad), shift_m = {picture->x_m, picture->y_m};
    const double near_m = NEAR_TOLERANCES * sky->tolerance_m;
    Point *e = s.q_matched, *q_seen = s.star_matched; /* in the order of rows */
    double *row = s.weight; /* of each e */
    int64_t matched = 0;
    see_places(&s, turn);
    Ends ends = {.low = {INFINITY, INFINITY}, .high = {-INFINITY, -INFINITY}};
    double streak_px = 0.0, centre_px = 0.0; /* means: length, error of a centre */
    memset(s.spot, 0, (size_t)picture->spots * sizeof *s.spot); /* 1 for the fix's own */
    for (int64_t i = 0; i < picture->stars; i++) {
        const int64_t spot = picture->spot_index[i];
        const double at[2] = {picture->u_px[spot], picture->v_px[spot]};
        for (int axis = 0; axis < 2; axis++) {
            ends.low[axis] = fmin(ends.low[axis], at[axis]);
            ends.high[axis] = fmax(ends.high[axis], at[axis]);
        }
        s.spot[spot] = 1;
        s.spot_of_star[picture->star_index[i]] = 1;
        centre_px += sqrt(0.5 * (picture->covariance_px2[3 * spot] + picture->covariance_px2[3 * spot + 2])) /
                     (double)picture->stars;
        streak_px += hypot(picture->streak_px[2 * spot], picture->streak_px[2 * spot + 1]) / (double)picture->stars;
    }
    for (int64_t i = 0; i < picture->spots; i++) {
        double distance2;
        const int64_t star = nearest_star(sky, add(turned(turn, s.q_middle[i]), shift_m), &distance2);
        const int is_near = distance2 < near_m * near_m && !sky->is_dropped[star];
        if (s.spot[i] || is_near) {
            s.spot_of_star[star] = 1;
            int64_t k = matched++;
            for (; k > 0 && row[k - 1] > picture->v_px[i]; k--) {
                row[k] = row[k - 1];
                e[k] = e[k - 1];
                q_seen[k] = q_seen[k - 1];
            }
            row[k] = picture->v_px[i];
            q_seen[k] = s.q_middle[i];
            e[k] = sub(turned_back(turn, sub(sky->star[star], shift_m)), s.q_middle[i]);
        } else {
            count(&ends, ends.stray, picture->u_px[i], picture->v_px[i]);
        }
    }
    const double edge_px = EDGE_PX + 0.5 * streak_px;
    const double right = rays->step_px * (double)(rays->columns - 1) - edge_px;
    const double bottom = rays->step_px * (double)(rays->rows - 1) - edge_px;
    for (int64_t star = 0; star < sky->stars; star++) {
        const Point q = turned_back(turn, sub(sky->star[star], shift_m));
        double u_px, v_px;
        if (s.spot_of_star[star] || sky->is_dropped[star] || !(dot(q, q) < rays->reach_m * rays->reach_m)) {
            s.spot_of_star[star] = 0;
            continue;
        }
        pixel_of(rays, q, &u_px, &v_px);
        if (u_px > edge_px && v_px > edge_px && u_px < right && v_px < bottom) {
            count(&ends, ends.missing, u_px, v_px);
        }
    }
    const double size[2] = {rays->step_px * (double)(rays->columns - 1), rays->step_px * (double)(rays->rows - 1)};
    for (int axis = 0; axis < 2; axis++) {
        ends.share[2 * axis] = ends.low[axis] / size[axis];
        ends.share[2 * axis + 1] = 1.0 - ends.high[axis] / size[axis];
    }
    picture->tear_nats = end_nats(&ends, picture->stars);
    const double step_m = largest_step(e, matched, settings->tear_scatters, s.free);
    const double apart_m = fmax(step_m, two_motions(q_seen, e, matched, settings->tear_ratio));
    picture->tear_px = fmax(apart_m / rays->scale_m_px - STREAK_RATIO * streak_px - 2.0 * centre_px, 0.0);
}
