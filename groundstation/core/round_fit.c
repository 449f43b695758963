/* The Gauss-Newton sums of a round spot: a Gaussian of the picture's width, its centre and light unknown. */
#include "spot_steps.h"

static const double PI = 3.14159265358979323846;

/* The image of light one, and its derivatives by the centre. */
typedef struct {
    double unit[TILE], by_u[TILE], by_v[TILE];
} Patch;

/* norm exp(-d^2 / 2 width^2) */
GS_INLINE void gaussian_patch(double per_width2, double norm, const double *restrict du, const double *restrict dv,
                              Patch *restrict out)
{
    for (int i = 0; i < TILE; i++) {
        const double along_u = per_width2 * du[i], along_v = per_width2 * dv[i];
        const double unit = norm * exponential(-0.5 * (along_u * du[i] + along_v * dv[i]));
        out->unit[i] = unit;
        out->by_u[i] = unit * along_u;
        out->by_v[i] = unit * along_v;
    }
}

GS_CLONES
void sum_round(const SpotPixels *p, const Spot *s, double gain, double width2_px2, const Guess *at, int is_last,
               Normal *out)
{
    Four uu = {0}, uv = {0}, vv = {0}, uf = {0}, vf = {0}, ff = {0}, gu = {0}, gv = {0}, gf = {0};
    const double per_width2 = width2_px2 / (width2_px2 * width2_px2), norm = 1.0 / (2.0 * PI * width2_px2);
    Tile tile;
    Patch patch;
    double error[TILE], weight[TILE];
    for (int32_t begin = 0; begin < s->size; begin += TILE) {
        fill_tile(p, s, begin, at, &tile);
        gaussian_patch(per_width2, norm, tile.du, tile.dv, &patch);
        weigh(&tile, patch.unit, at->flux_dn, gain, is_last, error, weight);
        for (int i = 0; i < TILE; i += 4) {
            Four w, e, unit, d_u, d_v;
            load_four(&w, weight + i);
            load_four(&e, error + i);
            load_four(&unit, patch.unit + i);
            load_four(&d_u, patch.by_u + i);
            load_four(&d_v, patch.by_v + i);
            d_u *= at->flux_dn;
            d_v *= at->flux_dn;
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
        .matrix = {{total(&uu)}, {total(&uv), total(&vv)}, {total(&uf), total(&vf), total(&ff)}},
        .gradient = {total(&gu), total(&gv), total(&gf)},
    };
}
