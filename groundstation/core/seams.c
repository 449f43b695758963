/* Straight steps of a picture's brightness from a row or column to the next; in NumPy: tests/oracles/seams.py. */
#include "core.h"

#include <string.h>

GS_INLINE int32_t bounded_step(uint8_t from, uint8_t to, int32_t most)
{
    const int32_t step = (int32_t)to - (int32_t)from;
    return step > most ? most : step < -most ? -most : step;
}

/* Sum of the steps from one row to the next, from a column up to before another. */
GS_CLONES
static int32_t sum_down(const uint8_t *row, ptrdiff_t stride, int32_t first, int32_t end, int32_t most)
{
    int32_t sum = 0;
    for (int32_t x = first; x < end; x++) sum += bounded_step(row[x], row[x + stride], most);
    return sum;
}

GS_CLONES
static void add_across(const uint8_t *restrict row, int32_t steps, int32_t most, int32_t *restrict sums)
{
    for (int32_t x = 0; x < steps; x++) sums[x] += bounded_step(row[x], row[x + 1], most);
}

void gs_seams(const uint8_t *image, ptrdiff_t stride, int32_t rows, int32_t columns, int32_t most_dn, int32_t *down,
              int32_t *across)
{
    const int32_t steps = columns - 1;
    memset(across, 0, 2 * (size_t)steps * sizeof *across);
    for (int32_t y = 0; y < rows; y++) {
        const uint8_t *row = image + y * stride;
        add_across(row, steps, most_dn, across + (y < rows / 2 ? 0 : steps));
        if (y == rows - 1) return;
        down[2 * y] = sum_down(row, stride, 0, columns / 2, most_dn);
        down[2 * y + 1] = sum_down(row, stride, columns / 2, columns, most_dn);
    }
}
