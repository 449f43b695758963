/* What Python and the core share: every structure and every function, declared here and nowhere else.
 *
 * The C files include this header; the build reads the same text with cffi (build.py), which drops the lines that begin
 * with # and understands nothing but plain declarations: no macros, no inline functions. Arrays are the caller's.
 */
#ifndef GROUNDSTATION_API_H
#define GROUNDSTATION_API_H

#include <stddef.h>
#include <stdint.h>

#pragma GCC visibility push(default)

/* Hash of the sources and flags that this library was made of. */
const char *gs_sources(void);

/* ---- Light spots of a picture: detect.c ------------------------------------------------------------------------- */

/* What counts as a spot (star_tracking/detection.py). */
typedef struct {
    double threshold_sigmas;
    double hot_pixel_ratio;
    double gain_dn_per_electron;
    int32_t saturation_dn;
    int32_t max_spots;
    int32_t max_lit; /* pixels */
} DetectorSettings;

/* What was found besides the spots. */
typedef struct {
    double background_dn, noise_dn;
    int32_t hot_pixels, cut_by_edge;
    int32_t is_flooded;
} DetectionSummary;

/* A symmetric 2x2 matrix. */
typedef struct {
    double uu, uv, vv;
} Symmetric;

/* One spot; Python reads it as nine doubles. */
typedef struct {
    double u_px, v_px, flux_dn;
    Symmetric covariance_px2;
    double elongation;
    double streak_u_px, streak_v_px;
} FittedSpot;

/* How much scratch memory gs_detect needs for pictures of this size. Only what a picture really needs is touched. */
size_t gs_detect_scratch_bytes(int32_t rows, int32_t columns, const DetectorSettings *settings);

/* Find the light spots of a grey picture of at least 32 x 32 pixels, rows `stride` bytes apart.
 *
 * `scratch` holds gs_detect_scratch_bytes and is 64-byte aligned; `fitted` has room for max_spots. Returns how many
 * spots were found, brightest first. */
int32_t gs_detect(const uint8_t *image, ptrdiff_t stride, int32_t rows, int32_t columns,
                  const DetectorSettings *settings, uint8_t *scratch, FittedSpot *fitted, DetectionSummary *summary);

/* ---- Seams of a picture: seams.c -------------------------------------------------------------------------------- */

/* Sum the steps from each row to the next and from each column to the next, none counted for more than `most_dn`.
 *
 * `down` has (rows - 1, 2) sums: over the left and the right half of the columns; `across` has (2, columns - 1): over the
 * upper and the lower half of the rows. For pictures of less than 2^31 / 255 rows and columns. */
void gs_seams(const uint8_t *image, ptrdiff_t stride, int32_t rows, int32_t columns, int32_t most_dn, int32_t *down,
              int32_t *across);

/* ---- Round spots of a target: disks.c ---------------------------------------------------------------------------- */

typedef struct {
    double level_dn, noise_dn; /* of the background */
    double height_dn;          /* of spots too small to tell; below zero: the most that any of their pixels has */
    double margin_px, edge_px, large_edge_px, large_px, unresolved_px, rest_px;
    int32_t iterations;
} DiskSettings;

/* Where a spot is, roughly. */
typedef struct {
    double u_px, v_px, radius_px;
} RoughDisk;

/* Python reads it as eight doubles; the spread is to be multiplied by the noise squared. */
typedef struct {
    double u_px, v_px, height_dn, radius_px;
    double misfit; /* mean square of the residuals over the noise */
    Symmetric spread_px2;
} FittedDisk;

/* Fit `count` spots of a grey picture, rows `stride` bytes apart; `found` has room for as many. */
void gs_fit_disks(const uint8_t *image, ptrdiff_t stride, int32_t rows, int32_t columns, const RoughDisk *rough,
                  int32_t count, const DiskSettings *settings, FittedDisk *found);

/* ---- Pose of a target: pose.c ------------------------------------------------------------------------------------ */

typedef struct {
    double f_px, cx_px, cy_px;
} Pinhole;

/* A point of the body and where it was seen; `weight` (2, 2) times an error has the covariance 1. */
typedef struct {
    double body_m[3], u_px, v_px, weight[4];
} SeenPoint;

/* Camera from body (3, 3) and the body's origin in camera axes; Python reads it as twelve doubles. */
typedef struct {
    double rotation[9], position_m[3];
} RigidPose;

typedef struct {
    double rest, first_damping, most_damping, most_inflation, nearest_m;
    int32_t iterations;
} PoseSettings;

/* Covariance (6, 6): position, then the turn in front, camera axes. */
typedef struct {
    RigidPose pose;
    double covariance[36];
    double cost;
    int32_t iterations;
} SolvedPose;

/* The pose of least squares near `found->pose`; `mean` and `information` (6, 6) are a prior's, or NULL both.
 *
 * Returns whether it came to rest with every direction known; else the covariance is not written. */
int32_t gs_solve_pose(const Pinhole *camera, const SeenPoint *seen, int32_t count, const RigidPose *mean,
                      const double *information, const PoseSettings *settings, SolvedPose *found);

/* ---- Bodies between frames, and a filter's members: attitude.c, motion_bank.c ------------------------------------ */

/* Let m bodies turn freely over a span: rates (m, 3) in body axes, principal `inertia` (3) or NULL where rates stay in
 * the body; `up` and `normal` (m, 3), the orbit's axes in the body, for gravity gradient at its rate, or NULL both.
 * No step turns a body by more than `step_rad`. Answered: rates at the end; turns (m, 3, 3), body at the end to body at
 * the beginning; derivatives of the small turn at the end and of the rate by the rate at the beginning, (m, 3, 3). */
void gs_turn_on(int64_t m, const double *rates, const double *inertia, double dt_s, const double *up,
                const double *normal, double orbital_rate, double step_rad, int64_t most_steps, double *rates_after,
                double *turns, double *angle_by_rate, double *rate_by_rate);

/* A span between two frames, of the camera's craft: motion.CameraCraft. */
typedef struct {
    double begin[9], end[9], swing[9]; /* camera from orbital, at both ends; the camera's turn in inertial space */
    double carry[36], push[18];        /* Hill's transition, and what a constant acceleration adds */
    double camera_m[3];                /* from the craft's centre of mass */
    double dt_s, orbital_rate, inertia[3], step_rad;
    int64_t has_inertia, most_steps;
} Span;

/* A member's state: rotation (3, 3) camera from body, position, velocity, rate, acceleration. */
enum { MEMBER = 21, MEMBER_ERRORS = 15, MOST_MEMBERS = 16 };

/* Carry members (m, MEMBER) and their covariances (m, 15, 15) over a span, in place; at most MOST_MEMBERS. `densities` (m, 3) of what is
 * unmodelled: turning, along the line of sight, across it. */
void gs_bank_predict(const Span *span, int64_t m, double *states, double *covariance, const double *densities);

/* Correct members by the information of a frame: pose, I (6, 6), b (6), cost; `likelihood` (m) is answered. */
void gs_bank_update(const RigidPose *pose, const double *information, const double *gradient, double cost, int64_t m,
                    double *states, double *covariance, double *likelihood);

/* ---- Star identification and pose: star_*.c ----------------------------------------------------------------------
 *
 * All structures are filled by star_tracking/search.py, once per tracker but for the picture. Lengths are of the ceiling
 * plane in m, angles in rad; q is a point of the ceiling in body axes, relative to the body's origin. */

/* Points and turns of the ceiling plane: what NumPy holds as one complex128. */
typedef struct {
    double x, y;
} Point;

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

/* settings.TrackerSettings, and the constants beside it. */
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
    double tear_scatters, tear_ratio;
} SearchSettings;

/* One picture in, one answer out. */
typedef struct {
    int64_t spots;
    const double *u_px, *v_px;
    const double *covariance_px2;   /* (spots, 3): uu, uv, vv */
    const double *streak_px; /* (spots, 2) */
    int64_t has_prior;
    double prior_x_m, prior_y_m, prior_heading_rad, prior_covariance[9];
    int64_t has_motion;
    double vx_table_m_s, vy_table_m_s, rate_rad_s;
    double *doubles;   /* scratch, gs_star_doubles() */
    int32_t *integers; /* scratch, gs_star_integers(), zero at first */
    int64_t is_fix, is_tracked, is_ambiguous, stars;
    double x_m, y_m, heading_rad, covariance[9], evidence_nats;
    double best_nats, guess[3];       /* of a refused picture */
    int32_t *spot_index, *star_index; /* (stars,), room for every spot */
    Point *residual_m;
    double tear_nats, tear_px; /* of gs_star_tears: for an end with other stars; of the largest step in the residuals */
} StarPicture;

int64_t gs_star_doubles(int64_t spots);
int64_t gs_star_integers(int64_t spots, int64_t stars, const SearchSettings *settings);

/* Search one picture. */
void gs_star_solve(const Sky *sky, const Rays *rays, const SearchSettings *settings, StarPicture *picture);

/* Look whether the picture, in which gs_star_solve has just found a fix, shows its stars at two places. */
void gs_star_tears(const Sky *sky, const Rays *rays, const SearchSettings *settings, StarPicture *picture);

/* ---- The filter's states and their order: fusion/error_state.py ---------------------------------------------------
 *
 * Behind them stand two slopes per node of the learned surface (learned_surface.py). */

enum { THETA, VX, VY, PX, PY, GYRO_BIAS, ACC_BIAS_X, ACC_BIAS_Y, SLOPE_X, SLOPE_Y, GYRO_SCALE, LEVER_X, LEVER_Y };
enum { WAVE_X = 13, WAVE_Y, MXX, MXY, MYX, MYY, GYRO_TEMPCO, ACC_TEMPCO_X, ACC_TEMPCO_Y, FIX_DELAY, SIZE };
enum { MOVING = 5, MAX_NODES = 64 };

/* ---- One IMU packet after another: reckon.c ----------------------------------------------------------------------- */

/* What happened to a packet. */
enum {
    BEHIND = 1,   /* the stamp is not after the last one's: nothing was done */
    WILD = 2,     /* the readings jumped away: the last good ones were taken */
    HOLE = 4,     /* packets are missing before this one: there is a row for them too */
    DISAGREE = 8, /* the stamp is too far from the tick: it was followed */
    AHEAD = 16,   /* the stamp is so far ahead of the ticks that it needs a witness: nothing was done */
    HEAT = 32,    /* no block is or becomes so warm: the temperature before goes on */
};

/* A row of the history; see packet_history.py. */
typedef struct {
    double end_s, span_s, rate, ax, ay, warmth, is_hole;
} Packet;

typedef struct {
    double rate, ax, ay;
} Readings;

/* estimator.ImuPacket, field by field. */
typedef struct {
    int64_t t_ns;
    double dt_s, rate_rad_s, ax_m_s2, ay_m_s2, temperature_c;
} ImuPacket;

/* estimator.PlanarState, field by field: of the centre of mass. */
typedef struct {
    int64_t t_ns;
    double x_m, y_m, heading_rad, vx_m_s, vy_m_s, rate_rad_s;
    double bias_rate_rad_s, bias_ax_m_s2, bias_ay_m_s2;
    double sigma_x_m, sigma_y_m, sigma_heading_rad;
    _Bool is_lost;
} PlanarState;

typedef struct {
    ImuPacket asked;
    PlanarState state; /* is_lost is the caller's */
    Packet row, hole_row; /* new ones of the history, that of a hole before the packet's */

    /* constants */
    double period_s, max_jitter_s, stamp_gain, max_ahead_s;
    double gyro_lag_s, acc_lag_s, lag_difference_s;
    double max_rate_step, max_force_step, full_rate, full_force;

    /* clock */
    int64_t is_restarted; /* take the next packet although its stamp lies behind or far ahead */
    int64_t origin_ns, newest_ns;
    double newest_s;
    int64_t is_begun; /* a packet has come */

    /* screen */
    int64_t has_last, has_suspect;
    Readings last, suspect;

    /* what holds since the last fix */
    int64_t has_pose;
    double rest_from_s, rest_to_s, checkpoint_s;
    double variance[13];
    double gyro_bias, gyro_tempco, gyro_gain;
    double acc_bias_x, acc_bias_y, acc_tempco_x, acc_tempco_y;
    double mxx, mxy, myx, myy;
    double gx, gy; /* slope, wave and what a map says */
    double lever_x, lever_y;

    /* now */
    double theta, vx, vy, px, py;
    double rate, force_x, force_y;
    double warmth, temperature_c, reference_c;
    double warmed_s; /* when that temperature was read */
    double bg, bax, bay; /* at the present temperature */
    Readings good;       /* the newest that were integrated */
} Reckoner;

/* Take the packet that is asked and report; return what happened, see the flags above. */
int gs_reckoner_add(Reckoner *r);

/* The state of the centre of mass now: sensor lag undone, lever arm taken off. */
void gs_reckoner_report(Reckoner *r);

/* Biases at the present temperature. */
void gs_reckoner_warm(Reckoner *r);

/* ---- A stretch of stored packets: carry.c ------------------------------------------------------------------------- */

/* slope_grid.SlopeGrid: the pull of the table on a grid, row by row. */
typedef struct {
    const double *x, *y;
    int64_t rows, columns;
    double x0_m, y0_m, step_m, mean_x, mean_y;
} Grid;

/* A stretch and the state at its start. */
typedef struct {
    const Packet *history;
    int64_t count;
    double start_s, stop_s, lag_difference_s, gyro_density, acc_density;
    double knock_m_s, knock_step_m_s2; /* of a switching valve: its size, the change of force that shows it */
    int64_t knock_group;               /* packets whose mean force is looked at */
    const Grid *map;
    double x[SIZE];
    /* answered */
    double moved[MOVING];
    double duration_s, turned_rad; /* all of it; the middle of the last packet against the start */
    double F[MOVING * SIZE];
    double Q[MOVING * MOVING];
    /* between calls */
    int64_t first, last;
} Stretch;

/* Motion alone; returns the number of packets. */
int64_t gs_stretch_fly(Stretch *s);

/* Motion, and how the covariance goes with it. */
int64_t gs_stretch_carry(Stretch *s);

/* ---- A late fix: late_fix.c ---------------------------------------------------------------------------------------- */

/* Let the local slope be that of a place, in place; 0 if the nodes say too little of it, and nothing was done.
 * w: (2, 2m) regression weights, answered. */
int gs_surface_look(const double *nodes, const double *inverse, int64_t m, double length, double place_x, double place_y,
                    double variance, double unknown_share, double *x, double *P, double *w);

/* Expected slope at a place, given the nodes' part of the state. */
void gs_surface_slope(const double *nodes, const double *inverse, int64_t m, double length, double place_x,
                      double place_y, const double *at_nodes, double *slope);

/* Correct x (n) and P (n, n) in place by three measurements of the first 23 states, unless they lie outside the gate.
 * z: (3) innovation; H: (3, 23); S: (3, 3) the measurements' covariance, answered as the innovation's. Answered: weight
 * (3, 3) its inverse, K (n, 3) gain; the value is z' weight z. */
double gs_correct(double *x, double *P, int64_t n, const double *z, const double *H, double *S, double gate,
                  double *weight, double *K);

/* Coefficients (13) of the variances of x, y and heading in the time after the fix. */
void gs_variance_in_time(const double *x, const double *P, int64_t n, double acc_density, double gyro_density,
                         double *out);

#pragma GCC visibility pop

#endif
