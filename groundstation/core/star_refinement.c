/* The pose from matched stars (tests/oracles/refinement.py, where the model stands). */
#include <string.h>

#include "star_tracker.h"

/* Solve matrix x = right for some right-hand columns (3, columns) by elimination with pivots; 0 if it is singular. */
int solve_3x3(const double matrix[9], const double *right, int64_t columns, double *x, double *determinant)
{
    double a[3][3];
    memcpy(a, matrix, sizeof a);
    memmove(x, right, (size_t)(3 * columns) * sizeof *x);
    double product = 1.0;
    for (int k = 0; k < 3; k++) {
        int pivot = k;
        for (int i = k + 1; i < 3; i++) {
            pivot = fabs(a[i][k]) > fabs(a[pivot][k]) ? i : pivot;
        }
        if (!(fabs(a[pivot][k]) > 0.0) || !isfinite(a[pivot][k])) {
            return 0;
        }
        if (pivot != k) {
            for (int j = 0; j < 3; j++) {
                const double held = a[k][j];
                a[k][j] = a[pivot][j];
                a[pivot][j] = held;
            }
            for (int64_t c = 0; c < columns; c++) {
                const double held = x[k * columns + c];
                x[k * columns + c] = x[pivot * columns + c];
                x[pivot * columns + c] = held;
            }
            product = -product;
        }
        product *= a[k][k];
        for (int i = k + 1; i < 3; i++) {
            const double factor = a[i][k] / a[k][k];
            for (int j = k; j < 3; j++) {
                a[i][j] -= factor * a[k][j];
            }
            for (int64_t c = 0; c < columns; c++) {
                x[i * columns + c] -= factor * x[k * columns + c];
            }
        }
    }
    for (int k = 2; k >= 0; k--) {
        for (int64_t c = 0; c < columns; c++) {
            double sum = x[k * columns + c];
            for (int j = k + 1; j < 3; j++) {
                sum -= a[k][j] * x[j * columns + c];
            }
            x[k * columns + c] = sum / a[k][k];
        }
    }
    *determinant = product;
    return 1;
}

/* Drop residuals beyond the clip of the robust scale; give the variance scale of the rest. */
static double clip(const SearchSettings *settings, int64_t n, const double *distance2, double *sorted, double *kept)
{
    /* Of three unknowns n stars keep 2n - 3 degrees of freedom: small samples look better than they are. */
    const double freedom = fmax(2.0 * (double)n - 3.0, 1.0);
    memcpy(sorted, distance2, (size_t)n * sizeof *sorted);
    const double robust = middle_value(sorted, n) / 1.386 * (2.0 * (double)n / freedom);
    double limit = settings->clip_sigmas * settings->clip_sigmas * fmax(robust, 0.5) * 1.3;
    for (int attempt = 0;; attempt++) {
        double total = 0.0;
        int64_t count = 0;
        for (int64_t i = 0; i < n; i++) {
            const int keep = distance2[i] <= limit;
            kept[i] = keep;
            count += keep;
            total += keep ? distance2[i] : 0.0;
        }
        if (count >= 3 || attempt == 1) {
            const double left = fmax(2.0 * (double)count - 3.0, 0.0);
            return (settings->prior_freedom + total) / (settings->prior_freedom + left);
        }
        limit = kth_smallest(sorted, n, n - 1 < 2 ? n - 1 : 2);
    }
}

/* Sum the normal equations (3, 3) of the stars that are kept. */
static void sum_up(int64_t n, const double *normal, const double *kept, double information[9])
{
    double sum[6] = {0.0};
    for (int64_t i = 0; i < n; i++) {
        for (int k = 0; k < 6; k++) {
            sum[k] += kept[i] * normal[6 * i + k];
        }
    }
    const double full[9] = {sum[0], sum[1], sum[2], sum[1], sum[3], sum[4], sum[2], sum[4], sum[5]};
    memcpy(information, full, sizeof full);
}

/* Fit the pose, whose turn and shift are the first guess, to n matches with weights (n, 3: xx, xy, yy in body axes).
 *
 * Unknowns are a small motion of the body in its own axes: the error of a star is e = conj(turn) (star - shift) - q,
 * its derivative by (dx, dy, dheading) is [1 0 -q_y; 0 1 q_x]. Scratch holds 11 n; 0 if the equations are singular.
 */
int refine_pose(const SearchSettings *settings, int64_t n, const Point *q, const Point *star, const double *weight,
                double *scratch, double *kept, Pose *pose)
{
    double *normal = scratch, *turning = normal + 6 * n, *distance2 = turning + 2 * n, *sorted = distance2 + n;
    double *fresh = sorted + n, information[9], x[9], determinant;
    Point turn = pose->turn, shift_m = pose->shift_m;
    double scale2 = 1.0;
    for (int64_t i = 0; i < n; i++) {
        const double *w = weight + 3 * i;
        const double t0 = w[1] * q[i].x - w[0] * q[i].y, t1 = w[2] * q[i].x - w[1] * q[i].y;
        turning[2 * i] = t0;
        turning[2 * i + 1] = t1;
        const double row[6] = {w[0], w[1], t0, w[2], t1, q[i].x * t1 - q[i].y * t0};
        memcpy(normal + 6 * i, row, sizeof row);
        kept[i] = 1.0;
    }
    for (int64_t step = 0; step < settings->refine_steps; step++) {
        double gradient[3] = {0.0};
        for (int64_t i = 0; i < n; i++) {
            const double *w = weight + 3 * i;
            const Point e = sub(turned_back(turn, sub(star[i], shift_m)), q[i]);
            gradient[0] += kept[i] * (w[0] * e.x + w[1] * e.y);
            gradient[1] += kept[i] * (w[1] * e.x + w[2] * e.y);
            gradient[2] += kept[i] * (turning[2 * i] * e.x + turning[2 * i + 1] * e.y);
        }
        sum_up(n, normal, kept, information);
        if (!solve_3x3(information, gradient, 1, x, &determinant)) {
            return 0;
        }
        shift_m = add(shift_m, turned(turn, (Point){x[0], x[1]}));
        turn = turned(turn, unit_at(x[2]));
        for (int64_t i = 0; i < n; i++) {
            const double *w = weight + 3 * i;
            const Point e = sub(turned_back(turn, sub(star[i], shift_m)), q[i]);
            distance2[i] = w[0] * e.x * e.x + 2.0 * w[1] * e.x * e.y + w[2] * e.y * e.y;
        }
        scale2 = clip(settings, n, distance2, sorted, fresh);
        if (memcmp(fresh, kept, (size_t)n * sizeof *kept) == 0 && fabs(x[2]) < 1e-7) {
            break;
        }
        memcpy(kept, fresh, (size_t)n * sizeof *kept);
    }
    sum_up(n, normal, kept, information);
    static const double identity[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    if (!solve_3x3(information, identity, 3, x, &determinant)) {
        return 0;
    }
    /* From body axes to the table's: C' = R C R^T, kept symmetric. */
    const double c = turn.x, s = turn.y;
    const double xx = scale2 * x[0], xy = 0.5 * scale2 * (x[1] + x[3]), yy = scale2 * x[4], hh = scale2 * x[8];
    const double xh = 0.5 * scale2 * (x[2] + x[6]), yh = 0.5 * scale2 * (x[5] + x[7]);
    const double cross = c * s * (xx - yy) + (c * c - s * s) * xy;
    const double table[9] = {c * c * xx - 2.0 * c * s * xy + s * s * yy,
                             cross,
                             c * xh - s * yh,
                             cross,
                             s * s * xx + 2.0 * c * s * xy + c * c * yy,
                             s * xh + c * yh,
                             c * xh - s * yh,
                             s * xh + c * yh,
                             hh};
    memcpy(pose->covariance, table, sizeof table);
    pose->turn = turn;
    pose->shift_m = shift_m;
    pose->kept = 0;
    for (int64_t i = 0; i < n; i++) {
        pose->kept += kept[i] > 0.5;
    }
    return 1;
}
