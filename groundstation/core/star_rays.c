/* From pixels to the ceiling by table (rays.CeilingRays.look_up). */
#include "star_tracker.h"

static int64_t entry_of(double pixel, double step_px, int64_t count)
{
    const double entry = rint(pixel / step_px);
    if (!(entry > 0.0)) { /* NaN too */
        return 0;
    }
    return entry < (double)(count - 1) ? (int64_t)entry : count - 1;
}

/* Points q and derivatives (n, 4) of q by (u, v): a first-order step from the nearest entry of the table. */
void look_up_rays(const Rays *rays, int64_t n, const double *u_px, const double *v_px, Point *q, double *jacobian)
{
    for (int64_t i = 0; i < n; i++) {
        const int64_t column = entry_of(u_px[i], rays->step_px, rays->columns);
        const int64_t row = entry_of(v_px[i], rays->step_px, rays->rows);
        const double *entry = rays->table + 6 * (row * rays->columns + column);
        const double du = u_px[i] - rays->step_px * (double)column, dv = v_px[i] - rays->step_px * (double)row;
        q[i].x = entry[0] + entry[2] * du + entry[3] * dv;
        q[i].y = entry[1] + entry[4] * du + entry[5] * dv;
        for (int k = 0; k < 4; k++) {
            jacobian[4 * i + k] = entry[2 + k];
        }
    }
}
