/* Background, noise and threshold of a picture; see levels.c. */
#ifndef GROUNDSTATION_LEVELS_H
#define GROUNDSTATION_LEVELS_H

#include "core.h"

enum {
    CELL_PX = 16,
    KERNEL_SUM = 81,         /* of the smoothing kernel: per axis 1+2+3+2+1 = 9 */
    KERNEL_SQUARE_SUM = 361, /* per axis 1+4+9+4+1 = 19 */
    MAX_LEVEL = 81 * 255,
};

/* A grey picture; rows may lie apart. */
typedef struct {
    const uint8_t *pixel;
    ptrdiff_t stride;
    int32_t rows, columns;
} Picture;

/* Levels are 81 times DN, like the smoothed picture. Buffers are the caller's. */
typedef struct {
    int32_t cells_down, cells_across;
    int32_t width;        /* of a row of `smooth`: columns, filled up to whole cells by zeros */
    uint16_t *smooth;     /* rows * width */
    int16_t *means;       /* of cells, with a border: padded_cells_down * padded_cells_across */
    uint16_t *background; /* median of 5x5 cells: cells_down * cells_across */
    uint16_t *threshold;  /* the same size */
    uint16_t *row;        /* one interpolated row: width */
    int32_t *blend;       /* one row of cells: cells_across + 1 */
    uint16_t *sums;       /* one row of sums over rows, two spare pixels at each end: columns + 4 */
    uint32_t *histogram;  /* MAX_LEVEL + 1 */
    double variance_floor_dn2, variance_slope_dn;
    double background_dn, noise_dn;
} Levels;

int32_t padded_cells_across(int32_t cells_across);
int32_t padded_cells_down(int32_t cells_down);

/* Smooth the picture, measure background, noise and threshold. */
void measure_levels(const Picture *picture, double threshold_sigmas, Levels *levels);

/* Interpolate row y of a coarse grid into levels->row: one level per pixel. */
void level_row(Levels *levels, const uint16_t *coarse, int32_t y);

/* The level at one pixel, the same as level_row gives. */
uint16_t level_at(const Levels *levels, const uint16_t *coarse, int32_t x, int32_t y);

#endif
