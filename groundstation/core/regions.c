/* Groups of neighbouring pixels above threshold (8-connected), with a border of one pixel.
 *
 * Rows are cut into runs of lit pixels; runs that touch are joined by union-find with the earliest run as root, so
 * groups are numbered by their first pixel in reading order. Border pixels that two groups claim go to the later one.
 */
#include "regions.h"

#include <string.h>

enum { HALF_PX = CELL_PX / 2 };

/* The least threshold in a cell: pixels lie between its centre and those of its neighbours. */
static uint16_t least_threshold(const Levels *l, int32_t i, int32_t j)
{
    uint16_t least = UINT16_MAX;
    for (int32_t row = j > 0 ? j - 1 : 0; row <= j + 1 && row < l->cells_down; row++)
        for (int32_t column = i > 0 ? i - 1 : 0; column <= i + 1 && column < l->cells_across; column++) {
            const uint16_t threshold = l->threshold[row * l->cells_across + column];
            least = threshold < least ? threshold : least;
        }
    return least;
}

/* List the cells of a row of cells that may hold lit pixels; few do. */
static void list_bright_cells(const Levels *l, int32_t j, Regions *r)
{
    r->bright_cells = 0;
    for (int32_t i = 0; i < l->cells_across; i++) {
        if (l->brightest[j * l->cells_across + i] > least_threshold(l, i, j)) r->bright_cell[r->bright_cells++] = i;
    }
}

/* Whether any of the pixels of half a cell is brighter than a level. */
static inline int is_any_brighter(const uint16_t *pixel, int32_t level)
{
    typedef int16_t Half __attribute__((vector_size(HALF_PX * sizeof(int16_t))));
    typedef int64_t Words __attribute__((vector_size(HALF_PX * sizeof(int16_t))));
    Half value; /* smoothed pixels are below 2^15 */
    memcpy(&value, pixel, sizeof value);
    const Words brighter = (Words)(value > (Half){0} + (int16_t)(level < INT16_MAX ? level : INT16_MAX));
    return (brighter[0] | brighter[1]) != 0;
}

/* Add the lit pixels of half a cell to the runs; 0 where there are too many. Between the centres of two cells, whose
 * thresholds times 32 are given, the threshold is a line; `part` is where on it the first pixel lies. */
static int cut_half_cell(const uint16_t *smooth, int32_t begin, int32_t y, const int32_t between[2], int32_t part,
                         Regions *r)
{
    int32_t level1024 = between[0] * (32 - part) + between[1] * part;
    const int32_t slope = 2 * (between[1] - between[0]);
    Run *open = r->runs > 0 ? r->run + r->runs - 1 : NULL;
    for (int32_t x = begin; x < begin + HALF_PX; x++, level1024 += slope) {
        if (smooth[x] <= rounded_level(level1024)) continue;
        if (++r->lit > r->max_lit) return 0;
        if (open == NULL || open->row != y || open->last != x - 1) {
            open = r->run + r->runs;
            *open = (Run){.row = y, .first = x, .last = x, .parent = r->runs++};
        }
        open->last = x;
    }
    return 1;
}

/* Cut the lit pixels of a row into runs; 0 where there are too many. */
static int cut_row(Levels *l, int32_t y, Regions *r)
{
    if (r->bright_cells == 0) return 1;
    const uint16_t *smooth = l->smooth + (ptrdiff_t)y * l->width;
    blend_row(l, l->threshold, y);
    for (int32_t i = 0; i < r->bright_cells; i++) {
        const int32_t cell = r->bright_cell[i];
        for (int32_t half = 0; half < 2; half++) {
            const int32_t begin = cell * CELL_PX + half * HALF_PX;
            const int32_t before = cell - 1 + half, left = before < 0 ? 0 : before;
            const int32_t right = before + 1 < l->cells_across ? before + 1 : before;
            const int32_t between[2] = {l->blend[left], l->blend[right]};
            const int32_t least = (between[0] < between[1] ? between[0] : between[1]) >> 5;
            if (!is_any_brighter(smooth + begin, least)) continue;
            if (!cut_half_cell(smooth, begin, y, between, half ? 1 : HALF_PX * 2 + 1, r)) return 0;
        }
    }
    return 1;
}

static int32_t root_of(Run *run, int32_t i)
{
    while (run[i].parent != i) {
        run[i].parent = run[run[i].parent].parent;
        i = run[i].parent;
    }
    return i;
}

/* Join the runs of a row with those of the row above that touch them, corners included. */
static void join_rows(Regions *r, int32_t y)
{
    int32_t above = r->row_run[y - 1];
    for (int32_t i = r->row_run[y]; i < r->row_run[y + 1]; i++) {
        while (above < r->row_run[y] && r->run[above].last < r->run[i].first - 1) above++;
        for (int32_t k = above; k < r->row_run[y] && r->run[k].first <= r->run[i].last + 1; k++) {
            const int32_t a = root_of(r->run, k), b = root_of(r->run, i);
            if (a < b)
                r->run[b].parent = a;
            else
                r->run[a].parent = b;
        }
    }
}

/* Replace each run's parent by the number of its group. A root comes before all runs of its group. */
static void number_groups(Regions *r)
{
    r->groups = 0;
    for (int32_t i = 0; i < r->runs; i++) {
        const int32_t parent = r->run[i].parent;
        r->run[i].parent = parent == i ? r->groups++ : r->run[parent].parent;
    }
    memset(r->group, 0, (size_t)r->groups * sizeof *r->group);
}

static void add_pixel(const Picture *p, const Levels *l, Regions *r, int32_t x, int32_t y)
{
    const int32_t number = r->row_group[x] - 1;
    const int32_t raw = p->pixel[y * p->stride + x], background = level_at(l, x);
    const int32_t light = KERNEL_SUM * raw - background;
    Group *group = r->group + number;
    group->peak = group->size == 0 || light > group->peak ? light : group->peak;
    group->light += light;
    group->size++;
    group->at_edge |= x == 0 || y == 0 || x == p->columns - 1 || y == p->rows - 1;
    r->pixel[r->pixels++] = (GroupPixel){.x = x, .y = y, .group = number, .background = background, .raw = raw};
    r->row_group[x] = 0;
}

/* Collect the pixels of one row: those in or beside a run of this row or its neighbours. */
static void collect_row(const Picture *p, Levels *l, Regions *r, int32_t y)
{
    if (r->row_run[y > 0 ? y - 1 : 0] == r->row_run[y + 2 < p->rows ? y + 2 : p->rows]) return;
    int32_t next[3], end[3];
    blend_row(l, l->background, y);
    for (int32_t k = 0; k < 3; k++) {
        const int32_t row = y + k - 1, inside = row >= 0 && row < p->rows;
        next[k] = inside ? r->row_run[row] : 0;
        end[k] = inside ? r->row_run[row + 1] : 0;
        for (int32_t i = next[k]; i < end[k]; i++) {
            const Run *run = r->run + i;
            const int32_t last = run->last + 1 < p->columns ? run->last + 1 : p->columns - 1;
            for (int32_t x = run->first > 0 ? run->first - 1 : 0; x <= last; x++)
                if (r->row_group[x] <= run->parent) r->row_group[x] = run->parent + 1;
        }
    }
    int32_t x = 0;
    for (;;) { /* the three rows' runs in the order of their first pixel */
        int32_t k = -1;
        for (int32_t row = 0; row < 3; row++)
            if (next[row] < end[row] && (k < 0 || r->run[next[row]].first < r->run[next[k]].first)) k = row;
        if (k < 0) return;
        const Run *run = r->run + next[k]++;
        x = x > run->first - 1 ? x : run->first - 1;
        for (; x <= run->last + 1 && x < p->columns; x++) add_pixel(p, l, r, x, y);
    }
}

int find_regions(const Picture *p, Levels *l, Regions *r)
{
    r->lit = r->runs = r->groups = r->pixels = 0;
    for (int32_t y = 0; y < p->rows; y++) {
        r->row_run[y] = r->runs;
        if (y % CELL_PX == 0) list_bright_cells(l, y / CELL_PX, r);
        if (!cut_row(l, y, r)) return 0;
        r->row_run[y + 1] = r->runs;
        if (y > 0) join_rows(r, y);
    }
    number_groups(r);
    if (r->groups > MAX_GROUPS) return 0;
    for (int32_t y = 0; y < p->rows; y++) collect_row(p, l, r, y);
    return 1;
}
