/* Sub-pixel centres of light spots; in NumPy, with the same formulas: tests/oracles/spot_fit.py.
 *
 * Moments give the first guess and the shape: one width for the picture, and a streak for every spot whose second
 * moments say so, or for all of a picture that was taken in motion. Then Gauss-Newton steps fit a Gaussian of that width
 * (a line blurred by it, for streaks) to the pixels, weighted by read and shot noise, saturated pixels and outliers left
 * out.
 */
#include "spot_fit.h"

#include "spot_steps.h"

#include <math.h>

enum { STEPS = 2, STREAK_STEPS = 3 };

enum { MAX_FIT_PX = 2000 }; /* what covers more is a lamp or a window, no star: its moments do */

static const double MAX_STEP_PX = 2.0, MAX_TURN_RAD = 0.3, MIN_HALF_PX = 0.5;
static const double STREAK_RATIO2 = 2.0;  /* long over short axis, squared, from where one spot counts as a streak */
static const double MOVING_RATIO2 = 1.25; /* the same, from where half of the spots say that all are streaks */
static const double MIN_STREAK2_PX2 = 0.3; /* spread along a streak that a fit begins with */
static const double TRUNCATION = 1.12;    /* second moments over a finite footprint come out this much too small */
static const double MIN_WIDTH2_PX2 = 0.3, MAX_WIDTH2_PX2 = 16.0;
static const double TOLD_SHARE = 1e-9; /* an unknown of which the others leave less is held */

static inline double half_sum(Symmetric m) { return 0.5 * (m.uu + m.vv); }
static inline double half_spread(Symmetric m)
{
    const double difference = 0.5 * (m.uu - m.vv);
    return sqrt(difference * difference + m.uv * m.uv);
}

static void take_moments(const SpotPixels *p, double gain, Spot *s)
{
    const double *u = p->u_px + s->first, *v = p->v_px + s->first, *light = p->light_dn + s->first;
    const double *floor = p->variance_dn2 + s->first;
    double sum = 0.0, sum_u = 0.0, sum_v = 0.0;
    for (int32_t i = 0; i < s->size; i++) {
        sum += light[i];
        sum_u += light[i] * u[i];
        sum_v += light[i] * v[i];
    }
    s->flux_dn = larger(sum, 1e-9);
    s->u_px = sum_u / s->flux_dn;
    s->v_px = sum_v / s->flux_dn;
    Symmetric spread = {0}, covariance = {0};
    for (int32_t i = 0; i < s->size; i++) {
        const double du = u[i] - s->u_px, dv = v[i] - s->v_px;
        const double variance = floor[i] + gain * larger(light[i], 0.0);
        spread.uu += light[i] * (du * du);
        spread.uv += light[i] * (du * dv);
        spread.vv += light[i] * (dv * dv);
        covariance.uu += variance * (du * du);
        covariance.uv += variance * (du * dv);
        covariance.vv += variance * (dv * dv);
    }
    const double f = s->flux_dn, f2 = f * f;
    s->spread_px2 = (Symmetric){spread.uu / f, spread.uv / f, spread.vv / f};
    s->covariance_px2 = (Symmetric){covariance.uu / f2, covariance.uv / f2, covariance.vv / f2};
}

/* The value in the middle of sorted ones (the upper of two); `value` is reordered. */
static double upper_median(double *value, int32_t count)
{
    const int32_t middle = count / 2;
    int32_t low = 0, high = count - 1;
    while (low < high) { /* Hoare's selection */
        const double pivot = value[low + (high - low) / 2];
        int32_t i = low, k = high;
        while (i <= k) {
            while (value[i] < pivot) i++;
            while (pivot < value[k]) k--;
            if (i <= k) {
                const double held = value[i];
                value[i++] = value[k];
                value[k--] = held;
            }
        }
        if (middle <= k)
            high = k;
        else if (middle >= i)
            low = i;
        else
            break;
    }
    return value[middle];
}

/* Shape of every spot: round unless it or the whole picture surely is blurred by motion. Gives the width squared. */
static double choose_shapes(Spot *spots, int32_t count, double *work)
{
    for (int32_t i = 0; i < count; i++) work[i] = half_sum(spots[i].spread_px2) - half_spread(spots[i].spread_px2);
    const double width2 = smaller(larger(TRUNCATION * upper_median(work, count), MIN_WIDTH2_PX2), MAX_WIDTH2_PX2);
    for (int32_t i = 0; i < count; i++) {
        const double half = half_sum(spots[i].spread_px2), spread = half_spread(spots[i].spread_px2);
        work[i] = (half + spread) / larger(half - spread, width2 / TRUNCATION);
        spots[i].half_px = work[i] > STREAK_RATIO2 ? 1.0 : 0.0;
    }
    const int is_moving = upper_median(work, count) > MOVING_RATIO2;
    for (int32_t i = 0; i < count; i++) {
        Spot *s = spots + i;
        const Symmetric m = s->spread_px2;
        if (!is_moving && s->half_px == 0.0) continue;
        /* The part of the spread beyond the round image is the streak's: a uniform line of length l spreads l^2 / 12. */
        const double extra = larger(half_sum(m) + half_spread(m) - width2, MIN_STREAK2_PX2);
        s->half_px = sqrt(3.0 * extra);
        s->angle_rad = 0.5 * atan2(2.0 * m.uv, m.uu - m.vv);
    }
    return width2;
}

/* Take unknowns beyond the centre out of the equations, the last one first; one that the pixels do not tell is held. */
static void eliminate(Normal *n, int unknowns, int *is_held)
{
    double alone[UNKNOWNS];
    for (int k = 0; k < unknowns; k++) alone[k] = n->matrix[k][k];
    for (int k = unknowns - 1; k >= AT_FLUX; k--) {
        const double pivot = n->matrix[k][k];
        is_held[k] = !(pivot > TOLD_SHARE * alone[k]);
        if (is_held[k]) continue;
        for (int i = 0; i < k; i++) {
            for (int j = 0; j <= i; j++) n->matrix[i][j] -= n->matrix[k][i] * n->matrix[k][j] / pivot;
            n->gradient[i] -= n->matrix[k][i] * n->gradient[k] / pivot;
        }
    }
}

/* One Gauss-Newton step; 0 where it cannot be trusted. */
static int step(Normal *n, int unknowns, Guess *at, Symmetric *covariance)
{
    int is_held[UNKNOWNS];
    double x[UNKNOWNS] = {0.0};
    eliminate(n, unknowns, is_held);
    const double uu = n->matrix[AT_U][AT_U], uv = n->matrix[AT_V][AT_U], vv = n->matrix[AT_V][AT_V];
    const double *g = n->gradient, determinant = uu * vv - uv * uv;
    if (!(determinant > 0.0 && uu > 0.0)) return 0;
    x[AT_U] = (vv * g[AT_U] - uv * g[AT_V]) / determinant;
    x[AT_V] = (uu * g[AT_V] - uv * g[AT_U]) / determinant;
    if (!(fabs(x[AT_U]) < MAX_STEP_PX && fabs(x[AT_V]) < MAX_STEP_PX)) return 0;
    for (int k = AT_FLUX; k < unknowns; k++) {
        double left = g[k];
        for (int i = 0; i < k; i++) left -= n->matrix[k][i] * x[i];
        x[k] = is_held[k] ? 0.0 : left / n->matrix[k][k];
    }
    at->u_px += x[AT_U];
    at->v_px += x[AT_V];
    at->flux_dn += x[AT_FLUX];
    if (unknowns == UNKNOWNS) {
        const double least = larger(0.5 * at->half_px, MIN_HALF_PX), most = larger(1.5 * at->half_px, MIN_HALF_PX);
        at->half_px = smaller(larger(at->half_px + x[AT_HALF], least), most);
        at->angle_rad += smaller(larger(x[AT_ACROSS] / at->half_px, -MAX_TURN_RAD), MAX_TURN_RAD);
    }
    *covariance = (Symmetric){vv / determinant, -uv / determinant, uu / determinant};
    return 1;
}

static void fit_spot(const SpotPixels *p, double gain, double width2, const Spot *s, FittedSpot *f)
{
    const int is_streak = s->half_px > 0.0, steps = is_streak ? STREAK_STEPS : STEPS;
    const double width = sqrt(width2);
    const Guess first = {s->u_px, s->v_px, s->flux_dn, s->half_px, s->angle_rad};
    Guess at = first;
    Symmetric covariance = s->covariance_px2;
    int trusted = s->size <= MAX_FIT_PX;
    for (int k = 0; k < steps && trusted; k++) {
        Normal normal;
        if (is_streak)
            sum_streak(p, s, gain, width, &at, k == steps - 1, &normal);
        else
            sum_round(p, s, gain, width2, &at, k == steps - 1, &normal);
        trusted = step(&normal, is_streak ? UNKNOWNS : AT_FLUX + 1, &at, &covariance);
    }
    trusted = trusted && at.flux_dn > 0.0;
    const Guess *end = trusted ? &at : &first;
    *f = (FittedSpot){
        .u_px = end->u_px,
        .v_px = end->v_px,
        .flux_dn = end->flux_dn,
        .covariance_px2 = trusted ? covariance : s->covariance_px2,
        .elongation = sqrt(1.0 + end->half_px * end->half_px / (3.0 * width2)),
        .streak_u_px = 2.0 * end->half_px * cos(end->angle_rad),
        .streak_v_px = 2.0 * end->half_px * sin(end->angle_rad),
    };
}

void fit_spots(const SpotPixels *p, double gain, Spot *spots, int32_t count, double *work, FittedSpot *fitted)
{
    if (count == 0) return;
    for (int32_t i = 0; i < count; i++) take_moments(p, gain, spots + i);
    const double width2 = choose_shapes(spots, count, work);
    for (int32_t i = 0; i < count; i++) {
        FittedSpot spot;
        fit_spot(p, gain, width2, spots + i, &spot);
        int32_t k = i; /* into its place: brightest first, equals in the order of their pixels */
        for (; k > 0 && fitted[k - 1].flux_dn < spot.flux_dn; k--) fitted[k] = fitted[k - 1];
        fitted[k] = spot;
    }
}
