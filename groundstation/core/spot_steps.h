/* Gauss-Newton steps of one spot, over tiles of its pixels: what round_fit.c and streak_fit.c share. */
#ifndef GROUNDSTATION_SPOT_STEPS_H
#define GROUNDSTATION_SPOT_STEPS_H

#include "gaussian.h"
#include "spot_fit.h"

#include <math.h>
#include <string.h>

enum { TILE = 32 };

enum { AT_U, AT_V, AT_FLUX, AT_HALF, AT_ACROSS, UNKNOWNS }; /* of a round spot the first three */

static const double ROOT_2PI = 2.50662827463100050242;
static const double OUTLIER_SIGMAS = 5.0;
static const double MISFIT_RATIO = 0.3; /* the true image is no Gaussian: so much of the model is no outlier */

/* Some pixels of a spot, the last ones repeated with weight zero. */
typedef struct {
    double du[TILE], dv[TILE], light[TILE], floor[TILE], usable[TILE];
} Tile;

/* Four sums side by side: one order of addition, whatever the width of the machine's vectors. */
typedef double Four __attribute__((vector_size(4 * sizeof(double))));

/* Normal equations; of the symmetric matrix the lower triangle. */
typedef struct {
    double matrix[UNKNOWNS][UNKNOWNS], gradient[UNKNOWNS];
} Normal;

/* Where a fit stands: centre and light, and of a streak half its length and its direction. */
typedef struct {
    double u_px, v_px, flux_dn, half_px, angle_rad;
} Guess;

void sum_round(const SpotPixels *p, const Spot *s, double gain, double width2_px2, const Guess *at, int is_last,
               Normal *out);
void sum_streak(const SpotPixels *p, const Spot *s, double gain, double width_px, const Guess *at, int is_last,
                Normal *out);

GS_INLINE double larger(double a, double b) { return a > b ? a : b; }
GS_INLINE double smaller(double a, double b) { return a < b ? a : b; }
GS_INLINE double total(const Four *sums) { return ((*sums)[0] + (*sums)[1]) + ((*sums)[2] + (*sums)[3]); }
GS_INLINE void load_four(Four *four, const double *from) { memcpy(four, from, sizeof *four); }

GS_INLINE void fill_tile(const SpotPixels *p, const Spot *s, int32_t begin, const Guess *at, Tile *t)
{
    const int32_t left = s->size - begin, size = left < TILE ? left : TILE, first = s->first + begin;
    for (int32_t i = 0; i < size; i++) {
        t->du[i] = p->u_px[first + i] - at->u_px;
        t->dv[i] = p->v_px[first + i] - at->v_px;
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
GS_INLINE void weigh(const Tile *restrict t, const double *restrict unit, double flux, double gain, int is_last,
                     double *restrict error, double *restrict weight)
{
    for (int i = 0; i < TILE; i++) {
        const double model = flux * unit[i], misfit = MISFIT_RATIO * model;
        const double variance = t->floor[i] + gain * larger(model, 0.0);
        const double limit2 = OUTLIER_SIGMAS * OUTLIER_SIGMAS * variance + misfit * misfit;
        error[i] = t->light[i] - model;
        weight[i] = !is_last || error[i] * error[i] < limit2 ? t->usable[i] / variance : 0.0;
    }
}

#endif
