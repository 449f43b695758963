/* From spots to a pose: tracking from a prior, or lost in space (tests/oracles/search.py, step by step). */
#include <string.h>

#include "star_tracker.h"

enum { DOUBLES_PER_SPOT = 32 }; /* carved by begin() */

int64_t gs_star_doubles(int64_t spots) { return DOUBLES_PER_SPOT * spots; }

int64_t gs_star_integers(int64_t spots, int64_t stars, const SearchSettings *settings)
{
    return (2 + settings->neighbours) * spots + CELL * settings->candidates + stars;
}

SkySearch begin_search(const Sky *sky, const Rays *rays, const SearchSettings *settings, StarPicture *picture)
{
    const int64_t n = picture->spots;
    SkySearch found = {.sky = sky, .rays = rays, .settings = settings, .picture = picture};
    double *next = picture->doubles;
    found.q = (Point *)next, next += 2 * n;
    found.q_middle = (Point *)next, next += 2 * n;
    found.q_matched = (Point *)next, next += 2 * n;
    found.star_matched = (Point *)next, next += 2 * n;
    found.jacobian = next, next += 4 * n;
    found.weight = next, next += 3 * n;
    found.kept = next, next += n;
    found.distance2 = next, next += n;
    found.free = next; /* 15 n are left: 11 n for the fit, or 9 n for streaks, or one per neighbour */
    int32_t *integer = picture->integers;
    found.spot_of_star = integer, integer += sky->stars; /* zero between matches */
    found.cell = integer, integer += CELL * settings->candidates;
    found.spot = integer, integer += n;
    found.star = integer, integer += n;
    found.neighbour = integer;
    found.look_ups_left = settings->look_ups;
    return found;
}

static int track(SkySearch *s)
{
    const StarPicture *p = s->picture;
    Candidate prior = {unit_at(p->prior_heading_rad), {p->prior_x_m, p->prior_y_m}, 0};
    double nats;
    const double sideways = sqrt(fmax(p->prior_covariance[0], p->prior_covariance[4]));
    const double turning = 0.5 * s->rays->reach_m * sqrt(p->prior_covariance[8]);
    const double sigma = sqrt(sideways * sideways + turning * turning);
    const double gate_m = fmin(3.0 * sigma + 2.0 * s->sky->tolerance_m, 0.1);
    return settle(s, &prior, gate_m, 1, &nats);
}

/* Whether a pose like this one was tried before; else it is noted. */
static int is_tried(SkySearch *s, Point turn, Point shift_m)
{
    const int32_t cell[CELL] = {(int32_t)rint(shift_m.x / 0.05), (int32_t)rint(shift_m.y / 0.05),
                                (int32_t)rint(atan2(turn.y, turn.x) / 0.02)};
    for (int64_t i = 0; i < s->cells; i++) {
        if (memcmp(s->cell + CELL * i, cell, sizeof cell) == 0) {
            return 1;
        }
    }
    memcpy(s->cell + CELL * s->cells++, cell, sizeof cell);
    return 0;
}

static Ballot open_ballot(const SkySearch *s, int64_t spots)
{
    return (Ballot){.sky = s->sky, .q = s->q, .spots = spots, .room = s->look_ups_left / spots};
}

/* Whether two poses put the spots about where the other does: their middle, and the heading. */
static int is_same(const Ballot *ballot, Point middle, const Candidate *a, const Candidate *b)
{
    const Point turn = sub(a->turn, b->turn), off = add(turned(turn, middle), sub(a->shift_m, b->shift_m));
    return length_of(off) < 4.0 * ballot->sky->tolerance_m && length_of(turn) < 0.03;
}

/* Settle the poses that most spots agree with, and look for rivals of a fix (OracleSearch._best); whether to stop. */
static int close_ballot(SkySearch *s, Ballot *ballot)
{
    const double gate_m = 2.5 * s->sky->tolerance_m;
    double needed = (double)s->settings->min_stars, fix_nats = -INFINITY, rival_nats = -INFINITY, nats;
    Candidate fix = {0};
    Point middle = {0.0, 0.0};
    for (int64_t i = 0; i < ballot->spots; i++) {
        middle = add(middle, scaled(ballot->q[i], 1.0 / (double)ballot->spots));
    }
    s->look_ups_left -= ballot->offered * ballot->spots;
    for (int64_t i = 0; i < ballot->count; i++) {
        Candidate *candidate = &ballot->best[i];
        const double votes = (double)candidate->votes;
        const int has_fix = fix.votes > 0;
        if (votes < needed || (!has_fix && i >= REFINED)) {
            break;
        }
        if (has_fix && is_same(ballot, middle, candidate, &fix)) {
            continue;
        }
        if (s->cells == s->settings->candidates) {
            s->look_ups_left = 0;
            break;
        }
        if (is_tried(s, candidate->turn, candidate->shift_m) || !settle(s, candidate, gate_m, 0, &nats)) {
            continue;
        }
        if (!has_fix) {
            fix = *candidate;
            fix_nats = nats;
            needed = fmax(needed, 0.8 * votes); /* with fewer votes a place is no rival */
        } else if (!is_same(ballot, middle, candidate, &fix)) {
            rival_nats = fmax(rival_nats, fmin(fix_nats, nats));
            if (nats > fix_nats) {
                fix = *candidate;
                fix_nats = nats;
            }
        }
    }
    if (fix.votes == 0) {
        return 0;
    }
    if (!(fix_nats - rival_nats >= s->settings->rival_nats)) {
        s->picture->is_fix = 0;
        s->picture->is_ambiguous = 1;
    }
    return 1;
}

static int lost_in_space(SkySearch *s)
{
    const SearchSettings *settings = s->settings;
    int64_t n = s->picture->spots < settings->identified_spots ? s->picture->spots : settings->identified_spots;
    if (n > settings->min_stars) {
        for (int64_t group = 0; group < settings->groups; group++) {
            Ballot ballot = open_ballot(s, n);
            offer_triangles(settings, group, s->free, s->neighbour, &ballot);
            if (close_ballot(s, &ballot)) {
                return 1;
            }
        }
    }
    if (n > settings->pair_spots_total || s->sky->pairs == 0) {
        return 0; /* triangles fail on many spots only if they are no stars */
    }
    n = n < settings->pair_spots ? n : settings->pair_spots;
    const double longest = s->sky->pair_length_m[s->sky->pairs - 1];
    for (int64_t sum = 1; sum <= 2 * n - 3; sum++) { /* bright with bright first */
        for (int64_t first = sum < n ? 0 : sum - n + 1; 2 * first < sum; first++) {
            const int64_t second = sum - first;
            if (!(length_of(sub(s->q[second], s->q[first])) < longest)) {
                continue;
            }
            if (s->look_ups_left <= 0) {
                return 0;
            }
            Ballot ballot = open_ballot(s, n);
            offer_pairs(first, second, &ballot);
            if (close_ballot(s, &ballot)) {
                return 1;
            }
        }
    }
    return 0;
}

/* Put what moved during the exposure where it was at its middle: by the streaks, or by the motion if it is known. */
static void straighten(SkySearch *s)
{
    StarPicture *picture = s->picture;
    Smear smear;
    look_up_rays(s->rays, picture->spots, picture->u_px, picture->v_px, s->q, s->jacobian);
    if ((!picture->has_motion || s->settings->exposure_s == 0.0) &&
        smear_from_streaks(s->settings, picture->spots, s->q, picture->streak_px, s->jacobian, s->free, &smear)) {
        unbend(picture->spots, s->q, smear, s->q);
    }
}

/* Where the spots were at the middle of the exposure, under a turn: into q_middle. */
void see_places(SkySearch *s, Point turn)
{
    straighten(s);
    if (s->picture->has_motion) {
        to_middle(s->picture, s->settings, s->rays->picture_rows, s->q, turn, s->q_middle);
    } else {
        memcpy(s->q_middle, s->q, (size_t)s->picture->spots * sizeof *s->q);
    }
}

/* Solve one picture with enough spots; the answer is in the picture. */
void gs_star_solve(const Sky *sky, const Rays *rays, const SearchSettings *settings, StarPicture *picture)
{
    SkySearch s = begin_search(sky, rays, settings, picture);
    picture->is_fix = picture->is_ambiguous = 0;
    picture->best_nats = -INFINITY;
    straighten(&s);
    if (picture->has_prior) {
        if (track(&s) || picture->spots < settings->min_stars) {
            return;
        }
    }
    lost_in_space(&s);
}
