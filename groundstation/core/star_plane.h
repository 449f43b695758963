/* Arithmetic of points and turns of the ceiling plane. */
#ifndef GROUNDSTATION_STAR_PLANE_H
#define GROUNDSTATION_STAR_PLANE_H

#include "api.h"

#include <math.h>

static inline Point add(Point a, Point b) { return (Point){a.x + b.x, a.y + b.y}; }

static inline Point sub(Point a, Point b) { return (Point){a.x - b.x, a.y - b.y}; }

static inline Point scaled(Point a, double factor) { return (Point){a.x * factor, a.y * factor}; }

/* a b, as complex numbers: b turned by a. */
static inline Point turned(Point a, Point b) { return (Point){a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x}; }

/* conj(a) b: b turned back by a. */
static inline Point turned_back(Point a, Point b) { return (Point){a.x * b.x + a.y * b.y, a.x * b.y - a.y * b.x}; }

static inline double dot(Point a, Point b) { return a.x * b.x + a.y * b.y; }

static inline double length_of(Point a) { return sqrt(a.x * a.x + a.y * a.y); }

static inline Point unit_at(double angle_rad) { return (Point){cos(angle_rad), sin(angle_rad)}; }

#endif
