/* Round spots fitted as disks with a soft edge, for relative navigation; in NumPy: tests/oracles/disk_fit.py. */
#include "core.h"

#include <math.h>
#include <string.h>

typedef struct {
    const uint8_t *image;
    ptrdiff_t stride;
    int32_t rows, columns, count;
    const RoughDisk *rough;
    const DiskSettings *settings;
} Scene;

/* Pixels of one spot: how far around its rough centre they go. */
typedef struct {
    int32_t left, right, top, bottom;
} Window;

static double clipped(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

static Window window_of(const Scene *scene, const RoughDisk *spot)
{
    const int32_t half = (int32_t)ceil(spot->radius_px + scene->settings->margin_px);
    const int32_t u = (int32_t)nearbyint(spot->u_px), v = (int32_t)nearbyint(spot->v_px);
    Window w = {u - half, u + half, v - half, v + half};
    if (w.left < 0) w.left = 0;
    if (w.top < 0) w.top = 0;
    if (w.right > scene->columns - 1) w.right = scene->columns - 1;
    if (w.bottom > scene->rows - 1) w.bottom = scene->rows - 1;
    return w;
}

/* Whether a pixel belongs to a spot: in reach of it, and nearer to its edge than to any other's. */
static int belongs(const Scene *scene, int32_t number, int32_t u, int32_t v)
{
    const RoughDisk *own = scene->rough + number;
    const double du = u - own->u_px, dv = v - own->v_px, reach = own->radius_px + scene->settings->margin_px;
    const double square = du * du + dv * dv;
    if (square > reach * reach) return 0;
    const double depth = sqrt(square) - own->radius_px;
    for (int32_t i = 0; i < scene->count; i++) {
        const RoughDisk *other = scene->rough + i;
        const double x = u - other->u_px, y = v - other->v_px, near = other->radius_px + depth;
        if (i != number && near >= 0.0 && x * x + y * y <= near * near) return 0;
    }
    return 1;
}

/* Sum of light, largest value and number of the pixels of a spot. */
static void measure(const Scene *scene, int32_t number, double *light, double *most)
{
    const Window w = window_of(scene, scene->rough + number);
    *light = 0.0;
    *most = 0.0;
    for (int32_t v = w.top; v <= w.bottom; v++)
        for (int32_t u = w.left; u <= w.right; u++) {
            if (!belongs(scene, number, u, v)) continue;
            const double value = scene->image[v * scene->stride + u] - scene->settings->level_dn;
            *light += value;
            if (value > *most) *most = value;
        }
}

/* Normal equations of a spot at its present parameters; returns the sum of squares, `used` pixels counted. */
static double equations(const Scene *scene, int32_t number, const double p[4], int is_large, double normal[4][4],
                        double right[4], int32_t *used)
{
    const DiskSettings *s = scene->settings;
    const Window w = window_of(scene, scene->rough + number);
    const int32_t side = is_large ? 1 : 2;
    const double first = is_large ? 0.0 : -0.25, edge = is_large ? s->large_edge_px : s->edge_px;
    const double share = 1.0 / (side * side);
    double squares = 0.0;
    memset(normal, 0, sizeof(double) * 16);
    memset(right, 0, sizeof(double) * 4);
    *used = 0;
    for (int32_t v = w.top; v <= w.bottom; v++)
        for (int32_t u = w.left; u <= w.right; u++) {
            if (!belongs(scene, number, u, v)) continue;
            double cover = 0.0, along_u = 0.0, along_v = 0.0, along_r = 0.0;
            for (int32_t i = 0; i < side; i++)
                for (int32_t j = 0; j < side; j++) {
                    const double x = u + first + 0.5 * j - p[0], y = v + first + 0.5 * i - p[1];
                    const double distance = sqrt(x * x + y * y + 1e-12);
                    const double deep = clipped((p[3] - distance) * (0.5 / edge) + 0.5, 0.0, 1.0);
                    const double square = deep * deep, slope = (deep - square) * (3.0 / edge);
                    cover += square * (3.0 - 2.0 * deep);
                    along_u += slope * x / distance;
                    along_v += slope * y / distance;
                    along_r += slope;
                }
            const double scale = share * p[2];
            const double row[4] = {scale * along_u, scale * along_v, share * cover, scale * along_r};
            const double off = scene->image[v * scene->stride + u] - s->level_dn - p[2] * row[2];
            for (int a = 0; a < 4; a++) {
                right[a] += row[a] * off;
                for (int b = 0; b <= a; b++) normal[a][b] += row[a] * row[b];
            }
            squares += off * off;
            ++*used;
        }
    for (int a = 0; a < 4; a++)
        for (int b = a + 1; b < 4; b++) normal[a][b] = normal[b][a];
    return squares;
}

/* Cholesky factor in place, lower; 0 if the matrix is not positive. */
static int factorise(double a[4][4])
{
    for (int j = 0; j < 4; j++) {
        for (int i = j; i < 4; i++) {
            double sum = a[i][j];
            for (int k = 0; k < j; k++) sum -= a[i][k] * a[j][k];
            if (i > j) {
                a[i][j] = sum / a[j][j];
            } else if (sum > 0.0) {
                a[j][j] = sqrt(sum);
            } else {
                return 0;
            }
        }
    }
    return 1;
}

static void substitute(double factor[4][4], double x[4])
{
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < i; k++) x[i] -= factor[i][k] * x[k];
        x[i] /= factor[i][i];
    }
    for (int i = 3; i >= 0; i--) {
        for (int k = i + 1; k < 4; k++) x[i] -= factor[k][i] * x[k];
        x[i] /= factor[i][i];
    }
}

static void fit(const Scene *scene, int32_t number, double p[4], int is_small, int is_large, FittedDisk *found)
{
    const DiskSettings *s = scene->settings;
    const double start = scene->rough[number].radius_px;
    double normal[4][4], right[4], squares = 0.0;
    int32_t used = 0;
    for (int32_t round = 0; round < s->iterations; round++) {
        squares = equations(scene, number, p, is_large, normal, right, &used);
        if (is_small) { /* its height is that of the others */
            for (int k = 0; k < 4; k++) normal[2][k] = normal[k][2] = 0.0;
            normal[2][2] = 1.0;
            right[2] = 0.0;
        }
        for (int k = 0; k < 4; k++) normal[k][k] = normal[k][k] * (1.0 + 1e-6) + 1e-9;
        if (!factorise(normal)) break;
        substitute(normal, right);
        p[0] += clipped(right[0], -0.7, 0.7);
        p[1] += clipped(right[1], -0.7, 0.7);
        p[2] = clipped(p[2] + right[2], s->noise_dn, 600.0);
        p[3] = clipped(p[3] + clipped(right[3], -0.5 * p[3], 0.5 * p[3]), 0.35, 2.0 * start + 1.0);
        if (fabs(right[0]) < s->rest_px && fabs(right[1]) < s->rest_px) break;
    }
    double column[4] = {1.0, 0.0, 0.0, 0.0}, other[4] = {0.0, 1.0, 0.0, 0.0};
    substitute(normal, column);
    substitute(normal, other);
    found->u_px = p[0];
    found->v_px = p[1];
    found->height_dn = p[2];
    found->radius_px = p[3];
    found->misfit = squares / (s->noise_dn * s->noise_dn * (used > 5 ? used - 4.0 : 1.0));
    found->spread_px2.uu = column[0];
    found->spread_px2.uv = column[1];
    found->spread_px2.vv = other[1];
}

void gs_fit_disks(const uint8_t *image, ptrdiff_t stride, int32_t rows, int32_t columns, const RoughDisk *rough,
                  int32_t count, const DiskSettings *settings, FittedDisk *found)
{
    const Scene scene = {image, stride, rows, columns, count, rough, settings};
    double common = settings->height_dn;
    for (int32_t i = 0; i < count; i++) {
        double *light = &found[i].misfit, *most = &found[i].height_dn; /* kept there until the fit */
        measure(&scene, i, light, most);
        if (*most < 3.0 * settings->noise_dn) *most = 3.0 * settings->noise_dn;
        if (settings->height_dn < 0.0 && rough[i].radius_px < settings->unresolved_px && *most > common) common = *most;
    }
    for (int32_t i = 0; i < count; i++) {
        const double light = found[i].misfit, most = found[i].height_dn;
        const int is_small = rough[i].radius_px < settings->unresolved_px;
        double p[4] = {rough[i].u_px, rough[i].v_px, most, rough[i].radius_px};
        if (is_small) {
            p[2] = fmax(common, most - 2.0 * settings->noise_dn);
            p[3] = sqrt(fmax(light / p[2], 0.2) / 3.14159265358979323846);
        }
        fit(&scene, i, p, is_small, rough[i].radius_px >= settings->large_px, found + i);
    }
}
