/* Order statistics of small samples. */
#include "star_tracker.h"

/* The k-th smallest (from 0) of n values, which are reordered. Three-way partition: equal values and even NaN end. */
double kth_smallest(double *values, int64_t n, int64_t k)
{
    int64_t low = 0, high = n - 1;
    while (low < high) {
        const double pivot = values[(low + high) / 2];
        int64_t less = low, at = low, more = high;
        while (at <= more) {
            const double value = values[at];
            if (value < pivot) {
                values[at++] = values[less];
                values[less++] = value;
            } else if (value > pivot) {
                values[at] = values[more];
                values[more--] = value;
            } else {
                at++;
            }
        }
        if (k < less) {
            high = less - 1;
        } else if (k > more) {
            low = more + 1;
        } else {
            return values[k];
        }
    }
    return values[k];
}

/* The upper median, as robust.middle_value. */
double middle_value(double *values, int64_t n) { return kth_smallest(values, n, n / 2); }
