/* Sub-pixel centres of light spots; in NumPy, with the same formulas: tests/oracles/spot_fit.py.
 *
 * Moments give the first guess and the shape: one width for the picture, and a streak for every spot whose second
 * moments say so. Then Gauss-Newton steps fit a Gaussian of that shape (a blurred line for long streaks) to the pixels,
 * weighted by read and shot noise, saturated pixels and outliers left out.
 */
#include "spot_fit.h"

#include "gaussian.h"

#include <math.h>
#include <string.h>

enum { STEPS = 2, TILE = 32 };

enum { MAX_FIT_PX = 2000 }; /* what covers more is a lamp or a window, no star: its moments do */

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

/* Some pixels of a spot, the last ones repeated with weight zero. */
typedef struct {
    double du[TILE], dv[TILE], light[TILE], floor[TILE], usable[TILE];
} Tile;

/* The image there, and its derivatives by the centre. */
typedef struct {
    double unit[TILE], by_u[TILE], by_v[TILE];
} Patch;

/* Four sums side by side: one order of addition, whatever the width of the machine's vectors. */
typedef double Four __attribute__((vector_size(4 * sizeof(double))));

/* Normal equations for centre and light. */
typedef struct {
    double uu, uv, vv, uf, vf, ff, gu, gv, gf;
} Normal;

GS_INLINE double larger(double a, double b) { return a > b ? a : b; }
GS_INLINE double smaller(double a, double b) { return a < b ? a : b; }
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
GS_INLINE void gaussian_patch(const Image *m, const double *restrict du, const double *restrict dv, Patch *restrict out)
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
GS_INLINE void line_patch(const Image *m, const double *restrict du, const double *restrict dv, Patch *restrict out)
{
    /* Factors, not divisors: a division takes as long as ten products. */
    const double per_w = 1.0 / m->width_px, per_length = 0.5 / m->half_px;
    const double side_norm = per_w / ROOT_2PI, slope_norm = per_length * per_w / ROOT_2PI;
    for (int i = 0; i < TILE; i++) {
        const double along = du[i] * m->cosine + dv[i] * m->sine;
        const double across = (dv[i] * m->cosine - du[i] * m->sine) * per_w;
        const double front = (along + m->half_px) * per_w, back = (along - m->half_px) * per_w;
        const double at_front = exponential(-0.5 * front * front), at_back = exponential(-0.5 * back * back);
        const double profile = (normal_below(front, at_front) - normal_below(back, at_back)) * per_length;
        const double slope = (at_back - at_front) * slope_norm;
        const double side = exponential(-0.5 * across * across) * side_norm;
        const double by_along = slope * side, by_across = profile * side * across * per_w;
        out->unit[i] = profile * side;
        out->by_u[i] = by_along * m->cosine - by_across * m->sine;
        out->by_v[i] = by_along * m->sine + by_across * m->cosine;
    }
}

static void fill_tile(const SpotPixels *p, const Spot *s, int32_t begin, const double at[3], Tile *t)
{
    const int32_t left = s->size - begin, size = left < TILE ? left : TILE, first = s->first + begin;
    for (int32_t i = 0; i < size; i++) {
        t->du[i] = p->u_px[first + i] - at[0];
        t->dv[i] = p->v_px[first + i] - at[1];
        t->light[i] = p->light_dn[first + i];
        t->floor[i] = p->variance_dn2[first + i];
        t->usable[i] = p->usable[first + i];
    }
    for (int32_t i = size; i < TILE; i++) {
        t->du[i] = t->du[0];
        t->dv[i] = t->dv[0];
        t->light[i] = t->light[0];
        t->floor[i] = t->floor[0];
        t->usable[i] = 0.0;
    }
}

/* Residuals and weights of the pixels; in the last step outliers have none. */
GS_INLINE void weigh(const Tile *restrict t, const Patch *restrict m, double flux, double gain, int is_last,
                     double *restrict error, double *restrict weight)
{
    for (int i = 0; i < TILE; i++) {
        const double model = flux * m->unit[i], misfit = MISFIT_RATIO * model;
        const double variance = t->floor[i] + gain * larger(model, 0.0);
        const double limit2 = OUTLIER_SIGMAS * OUTLIER_SIGMAS * variance + misfit * misfit;
        error[i] = t->light[i] - model;
        weight[i] = !is_last || error[i] * error[i] < limit2 ? t->usable[i] / variance : 0.0;
    }
}

static double total(const Four *sums) { return ((*sums)[0] + (*sums)[1]) + ((*sums)[2] + (*sums)[3]); }

/* Sum up the normal equations of one spot at (u, v, flux). */
GS_CLONES
static void sum_normal(const SpotPixels *p, const Spot *s, double gain, const Image *m, const double at[3], int is_last,
                       Normal *out)
{
    Four uu = {0}, uv = {0}, vv = {0}, uf = {0}, vf = {0}, ff = {0}, gu = {0}, gv = {0}, gf = {0};
    Tile tile;
    Patch patch;
    double error[TILE], weight[TILE];
    for (int32_t begin = 0; begin < s->size; begin += TILE) {
        fill_tile(p, s, begin, at, &tile);
        if (m->is_line)
            line_patch(m, tile.du, tile.dv, &patch);
        else
            gaussian_patch(m, tile.du, tile.dv, &patch);
        weigh(&tile, &patch, at[2], gain, is_last, error, weight);
        for (int i = 0; i < TILE; i += 4) {
            Four w, e, unit, d_u, d_v;
            memcpy(&w, weight + i, sizeof w);
            memcpy(&e, error + i, sizeof e);
            memcpy(&unit, patch.unit + i, sizeof unit);
            memcpy(&d_u, patch.by_u + i, sizeof d_u);
            memcpy(&d_v, patch.by_v + i, sizeof d_v);
            d_u *= at[2];
            d_v *= at[2];
            const Four w_u = w * d_u, w_v = w * d_v, w_f = w * unit;
            uu += w_u * d_u;
            uv += w_u * d_v;
            vv += w_v * d_v;
            uf += w_u * unit;
            vf += w_v * unit;
            ff += w_f * unit;
            gu += w_u * e;
            gv += w_v * e;
            gf += w_f * e;
        }
    }
    *out = (Normal){
        .uu = total(&uu), .uv = total(&uv), .vv = total(&vv), .uf = total(&uf), .vf = total(&vf),
        .ff = total(&ff), .gu = total(&gu), .gv = total(&gv), .gf = total(&gf),
    };
}

/* One Gauss-Newton step: the light eliminated, the 2x2 system of the centre solved. 0 where it cannot be trusted. */
static int step(const Normal *n, double at[3], Symmetric *covariance)
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
    *covariance = (Symmetric){vv / determinant, -uv / determinant, uu / determinant};
    return 1;
}

static void fit_spot(const SpotPixels *p, double gain, const Spot *s, FittedSpot *f)
{
    describe_shape(s->shape_px2, f);
    const Image image = image_of(s->shape_px2, f);
    double at[3] = {s->u_px, s->v_px, s->flux_dn};
    Symmetric covariance = s->covariance_px2;
    int trusted = s->size <= MAX_FIT_PX;
    for (int k = 0; k < STEPS && trusted; k++) {
        Normal normal;
        sum_normal(p, s, gain, &image, at, k == STEPS - 1, &normal);
        trusted = step(&normal, at, &covariance);
    }
    trusted = trusted && at[2] > 0.0;
    f->u_px = trusted ? at[0] : s->u_px;
    f->v_px = trusted ? at[1] : s->v_px;
    f->flux_dn = trusted ? at[2] : s->flux_dn;
    f->covariance_px2 = trusted ? covariance : s->covariance_px2;
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
