/* Sub-pixel centres of light spots; see spot_fit.c. */
#ifndef GROUNDSTATION_SPOT_FIT_H
#define GROUNDSTATION_SPOT_FIT_H

#include "core.h"

/* Pixels of all spots in one row, spot after spot. */
typedef struct {
    double *u_px, *v_px;
    double *light_dn;     /* above the background */
    double *variance_dn2; /* without the star's own shot noise */
    double *usable;       /* 0 where saturated, else 1 */
} SpotPixels;

typedef struct {
    int32_t first, size; /* its pixels */
    double u_px, v_px, flux_dn;
    Symmetric spread_px2, covariance_px2; /* second moments; covariance of the centre */
    double half_px, angle_rad;            /* of a streak, as its fit begins; half_px is 0 of a round spot */
} Spot;

/* Fit the centre and light of `count` spots whose first and size are given, brightest first into `fitted`;
 * `work` has room for `count` doubles. */
void fit_spots(const SpotPixels *pixels, double gain_dn_per_electron, Spot *spots, int32_t count, double *work,
               FittedSpot *fitted);

#endif
