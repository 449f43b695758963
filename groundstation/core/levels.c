/* Background, noise and threshold of a picture; in NumPy: tests/oracles/background.py.
 *
 * All in whole numbers up to the noise line, so that both give the same ones.
 */
#include "levels.h"

#include <math.h>
#include <string.h>

enum { REACH = 2, LANES = 32 }; /* of the median: cells to each side; cells at once */
enum { THIN_ROWS = 7, THIN_COLUMNS = 11, THIN_FIRST = 2 };

static const double MIN_VARIANCE_DN2 = 1.0 / 12.0; /* an 8-bit picture is never better than its rounding */
static const double SIGMA_OF_MEDIAN = 1.4826;      /* standard deviation over median deviation of a normal */

static int32_t min32(int32_t a, int32_t b) { return a < b ? a : b; }

int32_t padded_cells_across(int32_t cells_across) { return cells_across + 2 * REACH + LANES; }

int32_t padded_cells_down(int32_t cells_down) { return cells_down + 2 * REACH; }

int32_t count_samples(int32_t rows, int32_t columns) { return (rows / THIN_ROWS + 1) * (columns / THIN_COLUMNS + 1); }

/* Mirror an index at the border, the border pixel not doubled: -1 is 1. */
static int32_t mirrored(int32_t i, int32_t n)
{
    if (i < 0) return -i;
    return i < n ? i : 2 * n - 2 - i;
}

static void top_of_cells(const uint16_t *tops, int32_t cells, uint16_t *brightest)
{
    for (int32_t i = 0; i < cells; i++) {
        uint16_t top = 0;
        for (const uint16_t *column = tops + i * CELL_PX; column < tops + (i + 1) * CELL_PX; column++)
            top = *column > top ? *column : top;
        brightest[i] = top;
    }
}

/* Smooth by weights 1 2 3 2 1 along columns and rows: two 3x3 box sums. */
GS_CLONES
static void smooth_picture(const Picture *p, Levels *l)
{
    const int32_t n = p->columns;
    for (int32_t y = 0; y < p->rows; y++) {
        const uint8_t *restrict a = p->pixel + mirrored(y - 2, p->rows) * p->stride;
        const uint8_t *restrict b = p->pixel + mirrored(y - 1, p->rows) * p->stride;
        const uint8_t *restrict c = p->pixel + y * p->stride;
        const uint8_t *restrict d = p->pixel + mirrored(y + 1, p->rows) * p->stride;
        const uint8_t *restrict e = p->pixel + mirrored(y + 2, p->rows) * p->stride;
        uint16_t *restrict t = l->sums + 2;
        for (int32_t x = 0; x < n; x++) t[x] = (uint16_t)(a[x] + e[x] + 2 * (b[x] + d[x]) + 3 * c[x]);
        t[-1] = t[1];
        t[-2] = t[2];
        t[n] = t[n - 2];
        t[n + 1] = t[n - 3];
        uint16_t *restrict out = l->smooth + (ptrdiff_t)y * l->width, *restrict tops = l->tops;
        if (y % CELL_PX == 0) memset(tops, 0, (size_t)l->width * sizeof *tops);
        for (int32_t x = 0; x < n; x++) {
            const uint16_t sum = (uint16_t)(t[x - 2] + t[x + 2] + 2 * (t[x - 1] + t[x + 1]) + 3 * t[x]);
            out[x] = sum;
            tops[x] = tops[x] > sum ? tops[x] : sum;
        }
        for (int32_t x = n; x < l->width; x++) out[x] = 0;
        if (y % CELL_PX == CELL_PX - 1 || y == p->rows - 1)
            top_of_cells(tops, l->cells_across, l->brightest + y / CELL_PX * l->cells_across);
    }
}

/* Mean of each cell; the last cells of a row and column reach back to be whole. Two cells are repeated at each border. */
GS_CLONES
static void mean_cells(const Picture *p, Levels *l)
{
    const int32_t width = padded_cells_across(l->cells_across), down = l->cells_down, across = l->cells_across;
    for (int32_t j = 0; j < down; j++) {
        const int32_t top = min32(j * CELL_PX, p->rows - CELL_PX);
        uint16_t *restrict t = l->sums;
        memset(t, 0, (size_t)p->columns * sizeof *t);
        for (int32_t y = top; y < top + CELL_PX; y++) {
            const uint8_t *restrict line = p->pixel + y * p->stride;
            for (int32_t x = 0; x < p->columns; x++) t[x] = (uint16_t)(t[x] + line[x]);
        }
        int16_t *means = l->means + (j + REACH) * width + REACH;
        for (int32_t i = 0; i < across; i++) {
            const uint16_t *cell = t + min32(i * CELL_PX, p->columns - CELL_PX);
            uint32_t sum = 0;
            for (int32_t x = 0; x < CELL_PX; x++) sum += cell[x];
            means[i] = (int16_t)((KERNEL_SUM * sum + 128u) / 256u);
        }
        for (int32_t i = 1; i <= REACH; i++) {
            means[-i] = means[0];
            means[across - 1 + i] = means[across - 1];
        }
    }
    const size_t line = (size_t)width * sizeof *l->means;
    for (int32_t j = 0; j < REACH; j++) {
        memcpy(l->means + j * width, l->means + REACH * width, line);
        memcpy(l->means + (REACH + down + j) * width, l->means + (REACH + down - 1) * width, line);
    }
}

/* Put the lesser values into a, the greater into b. */
GS_INLINE void exchange(int16_t *restrict a, int16_t *restrict b)
{
    for (int k = 0; k < LANES; k++) {
        const int16_t low = a[k] < b[k] ? a[k] : b[k], high = a[k] < b[k] ? b[k] : a[k];
        a[k] = low;
        b[k] = high;
    }
}

/* Median of 25 for LANES cells at once, into value[1]: of 14 values neither the least nor the greatest is the
 * median of all 25, so both are forgotten and one more is looked at, and so on. */
GS_INLINE void median_of_25(int16_t value[25][LANES])
{
    for (int size = 14, next = 14;; size--, next++) {
        for (int i = 0; i < size / 2; i++) exchange(value[i], value[size - 1 - i]);
        for (int i = 1; i <= (size - 1) / 2; i++) exchange(value[0], value[i]);
        for (int i = size / 2; i < size - 1; i++) exchange(value[i], value[size - 1]);
        if (size == 3) return;
        memcpy(value[0], value[next], sizeof value[0]);
    }
}

/* Median of 5x5 cells: a star in a cell does not lift it. */
GS_CLONES
static void median_cells(Levels *l)
{
    const int32_t width = padded_cells_across(l->cells_across);
    int16_t near[25][LANES];
    for (int32_t j = 0; j < l->cells_down; j++)
        for (int32_t i = 0; i < l->cells_across; i += LANES) {
            for (int k = 0; k < 25; k++)
                memcpy(near[k], l->means + (j + k / 5) * width + i + k % 5, sizeof near[k]);
            median_of_25(near);
            const int32_t left = min32(LANES, l->cells_across - i);
            memcpy(l->background + j * l->cells_across + i, near[1], (size_t)left * sizeof near[1][0]);
        }
}

void blend_row(Levels *l, const uint16_t *coarse, int32_t y)
{
    int32_t cell, part;
    between_cells(y, l->cells_down, &cell, &part);
    const uint16_t *restrict above = coarse + cell * l->cells_across;
    const uint16_t *restrict below = coarse + min32(cell + 1, l->cells_down - 1) * l->cells_across;
    int32_t *restrict blend = l->blend;
    for (int32_t i = 0; i < l->cells_across; i++) blend[i] = above[i] * (32 - part) + below[i] * part;
    blend[l->cells_across] = 0; /* read with weight zero */
}

/* The value that `rank` of the counted ones lie below. */
static int32_t ranked(const uint32_t *histogram, uint32_t rank)
{
    uint32_t below = 0;
    for (int32_t value = 0;; value++) {
        below += histogram[value];
        if (below > rank) return value;
    }
}

/* Fit pixel variance = floor + slope * background (DN) to a thinned sample, stars clipped away.
 * Sums of whole numbers below 2^53 are exact in double precision, whatever their order. */
static void fit_noise_line(const Picture *p, Levels *l)
{
    uint32_t samples = 0;
    memset(l->histogram, 0, (MAX_LEVEL + 1) * sizeof *l->histogram);
    for (int32_t y = THIN_FIRST; y < p->rows; y += THIN_ROWS) {
        blend_row(l, l->background, y);
        const uint16_t *line = l->smooth + (ptrdiff_t)y * l->width;
        for (int32_t x = THIN_FIRST; x < p->columns; x += THIN_COLUMNS) {
            const int32_t level = level_at(l, x), size = line[x] < level ? level - line[x] : line[x] - level;
            l->histogram[size]++;
            l->samples[samples++] = (Sample){.deviation = size, .level = level};
        }
    }
    const double limit = fmax(4.0 * (SIGMA_OF_MEDIAN * ranked(l->histogram, samples / 2)), 1.0);
    double count = 0.0, sum_x = 0.0, sum_y = 0.0, sum_xx = 0.0, sum_xy = 0.0;
    for (uint32_t i = 0; i < samples; i++) {
        if (l->samples[i].deviation > limit) continue;
        const double level = l->samples[i].level, square = (double)l->samples[i].deviation * l->samples[i].deviation;
        count += 1.0;
        sum_x += level;
        sum_y += square;
        sum_xx += level * level;
        sum_xy += level * square;
    }
    const double centre = sum_x / count / KERNEL_SUM, total = sum_y / count / KERNEL_SQUARE_SUM;
    const double spread = (sum_xx - sum_x * sum_x / count) / (double)(KERNEL_SUM * KERNEL_SUM);
    const double common = (sum_xy - sum_x * sum_y / count) / (double)(KERNEL_SUM * KERNEL_SQUARE_SUM);
    double slope = spread > 1e-9 * count ? common / spread : 0.0;
    slope = fmin(fmax(slope, 0.0), total / fmax(centre, 1e-6)); /* both terms are physical: none below zero */
    l->variance_slope_dn = slope;
    l->variance_floor_dn2 = fmax(total - slope * centre, MIN_VARIANCE_DN2);
}

void measure_levels(const Picture *picture, double threshold_sigmas, Levels *l)
{
    const int32_t cells = l->cells_down * l->cells_across;
    smooth_picture(picture, l);
    mean_cells(picture, l);
    median_cells(l);
    fit_noise_line(picture, l);
    memset(l->histogram, 0, (MAX_LEVEL + 1) * sizeof *l->histogram);
    for (int32_t i = 0; i < cells; i++) {
        const double mean = l->background[i];
        const double variance = l->variance_floor_dn2 + l->variance_slope_dn * (mean / KERNEL_SUM);
        const double level = mean + threshold_sigmas * sqrt(KERNEL_SQUARE_SUM * variance);
        l->threshold[i] = (uint16_t)fmin(fmax(level, 0.0), 65535.0);
        l->histogram[l->background[i]]++;
    }
    l->background_dn = (double)ranked(l->histogram, (uint32_t)cells / 2) / KERNEL_SUM;
    l->noise_dn = sqrt(l->variance_floor_dn2 + l->variance_slope_dn * l->background_dn);
}
