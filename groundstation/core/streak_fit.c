/* The Gauss-Newton sums of a streak: a line of light blurred by the round image of a star. Its length and direction are
 * unknowns too: moments of few and noisy pixels tell them badly, and a wrong shape costs a centre its accuracy. */
#include "spot_steps.h"

/* The image of light one, and its derivatives: by the centre, by half the length, and by its ends moving sideways. */
typedef struct {
    double unit[TILE], by[UNKNOWNS][TILE];
} Patch;

/* Line of half length h blurred by a Gaussian of width w: across it a Gaussian, along it the difference of two normal
 * distributions, [N((t + h) / w) - N((t - h) / w)] / 2h. */
GS_INLINE void line_patch(const Guess *at, double width_px, const double *restrict du, const double *restrict dv,
                          Patch *restrict out)
{
    /* Factors, not divisors: a division takes as long as ten products. */
    const double cosine = cos(at->angle_rad), sine = sin(at->angle_rad), half = at->half_px, flux = at->flux_dn;
    const double per_w = 1.0 / width_px, per_half = 1.0 / half, per_length = 0.5 * per_half;
    const double side_norm = per_w / ROOT_2PI, slope_norm = per_length * per_w / ROOT_2PI;
    for (int i = 0; i < TILE; i++) {
        const double along = du[i] * cosine + dv[i] * sine, off = dv[i] * cosine - du[i] * sine;
        const double across = off * per_w, front = (along + half) * per_w, back = (along - half) * per_w;
        const double at_front = exponential(-0.5 * front * front), at_back = exponential(-0.5 * back * back);
        const double profile = (normal_below(front, at_front) - normal_below(back, at_back)) * per_length;
        const double side = exponential(-0.5 * across * across) * side_norm;
        const double unit = profile * side, by_along = (at_back - at_front) * slope_norm * side;
        const double by_across = unit * across * per_w;
        out->unit[i] = unit;
        out->by[AT_U][i] = flux * (by_along * cosine - by_across * sine);
        out->by[AT_V][i] = flux * (by_along * sine + by_across * cosine);
        out->by[AT_FLUX][i] = unit;
        out->by[AT_HALF][i] = flux * ((at_front + at_back) * slope_norm * side - unit * per_half);
        out->by[AT_ACROSS][i] = flux * (by_across * along - by_along * off) * per_half;
    }
}

GS_CLONES
void sum_streak(const SpotPixels *p, const Spot *s, double gain, double width_px, const Guess *at, int is_last,
                Normal *out)
{
    Four matrix[UNKNOWNS][UNKNOWNS] = {{{0}}}, gradient[UNKNOWNS] = {{0}};
    Tile tile;
    Patch patch;
    double error[TILE], weight[TILE];
    for (int32_t begin = 0; begin < s->size; begin += TILE) {
        fill_tile(p, s, begin, at, &tile);
        line_patch(at, width_px, tile.du, tile.dv, &patch);
        weigh(&tile, patch.unit, at->flux_dn, gain, is_last, error, weight);
        for (int i = 0; i < TILE; i += 4) {
            Four w, e, weighted, by;
            load_four(&w, weight + i);
            load_four(&e, error + i);
            for (int row = 0; row < UNKNOWNS; row++) {
                load_four(&weighted, patch.by[row] + i);
                weighted *= w;
                gradient[row] += weighted * e;
                for (int column = 0; column <= row; column++) {
                    load_four(&by, patch.by[column] + i);
                    matrix[row][column] += weighted * by;
                }
            }
        }
    }
    *out = (Normal){0};
    for (int row = 0; row < UNKNOWNS; row++) {
        out->gradient[row] = total(&gradient[row]);
        for (int column = 0; column <= row; column++) out->matrix[row][column] = total(&matrix[row][column]);
    }
}
