/* The members of a filter between frames and over a frame; in NumPy: tests/oracles/motion_bank.py. */
#include "core.h"
#include "rotation.h"

#include <math.h>
#include <string.h>

enum { S = MEMBER_ERRORS, P6 = 6, POSITION = 9, VELOCITY = 12, RATE = 15, ACCELERATION = 18 };
/* Places of a state behind its rotation; those of its errors: */
enum { E_POSITION = 0, E_TURN = 3, E_VELOCITY = 6, E_RATE = 9, E_ACCELERATION = 12 };

static void put(double *matrix, int row, int column, const double block[9], double scale)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) matrix[S * (row + i) + column + j] = scale * block[3 * i + j];
}

/* The same off the diagonal, and its transpose. */
static void put_twice(double *matrix, int row, int column, const double block[9], double scale)
{
    put(matrix, row, column, block, scale);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) matrix[S * (column + j) + row + i] = scale * block[3 * i + j];
}

static void times(const double a[9], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[3 * i] * v[0] + a[3 * i + 1] * v[1] + a[3 * i + 2] * v[2];
}

static void back_times(const double a[9], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[i] * v[0] + a[3 + i] * v[1] + a[6 + i] * v[2];
}

/* How errors go on: (15, 15). */
static void error_matrix(const Span *span, const double *state, const double *angle_by_rate,
                         const double *rate_by_rate, double *F)
{
    static const double eye[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
    double place[9], moved[9], from_place[9], from_speed[9], pushed[9], speeded[9], block[9], seen[9];
    memset(F, 0, sizeof(double) * S * S);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            place[3 * i + j] = span->carry[6 * i + j];
            moved[3 * i + j] = span->carry[6 * i + 3 + j];
            from_place[3 * i + j] = span->carry[6 * (3 + i) + j];
            from_speed[3 * i + j] = span->carry[6 * (3 + i) + 3 + j];
            pushed[3 * i + j] = span->push[3 * i + j];
            speeded[3 * i + j] = span->push[3 * (3 + i) + j];
        }
    product3(span->end, place, seen);
    product3_back(seen, span->begin, block);
    put(F, E_POSITION, E_POSITION, block, 1.0);
    product3(span->end, moved, block);
    put(F, E_POSITION, E_VELOCITY, block, 1.0);
    product3(span->end, pushed, block);
    put(F, E_POSITION, E_ACCELERATION, block, 1.0);
    product3_back(from_place, span->begin, block);
    put(F, E_VELOCITY, E_POSITION, block, 1.0);
    put(F, E_VELOCITY, E_VELOCITY, from_speed, 1.0);
    put(F, E_VELOCITY, E_ACCELERATION, speeded, 1.0);
    put(F, E_ACCELERATION, E_ACCELERATION, eye, 1.0);
    put(F, E_TURN, E_TURN, span->swing, 1.0);
    product3(state, angle_by_rate, block);
    put(F, E_TURN, E_RATE, block, 1.0);
    put(F, E_RATE, E_RATE, rate_by_rate, 1.0);
}

/* What unmodelled motion adds to the covariance. */
static void noise(const Span *span, const double *state, const double density[3], double *Q)
{
    const double t = span->dt_s, turning = density[0], along = density[1], across = density[2];
    double sight[3], change[9], seen[9], block[9];
    back_times(span->end, state + POSITION, sight);
    const double size = sqrt(sight[0] * sight[0] + sight[1] * sight[1] + sight[2] * sight[2]);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            change[3 * i + j] = (i == j ? across : 0.0) + (along - across) * sight[i] / size * (sight[j] / size);
    product3(span->end, change, seen);
    product3_back(seen, span->end, block);
    memset(Q, 0, sizeof(double) * S * S);
    put(Q, E_POSITION, E_POSITION, block, t * t * t * t * t / 20.0);
    put_twice(Q, E_POSITION, E_VELOCITY, seen, t * t * t * t / 8.0);
    put_twice(Q, E_POSITION, E_ACCELERATION, seen, t * t * t / 6.0);
    put(Q, E_VELOCITY, E_VELOCITY, change, t * t * t / 3.0);
    put_twice(Q, E_VELOCITY, E_ACCELERATION, change, t * t / 2.0);
    put(Q, E_ACCELERATION, E_ACCELERATION, change, t);
    for (int i = 0; i < 3; i++) {
        Q[S * (E_TURN + i) + E_TURN + i] = turning * (t * t * t / 3.0);
        Q[S * (E_RATE + i) + E_RATE + i] = turning * t;
    }
    put_twice(Q, E_TURN, E_RATE, state, turning * (t * t / 2.0));
}

static void carry_state(const Span *span, const double *turns, const double *rate, double *state)
{
    double place[3], seen[3], moved[6], from[6], by[9], rotation[9];
    for (int k = 0; k < 3; k++) place[k] = state[POSITION + k] + span->camera_m[k];
    back_times(span->begin, place, from);
    memcpy(from + 3, state + VELOCITY, 3 * sizeof(double));
    for (int i = 0; i < 6; i++) {
        moved[i] = 0.0;
        for (int j = 0; j < 6; j++) moved[i] += span->carry[6 * i + j] * from[j];
        for (int j = 0; j < 3; j++) moved[i] += span->push[3 * i + j] * state[ACCELERATION + j];
    }
    product3(span->swing, state, by);
    product3(by, turns, rotation);
    memcpy(state, rotation, sizeof rotation);
    times(span->end, moved, seen);
    for (int k = 0; k < 3; k++) {
        state[POSITION + k] = seen[k] - span->camera_m[k];
        state[VELOCITY + k] = moved[3 + k];
        state[RATE + k] = rate[k];
    }
}

/* out (rows, columns) = a (rows, inner) b (inner, columns) + out */
static void add_product(int rows, int inner, int columns, const double *a, const double *b, double *out)
{
    for (int i = 0; i < rows; i++)
        for (int k = 0; k < inner; k++) {
            const double factor = a[inner * i + k];
            if (factor == 0.0) continue;
            for (int j = 0; j < columns; j++) out[columns * i + j] += factor * b[columns * k + j];
        }
}

static void transpose(int rows, int columns, const double *a, double *out)
{
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < columns; j++) out[rows * j + i] = a[columns * i + j];
}

/* out = F P F' + Q, in place of Q. */
static void sandwich(const double *F, const double *P, double *Q)
{
    double half[S * S] = {0.0}, back[S * S];
    add_product(S, S, S, F, P, half);
    transpose(S, S, F, back);
    add_product(S, S, S, half, back, Q);
}

void gs_bank_predict(const Span *span, int64_t m, double *states, double *covariance, const double *densities)
{
    double rates[3 * MOST_MEMBERS] = {0.0}, up[3 * MOST_MEMBERS] = {0.0}, normal[3 * MOST_MEMBERS] = {0.0};
    double after[3 * MOST_MEMBERS];
    double turns[9 * MOST_MEMBERS], angle_by_rate[9 * MOST_MEMBERS], rate_by_rate[9 * MOST_MEMBERS];
    const double *inertia = span->has_inertia ? span->inertia : NULL;
    const int has_vertical = inertia && span->orbital_rate > 0.0;
    for (int64_t i = 0; i < m; i++) {
        const double *state = states + MEMBER * i;
        double orbital[9];
        memcpy(rates + 3 * i, state + RATE, 3 * sizeof(double));
        back_product3(state, span->begin, orbital); /* columns: orbital axes in the body */
        for (int k = 0; k < 3; k++) up[3 * i + k] = orbital[3 * k], normal[3 * i + k] = orbital[3 * k + 2];
    }
    gs_turn_on(m, rates, inertia, span->dt_s, has_vertical ? up : NULL, has_vertical ? normal : NULL,
               span->orbital_rate, span->step_rad, span->most_steps, after, turns, angle_by_rate, rate_by_rate);
    for (int64_t i = 0; i < m; i++) {
        double *state = states + MEMBER * i, *P = covariance + S * S * i, F[S * S], Q[S * S];
        carry_state(span, turns + 9 * i, after + 3 * i, state);
        error_matrix(span, state, angle_by_rate + 9 * i, rate_by_rate + 9 * i, F);
        noise(span, state, densities + 3 * i, Q);
        sandwich(F, P, Q);
        memcpy(P, Q, sizeof Q);
    }
}

/* Solve a (6, 6) x = b (6, 15) by elimination with row pivots, in place; the logarithm of the determinant's size. */
static double solve(double a[P6][P6], double b[P6][S])
{
    double logarithm = 0.0;
    for (int k = 0; k < P6; k++) {
        int best = k;
        for (int i = k + 1; i < P6; i++)
            if (fabs(a[i][k]) > fabs(a[best][k])) best = i;
        if (best != k) {
            double row[P6], right[S];
            memcpy(row, a[k], sizeof row), memcpy(a[k], a[best], sizeof row), memcpy(a[best], row, sizeof row);
            memcpy(right, b[k], sizeof right), memcpy(b[k], b[best], sizeof right), memcpy(b[best], right, sizeof right);
        }
        logarithm += log(fabs(a[k][k]));
        for (int i = k + 1; i < P6; i++) {
            const double factor = a[i][k] / a[k][k];
            for (int j = k; j < P6; j++) a[i][j] -= factor * a[k][j];
            for (int j = 0; j < S; j++) b[i][j] -= factor * b[k][j];
        }
    }
    for (int k = P6 - 1; k >= 0; k--)
        for (int j = 0; j < S; j++) {
            for (int i = k + 1; i < P6; i++) b[k][j] -= a[k][i] * b[i][j];
            b[k][j] /= a[k][k];
        }
    return logarithm;
}

static void move(const double step[S], double *state)
{
    double by[9], turned[9], square[9], near[9];
    turn(step + E_TURN, by);
    product3(by, state, turned);
    back_product3(turned, turned, square);
    for (int i = 0; i < 9; i++) near[i] = (i % 4 == 0 ? 1.5 : 0.0) - 0.5 * square[i];
    product3(turned, near, state);
    for (int k = 0; k < 3; k++) {
        state[POSITION + k] += step[E_POSITION + k];
        state[VELOCITY + k] += step[E_VELOCITY + k];
        state[RATE + k] += step[E_RATE + k];
        state[ACCELERATION + k] += step[E_ACCELERATION + k];
    }
}

/* P = (1 - G I E) P (1 - G I E)' + G I G': stays positive whatever the ratio of prior and frame. */
static void shrink(const double gain[P6][S], const double *information, double *P)
{
    double G[S * P6], leak[S * P6] = {0.0}, keep[S * S] = {0.0}, after[S * S] = {0.0};
    transpose(P6, S, &gain[0][0], G);
    add_product(S, P6, P6, G, information, leak);
    add_product(S, P6, S, leak, &gain[0][0], after);
    for (int i = 0; i < S; i++) {
        keep[S * i + i] = 1.0;
        for (int j = 0; j < P6; j++) keep[S * i + j] -= leak[P6 * i + j];
    }
    sandwich(keep, P, after);
    for (int i = 0; i < S; i++)
        for (int j = 0; j < S; j++) P[S * i + j] = 0.5 * (after[S * i + j] + after[S * j + i]);
}

void gs_bank_update(const RigidPose *pose, const double *information, const double *gradient, double cost, int64_t m,
                    double *states, double *covariance, double *likelihood)
{
    for (int64_t i = 0; i < m; i++) {
        double *state = states + MEMBER * i, *P = covariance + S * S * i;
        double off[P6], weighed[P6], slope[P6], spread[P6][P6], gain[P6][S], step[S] = {0.0};
        for (int k = 0; k < 3; k++) off[k] = state[POSITION + k] - pose->position_m[k];
        turn_between(state, pose->rotation, off + 3);
        double explained = 0.0, missed = 0.0;
        for (int a = 0; a < P6; a++) {
            weighed[a] = 0.0;
            for (int b = 0; b < P6; b++) weighed[a] += off[b] * information[P6 * b + a];
            slope[a] = gradient[a] - weighed[a]; /* at the member's prediction */
            missed += off[a] * (2.0 * gradient[a] - weighed[a]);
        }
        /* gain G = P E' (1 + I E P E')^-1, so that the step is G slope; its transpose is solved for */
        for (int a = 0; a < P6; a++)
            for (int b = 0; b < P6; b++) {
                double sum = a == b ? 1.0 : 0.0;
                for (int k = 0; k < P6; k++) sum += information[P6 * b + k] * P[S * k + a];
                spread[a][b] = sum;
            }
        for (int a = 0; a < P6; a++) memcpy(gain[a], P + S * a, sizeof gain[a]);
        const double logarithm = solve(spread, gain);
        for (int a = 0; a < P6; a++)
            for (int j = 0; j < S; j++) step[j] += gain[a][j] * slope[a];
        for (int a = 0; a < P6; a++) explained += slope[a] * step[a];
        likelihood[i] = 0.5 * (explained + missed - logarithm - cost);
        shrink((const double(*)[S])gain, information, P);
        move(step, state);
    }
}
