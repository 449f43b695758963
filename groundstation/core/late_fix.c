/* What a late fix does to state and covariance besides the stretch before it (carry.c): the look at the learned surface,
 * the correction, and the sigmas for the time after it. The formulas are explained in
 * fusion/learned_surface.py and tests/oracles/late_fix.py.
 */
#include "core.h"

#include <math.h>
#include <string.h>

/* Covariance (2, 2m) of the slope at a place with those of the nodes, in units of sigma^2. */
static void covariance_with_nodes(const double *nodes, int64_t m, double length, double x, double y, double k[2][2 * MAX_NODES]) {
    for (int64_t i = 0; i < m; i++) {
        const double dx = (x - nodes[2 * i]) / length, dy = (y - nodes[2 * i + 1]) / length;
        const double near = exp(-0.5 * (dx * dx + dy * dy));
        k[0][2 * i] = (1.0 - dx * dx) * near;
        k[1][2 * i + 1] = (1.0 - dy * dy) * near;
        k[0][2 * i + 1] = k[1][2 * i] = -dx * dy * near;
    }
}

int gs_surface_look(const double *nodes, const double *inverse, int64_t m, double length, double place_x,
                              double place_y, double variance, double unknown_share, double *x, double *P, double *w) {
    double k[2][2 * MAX_NODES], left[2][2] = {{1.0, 0.0}, {0.0, 1.0}};
    const int64_t nodes2 = 2 * m, n = SIZE + nodes2;
    if (m > MAX_NODES) return 0;
    covariance_with_nodes(nodes, m, length, place_x, place_y, k);
    memset(w, 0, sizeof(double) * (size_t)(2 * nodes2));
    for (int a = 0; a < 2; a++)
        for (int64_t i = 0; i < nodes2; i++)
            for (int64_t j = 0; j < nodes2; j++) w[a * nodes2 + j] += k[a][i] * inverse[i * nodes2 + j];
    for (int a = 0; a < 2; a++)
        for (int b = 0; b < 2; b++)
            for (int64_t j = 0; j < nodes2; j++) left[a][b] -= w[a * nodes2 + j] * k[b][j];
    if (!(0.5 * (left[0][0] + left[1][1]) <= unknown_share)) return 0;
    double cross[2][SIZE + 2 * MAX_NODES];
    memset(cross, 0, sizeof cross);
    for (int a = 0; a < 2; a++) {
        double slope = 0.0;
        for (int64_t i = 0; i < nodes2; i++) {
            const double weight = w[a * nodes2 + i], *row = P + (SIZE + i) * n;
            slope += weight * x[SIZE + i];
            for (int64_t j = 0; j < n; j++) cross[a][j] += weight * row[j];
        }
        x[WAVE_X + a] = slope;
    }
    for (int a = 0; a < 2; a++)
        for (int64_t j = 0; j < n; j++) P[(WAVE_X + a) * n + j] = P[j * n + WAVE_X + a] = cross[a][j];
    for (int a = 0; a < 2; a++) {
        for (int b = 0; b < 2; b++) {
            double sum = variance * left[a][b];
            for (int64_t j = 0; j < nodes2; j++) sum += cross[a][SIZE + j] * w[b * nodes2 + j];
            P[(WAVE_X + a) * n + WAVE_X + b] = sum;
        }
    }
    return 1;
}

void gs_surface_slope(const double *nodes, const double *inverse, int64_t m, double length, double place_x,
                                double place_y, const double *at_nodes, double *slope) {
    double k[2][2 * MAX_NODES];
    slope[0] = slope[1] = 0.0;
    if (m > MAX_NODES) return;
    covariance_with_nodes(nodes, m, length, place_x, place_y, k);
    for (int64_t i = 0; i < 2 * m; i++) {
        double pull = 0.0;
        for (int64_t j = 0; j < 2 * m; j++) pull += inverse[i * 2 * m + j] * at_nodes[j];
        slope[0] += k[0][i] * pull;
        slope[1] += k[1][i] * pull;
    }
}

/* Inverse of a symmetric positive 3 x 3 matrix by its cofactors. */
static void invert(const double S[3][3], double W[3][3]) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            W[i][j] = S[a][c] * S[b][d] - S[a][d] * S[b][c];
        }
    }
    const double determinant = S[0][0] * W[0][0] + S[0][1] * W[1][0] + S[0][2] * W[2][0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) W[i][j] /= determinant;
}

double gs_correct(double *x, double *P, int64_t n, const double *z, const double *H, double *S, double gate,
                            double *weight, double *K) {
    double PH[SIZE + 2 * MAX_NODES][3], SW[3][3], W[3][3];
    for (int64_t i = 0; i < n; i++) {
        for (int a = 0; a < 3; a++) {
            double sum = 0.0;
            for (int j = 0; j < SIZE; j++) sum += P[i * n + j] * H[a * SIZE + j];
            PH[i][a] = sum;
        }
    }
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++) {
            double sum = S[3 * a + b];
            for (int j = 0; j < SIZE; j++) sum += H[a * SIZE + j] * PH[j][b];
            SW[a][b] = S[3 * a + b] = sum;
        }
    }
    invert((const double(*)[3])SW, W);
    double nis = 0.0;
    for (int a = 0; a < 3; a++) {
        for (int b = 0; b < 3; b++) {
            weight[3 * a + b] = W[a][b];
            nis += z[a] * W[a][b] * z[b];
        }
    }
    if (!(nis <= gate)) return nis;
    for (int64_t i = 0; i < n; i++) {
        for (int a = 0; a < 3; a++) {
            const double gain = PH[i][0] * W[0][a] + PH[i][1] * W[1][a] + PH[i][2] * W[2][a];
            K[3 * i + a] = gain;
            x[i] += gain * z[a];
        }
    }
    /* K S K' = K (P H')', and symmetric */
    for (int64_t i = 0; i < n; i++) {
        const double *gain = K + 3 * i;
        for (int64_t j = 0; j <= i; j++) {
            const double gone = gain[0] * PH[j][0] + gain[1] * PH[j][1] + gain[2] * PH[j][2];
            P[i * n + j] = P[j * n + i] = 0.5 * (P[i * n + j] + P[j * n + i]) - gone;
        }
    }
    return nis;
}

void gs_variance_in_time(const double *x, const double *P, int64_t n, double acc_density, double gyro_density,
                                   double *out) {
    enum { TERMS = 4 };
    const double c = cos(x[THETA]), s = sin(x[THETA]), rx = x[LEVER_X], ry = x[LEVER_Y];
    const double lx = c * rx - s * ry, ly = s * rx + c * ry, white = acc_density * acc_density / 3.0;
    const double at[2][TERMS] = {{1.0, ly, -c, s}, {1.0, -lx, -s, -c}};
    const int at_state[2][TERMS] = {{PX, THETA, LEVER_X, LEVER_Y}, {PY, THETA, LEVER_X, LEVER_Y}};
    const double pull[2][TERMS] = {{-c, s, 1.0, 1.0}, {-s, -c, 1.0, 1.0}};
    const int pull_state[2][TERMS] = {{ACC_BIAS_X, ACC_BIAS_Y, SLOPE_X, WAVE_X}, {ACC_BIAS_X, ACC_BIAS_Y, SLOPE_Y, WAVE_Y}};
    for (int k = 0; k < 2; k++) {
        const int v = VX + k;
        double pp = 0.0, pv = 0.0, pa = 0.0, va = 0.0, aa = 0.0;
        for (int i = 0; i < TERMS; i++) {
            pv += at[k][i] * P[at_state[k][i] * n + v];
            va += pull[k][i] * P[pull_state[k][i] * n + v];
            for (int j = 0; j < TERMS; j++) {
                pp += at[k][i] * at[k][j] * P[at_state[k][i] * n + at_state[k][j]];
                pa += at[k][i] * pull[k][j] * P[at_state[k][i] * n + pull_state[k][j]];
                aa += pull[k][i] * pull[k][j] * P[pull_state[k][i] * n + pull_state[k][j]];
            }
        }
        double *of = out + 5 * k;
        of[0] = pp, of[1] = 2.0 * pv, of[2] = P[v * n + v] + pa, of[3] = va + white, of[4] = aa / 4.0;
    }
    out[10] = P[THETA * n + THETA];
    out[11] = gyro_density * gyro_density - 2.0 * P[THETA * n + GYRO_BIAS];
    out[12] = P[GYRO_BIAS * n + GYRO_BIAS];
}
