/* The pose of least squares by Levenberg and Marquardt; in NumPy: tests/oracles/levenberg.py. */
#include "core.h"
#include "rotation.h"

#include <math.h>
#include <string.h>

enum { N = 6 };

typedef struct {
    const Pinhole *camera;
    const SeenPoint *seen;
    int32_t count;
    const RigidPose *mean;     /* of the prior, or NULL */
    const double *information; /* (6, 6) */
    const PoseSettings *settings;
} Problem;

static RigidPose moved(const RigidPose *pose, const double step[N])
{
    RigidPose found;
    double by[9];
    turn(step + 3, by);
    for (int i = 0; i < 3; i++) {
        found.position_m[i] = pose->position_m[i] + step[i];
        for (int j = 0; j < 3; j++) {
            double sum = 0.0;
            for (int k = 0; k < 3; k++) sum += by[3 * i + k] * pose->rotation[3 * k + j];
            found.rotation[3 * i + j] = sum;
        }
    }
    return found;
}

/* Add the prior's part to the normal equations; returns its part of the cost. */
static double add_prior(const Problem *problem, const RigidPose *pose, double normal[N][N], double right[N])
{
    if (!problem->mean) return 0.0;
    double off[N], cost = 0.0;
    for (int k = 0; k < 3; k++) off[k] = pose->position_m[k] - problem->mean->position_m[k];
    turn_between(pose->rotation, problem->mean->rotation, off + 3);
    for (int a = 0; a < N; a++) {
        double weighed = 0.0;
        for (int b = 0; b < N; b++) {
            weighed += problem->information[N * a + b] * off[b];
            normal[a][b] += problem->information[N * a + b];
        }
        right[a] -= weighed;
        cost += off[a] * weighed;
    }
    return cost;
}

/* Normal equations at a pose; returns the cost, infinite if a point lies behind the camera. */
static double equations(const Problem *problem, const RigidPose *pose, double normal[N][N], double right[N])
{
    double cost = 0.0;
    const double f = problem->camera->f_px, *r = pose->rotation;
    memset(normal, 0, sizeof(double) * N * N);
    memset(right, 0, sizeof(double) * N);
    for (int32_t n = 0; n < problem->count; n++) {
        const SeenPoint *seen = problem->seen + n;
        const double *p = seen->body_m;
        const double a = r[0] * p[0] + r[1] * p[1] + r[2] * p[2], b = r[3] * p[0] + r[4] * p[1] + r[5] * p[2];
        const double c = r[6] * p[0] + r[7] * p[1] + r[8] * p[2];
        const double x = a + pose->position_m[0], y = b + pose->position_m[1], z = c + pose->position_m[2];
        if (!(z > problem->settings->nearest_m)) return INFINITY;
        const double s = f / z, su = s * x / z, sv = s * y / z;
        const double raw[2][N] = {{s, 0.0, -su, -su * b, s * c + su * a, -s * b},
                                  {0.0, s, -sv, -s * c - sv * b, sv * a, s * a}};
        const double miss[2] = {seen->u_px - (f * x / z + problem->camera->cx_px),
                                seen->v_px - (f * y / z + problem->camera->cy_px)};
        for (int row = 0; row < 2; row++) {
            const double *w = seen->weight + 2 * row;
            double whole[N];
            const double off = w[0] * miss[0] + w[1] * miss[1];
            for (int k = 0; k < N; k++) whole[k] = w[0] * raw[0][k] + w[1] * raw[1][k];
            for (int i = 0; i < N; i++) {
                right[i] += whole[i] * off;
                for (int j = 0; j <= i; j++) normal[i][j] += whole[i] * whole[j];
            }
            cost += off * off;
        }
    }
    for (int i = 0; i < N; i++)
        for (int j = i + 1; j < N; j++) normal[i][j] = normal[j][i];
    return cost + add_prior(problem, pose, normal, right);
}

/* Lower Cholesky factor of a matrix with its diagonal damped; 0 if it is not positive. */
static int factorise(double normal[N][N], double damping, double factor[N][N])
{
    for (int j = 0; j < N; j++)
        for (int i = j; i < N; i++) {
            double sum = normal[i][j] * (i == j ? 1.0 + damping : 1.0);
            for (int k = 0; k < j; k++) sum -= factor[i][k] * factor[j][k];
            if (i > j) {
                factor[i][j] = sum / factor[j][j];
            } else if (sum > 0.0) {
                factor[j][j] = sqrt(sum);
            } else {
                return 0;
            }
        }
    return 1;
}

static void substitute(double factor[N][N], double x[N])
{
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < i; k++) x[i] -= factor[i][k] * x[k];
        x[i] /= factor[i][i];
    }
    for (int i = N - 1; i >= 0; i--) {
        for (int k = i + 1; k < N; k++) x[i] -= factor[k][i] * x[k];
        x[i] /= factor[i][i];
    }
}

static int finish(const Problem *problem, double normal[N][N], SolvedPose *found)
{
    double scale[N], scaled[N][N], factor[N][N];
    for (int i = 0; i < N; i++) scale[i] = 1.0 / sqrt(fmax(normal[i][i], 1e-300));
    for (int i = 0; i < N; i++)
        for (int j = 0; j < N; j++) scaled[i][j] = normal[i][j] * scale[i] * scale[j];
    if (!factorise(scaled, 0.0, factor)) return 0;
    for (int j = 0; j < N; j++) {
        double column[N] = {0.0};
        column[j] = 1.0;
        substitute(factor, column);
        if (!(column[j] < problem->settings->most_inflation)) return 0;
        for (int i = 0; i < N; i++) found->covariance[N * i + j] = column[i] * scale[i] * scale[j];
    }
    for (int i = 0; i < N; i++)
        for (int j = 0; j < i; j++) {
            const double mean = 0.5 * (found->covariance[N * i + j] + found->covariance[N * j + i]);
            found->covariance[N * i + j] = found->covariance[N * j + i] = mean;
        }
    return 1;
}

int32_t gs_solve_pose(const Pinhole *camera, const SeenPoint *seen, int32_t count, const RigidPose *mean,
                      const double *information, const PoseSettings *settings, SolvedPose *found)
{
    const Problem problem = {camera, seen, count, mean, information, settings};
    double normal[N][N], right[N], factor[N][N], damping = 0.0;
    found->cost = equations(&problem, &found->pose, normal, right);
    found->iterations = 0;
    if (!isfinite(found->cost)) return 0;
    for (int32_t round = 1; round <= settings->iterations; round++) {
        found->iterations = round;
        double step[N], gain = 0.0;
        memcpy(step, right, sizeof step);
        const int is_positive = factorise(normal, damping, factor);
        if (is_positive) {
            substitute(factor, step);
            for (int k = 0; k < N; k++) gain += right[k] * step[k];
            const RigidPose tried = moved(&found->pose, step);
            if (damping == 0.0 && gain < settings->rest) {
                found->pose = tried;
                return finish(&problem, normal, found);
            }
            double normal_tried[N][N], right_tried[N];
            const double cost = equations(&problem, &tried, normal_tried, right_tried);
            if (cost <= found->cost * (1.0 + 1e-12)) {
                const double drop = found->cost - cost, before = found->cost;
                damping = damping <= settings->first_damping ? 0.0 : 0.1 * damping;
                found->pose = tried;
                found->cost = cost;
                memcpy(normal, normal_tried, sizeof normal);
                memcpy(right, right_tried, sizeof right);
                if (drop <= 1e-12 * before && gain < 1e-3) return finish(&problem, normal, found);
                continue;
            }
        }
        damping = fmax(settings->first_damping, 10.0 * damping);
        if (damping > settings->most_damping) return is_positive && finish(&problem, normal, found);
    }
    return 0;
}
