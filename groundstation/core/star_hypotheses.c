/* Poses that triangles and pairs of spots imply, and the vote on each (sky_index.py; tests/oracles/hypotheses.py). */
#include "star_tracker.h"

/* Count the spots that a pose puts near stars, and keep it if it is among the best. */
static void offer(Ballot *ballot, Point turn, Point shift_m)
{
    const double gate = 2.0 * ballot->sky->tolerance_m, gate2 = gate * gate;
    const int64_t last = ballot->count == RIVALS ? ballot->best[RIVALS - 1].votes : -1;
    int64_t votes = 0;
    ballot->offered++;
    for (int64_t i = 0; i < ballot->spots; i++) {
        double distance2;
        nearest_star(ballot->sky, add(turned(turn, ballot->q[i]), shift_m), &distance2);
        votes += distance2 < gate2;
        if (votes + ballot->spots - 1 - i <= last) { /* the last one stays, whatever the other spots say */
            return;
        }
    }
    int64_t at = ballot->count < RIVALS ? ballot->count++ : RIVALS - 1;
    for (; at > 0 && ballot->best[at - 1].votes < votes; at--) {
        ballot->best[at] = ballot->best[at - 1];
    }
    ballot->best[at] = (Candidate){turn, shift_m, votes};
}

/* The nearest spots of every spot, itself the first: (spots, depth), -1 where there are no more. */
static void nearest_spots(const Ballot *ballot, int64_t depth, double *distance2, int32_t *neighbour)
{
    for (int64_t i = 0; i < ballot->spots; i++) {
        int32_t *found = neighbour + i * depth;
        int64_t count = 0;
        for (int64_t j = 0; j < ballot->spots; j++) {
            const Point off = sub(ballot->q[j], ballot->q[i]);
            const double d2 = off.x * off.x + off.y * off.y;
            if (count == depth && !(d2 < distance2[depth - 1])) {
                continue;
            }
            int64_t at = count < depth ? count++ : depth - 1;
            for (; at > 0 && d2 < distance2[at - 1]; at--) {
                distance2[at] = distance2[at - 1];
                found[at] = found[at - 1];
            }
            distance2[at] = d2;
            found[at] = (int32_t)j;
        }
        for (; count < depth; count++) {
            found[count] = -1;
        }
    }
}

static int64_t cell_of(double value, double cell_m, int64_t shift, int64_t cells)
{
    const double cell = floor(value / cell_m) + (double)shift;
    if (!(cell > 0.0)) {
        return 0;
    }
    return cell < (double)(cells - 1) ? (int64_t)cell : cells - 1;
}

/* The pose that lays three spots on three stars, by least squares. */
static void offer_triangle(Ballot *ballot, const int32_t *stars, const Point q[3])
{
    const Point *star = ballot->sky->star;
    const Point s[3] = {star[stars[0]], star[stars[1]], star[stars[2]]};
    const Point s_mean = scaled(add(add(s[0], s[1]), s[2]), 1.0 / 3.0);
    const Point q_mean = scaled(add(add(q[0], q[1]), q[2]), 1.0 / 3.0);
    Point turn = {0.0, 0.0};
    for (int k = 0; k < 3; k++) {
        turn = add(turn, turned_back(sub(q[k], q_mean), sub(s[k], s_mean)));
    }
    const double length = length_of(turn);
    turn = scaled(turn, 1.0 / (length > 1e-300 ? length : 1e-300));
    offer(ballot, turn, sub(s_mean, turned(turn, q_mean)));
}

/* Look one triangle of spots up in one of the four rows of cells that its key may fall into. */
static void look_up(Ballot *ballot, const Point q[3], int corner)
{
    const Sky *sky = ballot->sky;
    const double tolerance = sky->tolerance_m;
    const Point far = sub(q[1], q[0]), near = sub(q[2], q[0]);
    const double arm = length_of(far);
    const Point near_by_arm = scaled(turned_back(far, near), 1.0 / fmax(arm, 1e-300));
    if (!(arm <= sky->reach_m + tolerance)) {
        return;
    }
    const int64_t half = sky->cells[1] / 2;
    const int64_t arm_low = cell_of(arm - tolerance, sky->cell_m, 0, sky->cells[0]);
    const int64_t arm_high = cell_of(arm + tolerance, sky->cell_m, 0, sky->cells[0]);
    const int64_t along_low = cell_of(near_by_arm.x - tolerance, sky->cell_m, half, sky->cells[1]);
    const int64_t along_high = cell_of(near_by_arm.x + tolerance, sky->cell_m, half, sky->cells[1]);
    if ((corner / 2 && arm_high == arm_low) || (corner % 2 && along_high == along_low)) {
        return; /* both corners lie in one cell: take it once */
    }
    const int64_t row = (corner / 2 ? arm_high : arm_low) * sky->cells[1] + (corner % 2 ? along_high : along_low);
    const int64_t begin = cell_of(near_by_arm.y - tolerance, sky->cell_m, half, sky->cells[2]);
    const int64_t end = cell_of(near_by_arm.y + tolerance, sky->cell_m, half, sky->cells[2]);
    const int32_t stop = sky->starts[row * sky->cells[2] + end + 1];
    for (int32_t entry = sky->starts[row * sky->cells[2] + begin]; entry < stop; entry++) {
        const double *key = sky->key_m + 3 * (int64_t)entry;
        if (fabs(key[0] - arm) < tolerance && fabs(key[1] - near_by_arm.x) < tolerance &&
            fabs(key[2] - near_by_arm.y) < tolerance) {
            if (ballot->offered == ballot->room) {
                return;
            }
            offer_triangle(ballot, sky->triangle + 3 * (int64_t)entry, q);
        }
    }
}

/* Poses by triangles of spots with neighbours of one group of ranks. */
void offer_triangles(const SearchSettings *settings, int64_t group, double *scratch, int32_t *neighbour, Ballot *ballot)
{
    const int64_t from = group ? settings->rank_groups[group - 1] : 0, to = settings->rank_groups[group];
    if (group == 0) {
        nearest_spots(ballot, settings->neighbours, scratch, neighbour);
    }
    for (int corner = 0; corner < 4; corner++) {
        for (int64_t rank = from; rank < to; rank++) {
            const int32_t near = settings->ranks[2 * rank], far = settings->ranks[2 * rank + 1];
            if (far >= ballot->spots - 1) {
                continue;
            }
            for (int64_t pivot = 0; pivot < ballot->spots && ballot->offered < ballot->room; pivot++) {
                const int32_t *found = neighbour + pivot * settings->neighbours + 1;
                const Point q[3] = {ballot->q[pivot], ballot->q[found[far]], ballot->q[found[near]]};
                look_up(ballot, q, corner);
            }
        }
    }
}

/* The first pair that is not shorter. */
static int64_t first_not_shorter(const Sky *sky, double length)
{
    int64_t low = 0, high = sky->pairs;
    while (low < high) {
        const int64_t middle = (low + high) / 2;
        if (sky->pair_length_m[middle] < length) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return low;
}

/* Poses that lay one pair of spots on every pair of stars of the same distance, either way round. */
void offer_pairs(int64_t first, int64_t second, Ballot *ballot)
{
    const Sky *sky = ballot->sky;
    const Point arm = sub(ballot->q[second], ballot->q[first]);
    const Point q_middle = scaled(add(ballot->q[first], ballot->q[second]), 0.5);
    const double length = length_of(arm);
    const int64_t low = first_not_shorter(sky, length - sky->tolerance_m);
    const int64_t high = first_not_shorter(sky, length + sky->tolerance_m);
    for (int way = 0; way < 2; way++) {
        for (int64_t pair = low; pair < high && ballot->offered < ballot->room; pair++) {
            const Point a = sky->star[sky->pair[2 * pair]], b = sky->star[sky->pair[2 * pair + 1]];
            const Point across = sub(b, a);
            const double scale = fmax(length_of(across), 1e-300) * fmax(length, 1e-300);
            const Point turn = scaled(turned_back(arm, across), (way ? -1.0 : 1.0) / scale);
            offer(ballot, turn, sub(scaled(add(a, b), 0.5), turned(turn, q_middle)));
        }
    }
}
