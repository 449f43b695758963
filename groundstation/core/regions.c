/* Groups of neighbouring pixels above threshold (8-connected), with a border of one pixel.
 *
 * Rows are cut into runs of lit pixels; runs that touch are joined by union-find with the earliest run as root, so
 * groups are numbered by their first pixel in reading order. Border pixels that two groups claim go to the later one.
 */
#include "regions.h"

#include <string.h>

enum { BLOCK_PX = 16 };

/* Whether any pixel of a block is above threshold. */
static inline int is_any_lit(const uint16_t *restrict smooth, const uint16_t *restrict threshold)
{
    uint16_t any = 0;
    for (int k = 0; k < BLOCK_PX; k++) any |= (uint16_t)-(smooth[k] > threshold[k]);
    return any != 0;
}

/* Cut the lit pixels of a row into runs, the row's levels being in levels->row; 0 where there are too many. */
GS_CLONES
static int cut_row(const Levels *l, int32_t y, Regions *r)
{
    const uint16_t *smooth = l->smooth + (ptrdiff_t)y * l->width;
    Run *open = NULL;
    for (int32_t begin = 0; begin < l->width; begin += BLOCK_PX) {
        if (!is_any_lit(smooth + begin, l->row + begin)) {
            open = NULL;
            continue;
        }
        for (int32_t x = begin; x < begin + BLOCK_PX; x++) {
            if (smooth[x] <= l->row[x]) {
                open = NULL;
                continue;
            }
            if (++r->lit > r->max_lit) return 0;
            if (open == NULL) {
                open = r->run + r->runs;
                *open = (Run){.row = y, .first = x, .last = x, .parent = r->runs++};
            }
            open->last = x;
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
    const int32_t raw = p->pixel[y * p->stride + x], background = level_at(l, l->background, x, y);
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
static void collect_row(const Picture *p, const Levels *l, Regions *r, int32_t y)
{
    int32_t next[3], end[3];
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
        level_row(l, l->threshold, y);
        if (!cut_row(l, y, r)) return 0;
        r->row_run[y + 1] = r->runs;
        if (y > 0) join_rows(r, y);
    }
    number_groups(r);
    if (r->groups > MAX_GROUPS) return 0;
    for (int32_t y = 0; y < p->rows; y++) collect_row(p, l, r, y);
    return 1;
}
