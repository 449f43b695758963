/* The exponential and the normal distribution, for loops that the compiler turns into vectors.
 *
 * The C library's own are a call per number, and choose other instructions (other last bits) on other machines.
 */
#ifndef GROUNDSTATION_GAUSSIAN_H
#define GROUNDSTATION_GAUSSIAN_H

#include "core.h"

#include <string.h>

/* exp(x) for x from -708 (smaller ones are taken as that) to 700, within two units of the last place.
 * x = n ln 2 + r with |r| <= ln 2 / 2, and the Taylor series of exp(r) up to r^13. */
GS_INLINE double exponential(double x)
{
    const double round_off = 0x1.8p52; /* adding it leaves a whole number in the low bits */
    const double low = x < -708.0 ? -708.0 : x;
    const double shifted = low * 0x1.71547652b82fep0 + round_off; /* 1 / ln 2 */
    const double n = shifted - round_off;
    const double r = (low - n * 0x1.62e42fefa3800p-1) - n * 0x1.ef35793c76730p-45; /* ln 2 in two parts */
    double p = 1.0 / 6227020800.0;
    p = p * r + 1.0 / 479001600.0;
    p = p * r + 1.0 / 39916800.0;
    p = p * r + 1.0 / 3628800.0;
    p = p * r + 1.0 / 362880.0;
    p = p * r + 1.0 / 40320.0;
    p = p * r + 1.0 / 5040.0;
    p = p * r + 1.0 / 720.0;
    p = p * r + 1.0 / 120.0;
    p = p * r + 1.0 / 24.0;
    p = p * r + 1.0 / 6.0;
    p = p * r + 0.5;
    p = p * r + 1.0;
    p = p * r + 1.0;
    int64_t bits;
    memcpy(&bits, &shifted, sizeof bits);
    bits = (int64_t)((uint64_t)(bits + 1023) << 52); /* 2^n: the rest of round_off is shifted out */
    double scale;
    memcpy(&scale, &bits, sizeof scale);
    return p * scale;
}

/* The normal distribution below x, given gauss = exp(-x^2 / 2), to 1e-12.
 * Beyond |x| it is gauss erfcx(z) / 2 with z = |x| / sqrt 2; erfcx(z) / t with t = 3.5 / (3.5 + z) is a smooth function of
 * t on (0, 1], here the Chebyshev fit of degree 16 (relative error 9.5e-13), written in powers of 2 t - 1. */
GS_INLINE double normal_below(double x, double gauss)
{
    const double z = (x < 0.0 ? -x : x) * 0x1.6a09e667f3bcdp-1;
    const double t = 3.5 / (3.5 + z), s = 2.0 * t - 1.0;
    double p = 7.968457562997052e-08; /* written out: a loop here keeps the loop around it from becoming vectors */
    p = p * s + 1.3415854198795356e-07;
    p = p * s - 8.415057891990988e-07;
    p = p * s - 1.929054676046255e-06;
    p = p * s + 5.2073853637532646e-06;
    p = p * s + 2.124347767204573e-05;
    p = p * s - 1.1949780204869091e-05;
    p = p * s - 0.000204090392958437;
    p = p * s - 0.0003729813536261138;
    p = p * s + 0.0009077107192802771;
    p = p * s + 0.007576752895164257;
    p = p * s + 0.02637677612612339;
    p = p * s + 0.06449674862405344;
    p = p * s + 0.12435886457903408;
    p = p * s + 0.19831818476825153;
    p = p * s + 0.26794277845181;
    p = p * s + 0.310587311217694;
    const double beyond = 0.5 * gauss * t * p;
    return x < 0.0 ? beyond : 1.0 - beyond;
}

#endif
