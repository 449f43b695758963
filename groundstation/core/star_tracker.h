/* Star identification and pose: what its files share behind api.h. The first lines of a file name its oracle in NumPy. */
#ifndef GROUNDSTATION_STAR_TRACKER_H
#define GROUNDSTATION_STAR_TRACKER_H

#include "core.h"
#include "star_plane.h"

typedef struct {
    Point turn, shift_m;
    double covariance[9];
    int64_t kept;
} Pose;

/* Motion during one exposure, body axes. */
typedef struct {
    double turn_rad;
    Point path_m;
} Smear;

double kth_smallest(double *values, int64_t n, int64_t k);
double middle_value(double *values, int64_t n);

int solve_3x3(const double matrix[9], const double *right, int64_t columns, double *x, double *determinant);

void look_up_rays(const Rays *rays, int64_t n, const double *u_px, const double *v_px, Point *q, double *jacobian);

int smear_from_streaks(const SearchSettings *settings, int64_t n, const Point *q, const double *streak_px,
                       const double *jacobian, double *scratch, Smear *smear);
void unbend(int64_t n, const Point *q, Smear smear, Point *out);
void to_middle(const StarPicture *picture, const SearchSettings *settings, double picture_rows, const Point *q,
               Point turn, Point *out);

int refine_pose(const SearchSettings *settings, int64_t n, const Point *q, const Point *star, const double *weight,
                double *scratch, double *kept, Pose *pose);

double evidence_nats(const SearchSettings *settings, double density_m2, double volume, double scale_m_px, int64_t n,
                     const double *distance2_m2, double lever_m, int64_t spots);

/* The nearest star and the squared distance to it; the number of stars, and infinity, where none is near.
 *
 * Without branches, which nothing could predict: a search asks this for thousands of places at random. Written so that
 * NaN ends in the rim, whose cells are empty. */
static inline int64_t nearest_star(const Sky *sky, Point at, double *distance2)
{
    double column = (at.x - sky->x0_m) * sky->cells_per_m, row = (at.y - sky->y0_m) * sky->cells_per_m;
    const double last_column = (double)(sky->columns - 1), last_row = (double)(sky->rows - 1);
    column = column > 0.0 ? column : 0.0;
    row = row > 0.0 ? row : 0.0;
    column = column < last_column ? column : last_column;
    row = row < last_row ? row : last_row;
    const int64_t star = sky->raster[(int64_t)row * sky->columns + (int64_t)column];
    const Point off = sub(at, sky->star[star]);
    *distance2 = off.x * off.x + off.y * off.y;
    return star;
}

/* The best few poses of one look-up, by votes and then by order of arrival. */
enum { REFINED = 4, RIVALS = 16 };

typedef struct {
    Point turn, shift_m;
    int64_t votes;
} Candidate;

typedef struct {
    const Sky *sky;
    const Point *q;
    int64_t spots, room, offered, count;
    Candidate best[RIVALS];
} Ballot;

void offer_triangles(const SearchSettings *settings, int64_t group, double *scratch, int32_t *neighbour,
                     Ballot *ballot);
void offer_pairs(int64_t first, int64_t second, Ballot *ballot);

enum { CELL = 3 }; /* of poses: x, y, heading */

/* One picture's search: its buffers, what it may still cost, and which cells of poses it has tried. */
typedef struct {
    const Sky *sky;
    const Rays *rays;
    const SearchSettings *settings;
    StarPicture *picture;
    Point *q, *q_middle, *q_matched, *star_matched;
    double *jacobian, *weight, *kept, *distance2, *free;
    int32_t *spot, *star, *neighbour, *cell, *spot_of_star;
    int64_t look_ups_left, cells;
} SkySearch;

SkySearch begin_search(const Sky *sky, const Rays *rays, const SearchSettings *settings, StarPicture *picture);
void see_places(SkySearch *s, Point turn);

int settle(SkySearch *s, Candidate *candidate, double gate_m, int has_prior, double *nats);

#endif
