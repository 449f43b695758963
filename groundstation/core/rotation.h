/* Rotations by (3, 3) matrices, rows first. */
#ifndef GROUNDSTATION_ROTATION_H
#define GROUNDSTATION_ROTATION_H

#include "core.h"

#include <math.h>
#include <string.h>

static const double small_rad = 1e-6;

/* a b */
GS_INLINE void product3(const double a[9], const double b[9], double out[9])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
}

/* a b' */
GS_INLINE void product3_back(const double a[9], const double b[9], double out[9])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out[3 * i + j] = a[3 * i] * b[3 * j] + a[3 * i + 1] * b[3 * j + 1] + a[3 * i + 2] * b[3 * j + 2];
}

/* a' b */
GS_INLINE void back_product3(const double a[9], const double b[9], double out[9])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[3 * i + j] = a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
}

GS_INLINE void cross3(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/* Rotation by a vector (axis times angle). */
GS_INLINE void turn(const double v[3], double out[9])
{
    const double x = v[0], y = v[1], z = v[2], angle = sqrt(x * x + y * y + z * z);
    double a = 1.0, b = 0.5, c = 1.0 - 0.5 * angle * angle;
    if (angle >= small_rad) {
        const double half = sin(0.5 * angle) / angle;
        a = sin(angle) / angle;
        b = 2.0 * half * half;
        c = cos(angle);
    }
    const double found[9] = {c + b * x * x,     b * x * y - a * z, b * x * z + a * y,
                             b * x * y + a * z, c + b * y * y,     b * y * z - a * x,
                             b * x * z - a * y, b * y * z + a * x, c + b * z * z};
    memcpy(out, found, sizeof found);
}

/* Rotation vector of one * other', its length at most pi. */
GS_INLINE void turn_between(const double one[9], const double other[9], double out[3])
{
    double m[9];
    product3_back(one, other, m);
    const double a = m[0], e = m[4], i = m[8];
    double q[4];
    if (a + e + i > 0.0) {
        q[0] = 1.0 + a + e + i, q[1] = m[7] - m[5], q[2] = m[2] - m[6], q[3] = m[3] - m[1];
    } else if (a >= e && a >= i) {
        q[0] = m[7] - m[5], q[1] = 1.0 + a - e - i, q[2] = m[1] + m[3], q[3] = m[2] + m[6];
    } else if (e >= i) {
        q[0] = m[2] - m[6], q[1] = m[1] + m[3], q[2] = 1.0 - a + e - i, q[3] = m[5] + m[7];
    } else {
        q[0] = m[3] - m[1], q[1] = m[2] + m[6], q[2] = m[5] + m[7], q[3] = 1.0 - a - e + i;
    }
    double size = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (q[0] < 0.0) size = -size;
    for (int k = 0; k < 4; k++) q[k] /= size;
    const double sine = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double scale = sine < small_rad ? 2.0 / q[0] : 2.0 * atan2(sine, q[0]) / sine;
    for (int k = 0; k < 3; k++) out[k] = scale * q[1 + k];
}

#endif
