/* Light spots of a picture, from pixels to sub-pixel centres. */
#include "levels.h"
#include "regions.h"
#include "spot_fit.h"

#include <string.h>

typedef struct {
    Levels levels;
    Regions regions;
    SpotPixels pixels;
    Spot *spots;
    double *work;
    int32_t *order; /* of kept groups */
} Scratch;

/* Cut `bytes` off the scratch memory, 64-byte aligned; with base NULL only count. */
static void *cut(uint8_t *base, size_t *used, size_t bytes)
{
    void *piece = base ? base + *used : NULL;
    *used += (bytes + 63) & ~(size_t)63;
    return piece;
}

static size_t lay_out(uint8_t *base, int32_t rows, int32_t columns, const DetectorSettings *settings, Scratch *s)
{
    size_t used = 0;
    const size_t pixels = (size_t)rows * (size_t)columns, lit = (size_t)settings->max_lit + 1;
    const size_t spots = (size_t)settings->max_spots;
    Levels *l = &s->levels;
    Regions *r = &s->regions;
    SpotPixels *p = &s->pixels;
    l->cells_down = (rows + CELL_PX - 1) / CELL_PX;
    l->cells_across = (columns + CELL_PX - 1) / CELL_PX;
    l->width = l->cells_across * CELL_PX;
    const size_t cells = (size_t)l->cells_down * (size_t)l->cells_across;
    const size_t padded = (size_t)padded_cells_down(l->cells_down) * (size_t)padded_cells_across(l->cells_across);
    l->smooth = cut(base, &used, (size_t)rows * (size_t)l->width * sizeof *l->smooth);
    l->means = cut(base, &used, padded * sizeof *l->means);
    l->background = cut(base, &used, cells * sizeof *l->background);
    l->threshold = cut(base, &used, cells * sizeof *l->threshold);
    l->brightest = cut(base, &used, cells * sizeof *l->brightest);
    l->blend = cut(base, &used, ((size_t)l->cells_across + 1) * sizeof *l->blend);
    l->sums = cut(base, &used, ((size_t)columns + 4) * sizeof *l->sums);
    l->tops = cut(base, &used, (size_t)l->width * sizeof *l->tops);
    l->samples = cut(base, &used, (size_t)count_samples(rows, columns) * sizeof *l->samples);
    l->histogram = cut(base, &used, (MAX_LEVEL + 1) * sizeof *l->histogram);
    r->max_lit = settings->max_lit;
    r->bright_cell = cut(base, &used, (size_t)l->cells_across * sizeof *r->bright_cell);
    r->run = cut(base, &used, lit * sizeof *r->run);
    r->row_run = cut(base, &used, ((size_t)rows + 1) * sizeof *r->row_run);
    r->group = cut(base, &used, lit * sizeof *r->group);
    r->row_group = cut(base, &used, (size_t)columns * sizeof *r->row_group);
    r->pixel = cut(base, &used, pixels * sizeof *r->pixel);
    p->u_px = cut(base, &used, pixels * sizeof *p->u_px);
    p->v_px = cut(base, &used, pixels * sizeof *p->v_px);
    p->light_dn = cut(base, &used, pixels * sizeof *p->light_dn);
    p->variance_dn2 = cut(base, &used, pixels * sizeof *p->variance_dn2);
    p->usable = cut(base, &used, pixels * sizeof *p->usable);
    s->spots = cut(base, &used, spots * sizeof *s->spots);
    s->work = cut(base, &used, spots * sizeof *s->work);
    s->order = cut(base, &used, spots * sizeof *s->order);
    return used;
}

/* Whether group a is fainter than b; of equals the later one is. */
static int is_fainter(const Group *group, int32_t a, int32_t b)
{
    return group[a].light < group[b].light || (group[a].light == group[b].light && a > b);
}

/* Move the top of a heap, the faintest on top, down to its place. */
static void sift(const Group *group, int32_t *heap, int32_t size)
{
    const int32_t moved = heap[0];
    int32_t i = 0;
    for (int32_t child = 1; child < size; child = 2 * i + 1) {
        if (child + 1 < size && is_fainter(group, heap[child + 1], heap[child])) child++;
        if (!is_fainter(group, heap[child], moved)) break;
        heap[i] = heap[child];
        i = child;
    }
    heap[i] = moved;
}

/* Say which groups are spots, the brightest so many; count hot pixels and those cut by the edge.
 * Gives kept groups their place in reading order and returns how many. */
static int32_t judge(const DetectorSettings *settings, Scratch *s, DetectionSummary *said)
{
    Group *group = s->regions.group;
    int32_t kept = 0;
    for (int32_t i = 0; i < s->regions.groups; i++) {
        Group *g = group + i;
        g->place = -1;
        if ((double)g->peak > settings->hot_pixel_ratio * (double)g->light) {
            said->hot_pixels++;
        } else if (g->at_edge) {
            said->cut_by_edge++;
        } else if (g->light > 0 && settings->max_spots > 0) {
            g->place = 0;
            if (kept < settings->max_spots) { /* a heap, the faintest of the kept ones on top */
                int32_t k = kept++;
                for (; k > 0 && is_fainter(group, i, s->order[(k - 1) / 2]); k = (k - 1) / 2)
                    s->order[k] = s->order[(k - 1) / 2];
                s->order[k] = i;
            } else if (is_fainter(group, s->order[0], i)) {
                group[s->order[0]].place = -1;
                s->order[0] = i;
                sift(group, s->order, kept);
            } else {
                g->place = -1;
            }
        }
    }
    int32_t place = 0;
    for (int32_t i = 0; i < s->regions.groups; i++)
        if (group[i].place == 0) group[i].place = place++;
    return kept;
}

/* Bring the pixels of kept groups together, in reading order. */
static void gather(const DetectorSettings *settings, Scratch *s)
{
    const Regions *r = &s->regions;
    const Levels *l = &s->levels;
    SpotPixels *p = &s->pixels;
    int32_t first = 0;
    for (int32_t i = 0; i < r->groups; i++) {
        const Group *g = r->group + i;
        if (g->place < 0) continue;
        s->spots[g->place] = (Spot){.first = first, .size = 0};
        first += g->size;
    }
    for (int32_t i = 0; i < r->pixels; i++) {
        const GroupPixel *pixel = r->pixel + i;
        const int32_t place = r->group[pixel->group].place;
        if (place < 0) continue;
        Spot *spot = s->spots + place;
        const int32_t k = spot->first + spot->size++;
        const double background_dn = (double)pixel->background / KERNEL_SUM;
        p->u_px[k] = pixel->x;
        p->v_px[k] = pixel->y;
        p->light_dn[k] = (double)(KERNEL_SUM * pixel->raw - pixel->background) / KERNEL_SUM;
        p->variance_dn2[k] = l->variance_floor_dn2 + l->variance_slope_dn * background_dn;
        p->usable[k] = pixel->raw >= settings->saturation_dn ? 0.0 : 1.0;
    }
}

size_t gs_detect_scratch_bytes(int32_t rows, int32_t columns, const DetectorSettings *settings)
{
    Scratch s;
    return lay_out(NULL, rows, columns, settings, &s);
}

int32_t gs_detect(const uint8_t *image, ptrdiff_t stride, int32_t rows, int32_t columns,
                            const DetectorSettings *settings, uint8_t *scratch, FittedSpot *fitted,
                            DetectionSummary *said)
{
    const Picture picture = {.pixel = image, .stride = stride, .rows = rows, .columns = columns};
    Scratch s;
    lay_out(scratch, rows, columns, settings, &s);
    memset(s.regions.row_group, 0, (size_t)columns * sizeof *s.regions.row_group);
    measure_levels(&picture, settings->threshold_sigmas, &s.levels);
    *said = (DetectionSummary){.background_dn = s.levels.background_dn, .noise_dn = s.levels.noise_dn};
    if (!find_regions(&picture, &s.levels, &s.regions)) {
        said->is_flooded = 1;
        return 0;
    }
    const int32_t count = judge(settings, &s, said);
    gather(settings, &s);
    fit_spots(&s.pixels, settings->gain_dn_per_electron, s.spots, count, s.work, fitted);
    return count;
}
