/* Sub-pixel centres of light spots; in NumPy, with the same formulas: star_tracking/spot_fit.py.
 *
 * Moments give the first guess and the shape: one width for the picture, and a streak for every spot whose second
 * moments say so. Then Gauss-Newton steps fit a Gaussian of that shape (a blurred line for long streaks) to the pixels,
 * weighted by read and shot noise, saturated pixels and outliers left out.
 */
#include "spot_fit.h"

#include "gaussian.h"

#include <math.h>

enum { STEPS = 2, TILE = 32 };

static const double PI = 3.14159265358979323846;
static const double ROOT_2PI = 2.50662827463100050242;
static const double LINE_PX = 3.0; /* half length from where a streak is a line and no longer an oval */
static const double MAX_STEP_PX = 2.0;
static const double OUTLIER_SIGMAS = 5.0;
static const double MISFIT_RATIO = 0.3;  /* the true image is no Gaussian: so much of the model is no outlier */
static const double STREAK_RATIO2 = 2.0; /* long over short axis, squared, from where a spot counts as a streak */
static const double TRUNCATION = 1.12;   /* second moments over a finite footprint come out this much too small */
static const double MIN_WIDTH2_PX2 = 0.3, MAX_WIDTH2_PX2 = 16.0;

/* The image that is fitted, its light being one. */
typedef struct {
    double a, b, c, norm; /* inverse shape and its factor */
    int is_line;
    double cosine, sine, half_px, width_px; /* of a line of light, blurred by the round image of a star */
} Image;

/* Some pixels of a spot: the image there, and its derivatives by the centre. */
typedef struct {
    double unit[TILE], by_u[TILE], by_v[TILE];
} Patch;

/* Normal equations for centre and light. */
typedef struct {
    double uu, uv, vv, uf, vf, ff, gu, gv, gf;
} Normal;

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }
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
    Symmetric spread = {0}, cov = {0};
    for (int32_t i = 0; i < s->size; i++) {
        const double du = u[i] - s->u_px, dv = v[i] - s->v_px;
        const double variance = floor[i] + gain * larger(light[i], 0.0);
        spread.uu += light[i] * (du * du);
        spread.uv += light[i] * (du * dv);
        spread.vv += light[i] * (dv * dv);
        cov.uu += variance * (du * du);
        cov.uv += variance * (du * dv);
        cov.vv += variance * (dv * dv);
    }
    const double f = s->flux_dn, f2 = f * f;
    s->spread_px2 = (Symmetric){spread.uu / f, spread.uv / f, spread.vv / f};
    s->cov_px2 = (Symmetric){cov.uu / f2, cov.uv / f2, cov.vv / f2};
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

/* Shape of every spot: round unless it surely is a streak. */
static void choose_shapes(Spot *spots, int32_t count, double *work)
{
    for (int32_t i = 0; i < count; i++) work[i] = half_sum(spots[i].spread_px2) - half_spread(spots[i].spread_px2);
    const double width2 = smaller(larger(TRUNCATION * upper_median(work, count), MIN_WIDTH2_PX2), MAX_WIDTH2_PX2);
    for (int32_t i = 0; i < count; i++) {
        const Symmetric m = spots[i].spread_px2;
        const double half = half_sum(m), spread = half_spread(m), long2 = half + spread;
        Symmetric *shape = &spots[i].shape_px2;
        *shape = (Symmetric){width2, 0.0, width2};
        if (!(long2 > STREAK_RATIO2 * larger(half - spread, width2 / TRUNCATION))) continue;
        /* The part of the spread beyond the round image is the streak's, along its own direction. */
        const double extra = larger(long2 - width2, 0.0), angle2 = atan2(2.0 * m.uv, m.uu - m.vv);
        const double cosine2 = cos(angle2), sine2 = sin(angle2);
        shape->uu += 0.5 * extra * (1.0 + cosine2);
        shape->uv += 0.5 * extra * sine2;
        shape->vv += 0.5 * extra * (1.0 - cosine2);
    }
}

/* A uniform line of length l spreads l^2 / 12 along itself. */
static void describe_shape(Symmetric shape, FittedSpot *f)
{
    const double half = half_sum(shape), spread = half_spread(shape);
    const double length = sqrt(12.0 * 2.0 * spread), angle = 0.5 * atan2(2.0 * shape.uv, shape.uu - shape.vv);
    f->elongation = sqrt((half + spread) / larger(half - spread, 1e-3));
    f->streak_u_px = length * cos(angle);
    f->streak_v_px = length * sin(angle);
}

static Image image_of(Symmetric s, const FittedSpot *f)
{
    const double determinant = s.uu * s.vv - s.uv * s.uv;
    const double length = sqrt(f->streak_u_px * f->streak_u_px + f->streak_v_px * f->streak_v_px);
    const double safe = larger(length, 1e-9);
    return (Image){
        .a = s.vv / determinant,
        .b = -s.uv / determinant,
        .c = s.uu / determinant,
        .norm = 1.0 / (2.0 * PI * sqrt(determinant)),
        .is_line = 0.5 * length > LINE_PX,
        .cosine = f->streak_u_px / safe,
        .sine = f->streak_v_px / safe,
        .half_px = 0.5 * length,
        .width_px = sqrt(larger(half_sum(s) - half_spread(s), MIN_WIDTH2_PX2)),
    };
}

/* Gaussian: norm exp(-d' S^-1 d / 2). */
static inline void gaussian_patch(const Image *m, const double *restrict du, const double *restrict dv, Patch *restrict out)
{
    for (int i = 0; i < TILE; i++) {
        const double along_u = m->a * du[i] + m->b * dv[i], along_v = m->b * du[i] + m->c * dv[i];
        const double unit = m->norm * exponential(-0.5 * (along_u * du[i] + along_v * dv[i]));
        out->unit[i] = unit;
        out->by_u[i] = unit * along_u;
        out->by_v[i] = unit * along_v;
    }
}

/* Line of half length h blurred by a Gaussian of width w: across it a Gaussian, along it the difference of two normal
 * distributions, [N((t + h) / w) - N((t - h) / w)] / 2h. */
static inline void line_patch(const Image *m, const double *restrict du, const double *restrict dv, Patch *restrict out)
{
    const double w = m->width_px, length = 2.0 * m->half_px;
    for (int i = 0; i < TILE; i++) {
        const double along = du[i] * m->cosine + dv[i] * m->sine, across = (dv[i] * m->cosine - du[i] * m->sine) / w;
        const double front = (along + m->half_px) / w, back = (along - m->half_px) / w;
        const double at_front = exponential(-0.5 * front * front), at_back = exponential(-0.5 * back * back);
        const double profile = (normal_below(front, at_front) - normal_below(back, at_back)) / length;
        const double slope = (at_back - at_front) / (length * w * ROOT_2PI);
        const double side = exponential(-0.5 * across * across) / (w * ROOT_2PI);
        const double by_along = slope * side, by_across = profile * side * across / w;
        out->unit[i] = profile * side;
        out->by_u[i] = by_along * m->cosine - by_across * m->sine;
        out->by_v[i] = by_along * m->sine + by_across * m->cosine;
    }
}

/* Sum up the normal equations of one spot at (u, v, flux). */
GS_CLONES
static void sum_normal(const SpotPixels *p, const Spot *s, double gain, const Image *m, const double at[3], int is_last,
                       Normal *out)
{
    Normal n = {0};
    Patch patch;
    double du[TILE], dv[TILE];
    const double flux = at[2];
    for (int32_t begin = 0; begin < s->size; begin += TILE) {
        const int32_t left = s->size - begin, size = left < TILE ? left : TILE, first = s->first + begin;
        for (int32_t i = 0; i < TILE; i++) {
            const int32_t k = first + (i < size ? i : 0);
            du[i] = p->u_px[k] - at[0];
            dv[i] = p->v_px[k] - at[1];
        }
        if (m->is_line)
            line_patch(m, du, dv, &patch);
        else
            gaussian_patch(m, du, dv, &patch);
        for (int32_t i = 0; i < size; i++) {
            const double model = flux * patch.unit[i], error = p->light_dn[first + i] - model;
            const double variance = p->variance_dn2[first + i] + gain * larger(model, 0.0);
            const double misfit = MISFIT_RATIO * model;
            const double limit2 = OUTLIER_SIGMAS * OUTLIER_SIGMAS * variance + misfit * misfit;
            const int used = !is_last || error * error < limit2;
            const double weight = used ? p->usable[first + i] / variance : 0.0;
            const double d_u = flux * patch.by_u[i], d_v = flux * patch.by_v[i];
            const double w_u = weight * d_u, w_v = weight * d_v, w_f = weight * patch.unit[i];
            n.uu += w_u * d_u;
            n.uv += w_u * d_v;
            n.vv += w_v * d_v;
            n.uf += w_u * patch.unit[i];
            n.vf += w_v * patch.unit[i];
            n.ff += w_f * patch.unit[i];
            n.gu += w_u * error;
            n.gv += w_v * error;
            n.gf += w_f * error;
        }
    }
    *out = n;
}

/* One Gauss-Newton step: the light eliminated, the 2x2 system of the centre solved. 0 where it cannot be trusted. */
static int step(const Normal *n, double at[3], Symmetric *cov)
{
    const double ff = larger(n->ff, 1e-300);
    const double uu = n->uu - n->uf * n->uf / ff, uv = n->uv - n->uf * n->vf / ff, vv = n->vv - n->vf * n->vf / ff;
    const double hu = n->gu - n->uf * n->gf / ff, hv = n->gv - n->vf * n->gf / ff;
    const double determinant = uu * vv - uv * uv;
    if (!(determinant > 0.0 && uu > 0.0)) return 0;
    const double du = (vv * hu - uv * hv) / determinant, dv = (uu * hv - uv * hu) / determinant;
    if (!(fabs(du) < MAX_STEP_PX && fabs(dv) < MAX_STEP_PX)) return 0;
    at[0] += du;
    at[1] += dv;
    at[2] += (n->gf - n->uf * du - n->vf * dv) / ff;
    *cov = (Symmetric){vv / determinant, -uv / determinant, uu / determinant};
    return 1;
}

static void fit_spot(const SpotPixels *p, double gain, const Spot *s, FittedSpot *f)
{
    describe_shape(s->shape_px2, f);
    const Image image = image_of(s->shape_px2, f);
    double at[3] = {s->u_px, s->v_px, s->flux_dn};
    Symmetric cov = s->cov_px2;
    int trusted = 1;
    for (int k = 0; k < STEPS && trusted; k++) {
        Normal normal;
        sum_normal(p, s, gain, &image, at, k == STEPS - 1, &normal);
        trusted = step(&normal, at, &cov);
    }
    trusted = trusted && at[2] > 0.0;
    f->u_px = trusted ? at[0] : s->u_px;
    f->v_px = trusted ? at[1] : s->v_px;
    f->flux_dn = trusted ? at[2] : s->flux_dn;
    f->cov_px2 = trusted ? cov : s->cov_px2;
}

void fit_spots(const SpotPixels *p, double gain, Spot *spots, int32_t count, double *work, FittedSpot *fitted)
{
    if (count == 0) return;
    for (int32_t i = 0; i < count; i++) take_moments(p, gain, spots + i);
    choose_shapes(spots, count, work);
    for (int32_t i = 0; i < count; i++) {
        FittedSpot spot;
        fit_spot(p, gain, spots + i, &spot);
        int32_t k = i; /* into its place: brightest first, equals in the order of their pixels */
        for (; k > 0 && fitted[k - 1].flux_dn < spot.flux_dn; k--) fitted[k] = fitted[k - 1];
        fitted[k] = spot;
    }
}
