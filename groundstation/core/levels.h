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

/* A deviation from the background, and that background. */
typedef struct {
    int32_t deviation, level;
} Sample;

/* Levels are 81 times DN, like the smoothed picture. Buffers are the caller's. */
typedef struct {
    int32_t cells_down, cells_across;
    int32_t width;        /* of a row of `smooth`: columns, filled up to whole cells by zeros */
    uint16_t *smooth;     /* rows * width */
    uint16_t *brightest;  /* smoothed pixel of each cell: cells_down * cells_across */
    int16_t *means;       /* of cells, with a border: padded_cells_down * padded_cells_across */
    uint16_t *background; /* median of 5x5 cells: cells_down * cells_across */
    uint16_t *threshold;  /* the same size */
    int32_t *blend;       /* one row between two rows of cells: cells_across + 1 */
    uint16_t *sums;       /* one row of sums over rows, two spare pixels at each end: columns + 4 */
    uint16_t *tops;       /* brightest pixel of each column of a row of cells: width */
    Sample *samples;      /* count_samples */
    uint32_t *histogram;  /* MAX_LEVEL + 1 */
    double variance_floor_dn2, variance_slope_dn;
    double background_dn, noise_dn;
} Levels;

int32_t padded_cells_across(int32_t cells_across);
int32_t padded_cells_down(int32_t cells_down);
int32_t count_samples(int32_t rows, int32_t columns);

/* Smooth the picture, measure background, noise and threshold. */
void measure_levels(const Picture *picture, double threshold_sigmas, Levels *levels);

/* Interpolate a coarse grid to row y, into levels->blend: then level_at gives the level of its pixels. */
void blend_row(Levels *levels, const uint16_t *coarse, int32_t y);

/* The cell whose centre is before a pixel, and how many 32ths of the way to the next it lies. */
static inline void between_cells(int32_t pixel, int32_t cells, int32_t *cell, int32_t *part)
{
    const int32_t from_first = 2 * pixel - (CELL_PX - 1);
    const int32_t inside = from_first >= 0 && from_first >> 5 < cells - 1;
    *cell = inside ? from_first >> 5 : (from_first < 0 ? 0 : cells - 1);
    *part = inside ? from_first & 31 : 0;
}

/* 1024 times a level to a level, halves to even. */
static inline int32_t rounded_level(int32_t level1024) { return (level1024 + 511 + ((level1024 >> 10) & 1)) >> 10; }

/* The level at pixel x of the blended row. */
static inline int32_t level_at(const Levels *levels, int32_t x)
{
    int32_t cell, part;
    between_cells(x, levels->cells_across, &cell, &part);
    return rounded_level(levels->blend[cell] * (32 - part) + levels->blend[cell + 1] * part);
}

#endif
