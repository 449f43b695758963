/* The log Bayes factor of a match over chance (derived in tests/oracles/evidence.py). */
#include "star_tracker.h"

static const double two_pi = 6.283185307179586;

double evidence_nats(const SearchSettings *settings, double density_m2, double volume, double scale_m_px, int64_t n,
                     const double *distance2_m2, double lever_m, int64_t spots)
{
    const double stray = settings->stray_ratio;
    double best = -INFINITY, sum = 0.0;
    for (int64_t k = 0; k < settings->sigmas; k++) {
        const double sigma = settings->sigmas_px[k] * scale_m_px, sigma2 = sigma * sigma;
        const double height = (1.0 - stray) / density_m2 / (two_pi * sigma2);
        double matched = 0.0;
        for (int64_t i = 0; i < n; i++) {
            matched += log(stray + height * exp(-0.5 * distance2_m2[i] / sigma2));
        }
        const double posterior = pow(two_pi, 1.5) * sigma2 * sigma / ((double)n * fmax(lever_m, 1e-6));
        const double term = matched + log(fmin(posterior / volume, 1.0));
        /* The sum of exponentials, carried on with the largest term so far taken out. */
        if (term > best) {
            sum = sum * exp(best - term) + 1.0;
            best = term;
        } else {
            sum += exp(term - best);
        }
    }
    return (double)(spots - n) * log(stray) + best + log(sum / (double)settings->sigmas);
}
