/* Star identification and pose: what its files share. The NumPy twin of every file is named in its first lines.
 *
 * All structures are filled by star_tracking/compiled_search.py, once per tracker but for the picture. Lengths are of
 * the ceiling plane in m, angles in rad; q is a point of the ceiling in body axes, relative to the body's origin.
 */
#ifndef GROUNDSTATION_STAR_TRACKER_H
#define GROUNDSTATION_STAR_TRACKER_H

#include "core.h"
#include "star_plane.h"

/* Pixel to ceiling (rays.CeilingRays). */
typedef struct {
    const double *table; /* (rows, columns, 6): q_x, q_y and dq_x/du, dq_x/dv, dq_y/du, dq_y/dv */
    int64_t columns, rows;
    double step_px, picture_rows, scale_m_px, reach_m;
} Rays;

/* The catalogue and its look-ups (sky_index.SkyIndex). */
typedef struct {
    const Point *star; /* (stars + 1,), the last one, which is none, at infinity */
    const double *variance_m2;
    const uint8_t *is_dropped; /* match no spot to these */
    int64_t stars;
    const int32_t *raster; /* (rows, columns): nearest star, or the number of stars for none */
    int64_t columns, rows;
    double x0_m, y0_m, cells_per_m;
    double area_m2, density_m2, tolerance_m;
    const double *key_m;     /* (triangles, 3): arm, along, across */
    const int32_t *triangle; /* (triangles, 3): pivot, far, near */
    const int32_t *starts;   /* first triangle of every cell, one more than there are cells */
    int64_t cells[3];
    double cell_m, reach_m;
    const int32_t *pair; /* (pairs, 2), sorted by length */
    const double *pair_length_m;
    int64_t pairs;
} Sky;

/* tracker.TrackerSettings and the constants of hypotheses, refinement, evidence and motion. */
typedef struct {
    int64_t min_stars, min_stars_prior, identified_spots, pair_spots, pair_spots_total, look_ups, candidates;
    double centre_floor_px, streak_floor_ratio, evidence_nats, rival_nats, exposure_s, readout_s;
    const double *sigmas_px;
    int64_t sigmas;
    double stray_ratio;
    const int32_t *ranks;       /* (.., 2): neighbours (near, far) that make a triangle with a spot */
    const int32_t *rank_groups; /* (groups,): where every group of ranks ends */
    int64_t groups, neighbours; /* of a spot, itself included, that ranks ask for: at most 16 */
    int64_t refine_steps;
    double prior_freedom, clip_sigmas;
    double min_streak_px, min_streak_share, max_misfit_ratio;
    int64_t min_streaks, smear_rounds;
} SearchSettings;

/* One picture in, one answer out. */
typedef struct {
    int64_t spots;
    const double *u_px, *v_px;
    const double *cov_px2;   /* (spots, 3): uu, uv, vv */
    const double *streak_px; /* (spots, 2) */
    int64_t has_prior;
    double prior_x_m, prior_y_m, prior_heading_rad, prior_cov[9];
    int64_t has_motion;
    double vx_table_m_s, vy_table_m_s, omega_rad_s;
    double *doubles;   /* scratch, gs_star_doubles() */
    int32_t *integers; /* scratch, gs_star_integers(), zero at first */
    int64_t is_fix, is_tracked, is_ambiguous, stars;
    double x_m, y_m, heading_rad, cov[9], evidence_nats;
    double best_nats, guess[3];       /* of a refused picture */
    int32_t *spot_index, *star_index; /* (stars,), room for every spot */
    Point *residual_m;
} StarPicture;

typedef struct {
    Point turn, shift_m;
    double cov[9];
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

int settle(SkySearch *s, Candidate *candidate, double gate_m, int has_prior, double *nats);

#endif
