/* Groups of neighbouring pixels above threshold, with a border of one pixel; see regions.c. */
#ifndef GROUNDSTATION_REGIONS_H
#define GROUNDSTATION_REGIONS_H

#include "levels.h"

/* Neighbouring lit pixels of one row. */
typedef struct {
    int32_t row, first, last;
    int32_t parent; /* a run of the same group, not after this one; later the number of the group */
} Run;

/* What is summed up over the pixels of a group; light is 81 times DN. */
typedef struct {
    int64_t light;
    int32_t peak;
    int32_t size;
    int32_t at_edge;
    int32_t place; /* among the kept ones, -1 for none */
} Group;

/* A pixel of a group. */
typedef struct {
    int32_t x, y;
    int32_t group;
    int32_t background;
    int32_t raw;
} GroupPixel;

typedef struct {
    int32_t max_lit;  /* with more lit pixels the picture is flooded; room for so many runs and groups */
    int32_t lit, runs, groups, pixels;
    int32_t bright_cells;
    int32_t *bright_cell; /* those of the present row of cells that may hold lit pixels: cells_across */
    Run *run;          /* max_lit */
    int32_t *row_run;  /* first run of each row: rows + 1 */
    Group *group;      /* max_lit */
    int32_t *row_group; /* group of each pixel of one row, zero where none: columns */
    GroupPixel *pixel; /* rows * columns */
} Regions;

enum { MAX_GROUPS = 20000 };

/* Find all groups and their pixels, in the order of their first pixel. Returns 0 where the picture is flooded. */
int find_regions(const Picture *picture, Levels *levels, Regions *regions);

#endif
