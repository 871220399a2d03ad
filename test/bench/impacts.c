/* The axial problem in scalar C, as fast as it can honestly be made: the yardstick of `make bench`.

   Dimensionless (time 1/w, length pi g/w^2): platform G sin(tau), gravity 1/pi. The same idea of a
   certified first root as in the core: leave out the flight above the crest, take steps on a
   parabola that lies below the gap and, where one root is proven ahead, steps of fifth order. What
   it may do and the core may not: libm, fused multiply-add (so its last bits depend on the machine)
   and absolute positions (so it has no digits left for tiny bounces; it knows no chatter at all). */
#define _GNU_SOURCE
#include <math.h>

#define TURN 6.283185307179586476925286766559
#define GRAVITY 0.31830988618379067153776752674503

static inline double safe_step(double h, double h1, double k) {
    const double q = sqrt(h1 * h1 + 2.0 * k * h);
    return h1 < 0.0 ? 2.0 * h / (q - h1) : (h1 + q) / k;
}

/* n impacts after a launch at phase tau with relative speed u; out: phase and |w_A| of each. */
long impacts(double forcing, double restitution, double tau, double u, double *out, long n) {
    const double g = GRAVITY, k = g + forcing;
    long turns = 0;
    double s, c;
    sincos(tau, &s, &c);
    for (long i = 0; i < n; i++) {
        const double x0 = forcing * s, v0 = forcing * c + u;
        const double rise = v0 * v0 + 2.0 * g * (x0 - forcing);
        double d, h, h1, w, x;
        if (rise > 0.0 && v0 > 0.0)
            d = (v0 + sqrt(rise)) * (1.0 / GRAVITY); /* above the crest until then */
        else
            d = safe_step(0.0, u, k);
        for (;;) {
            sincos(tau + d, &s, &c);
            h = x0 + d * (v0 - 0.5 * g * d) - forcing * s;
            h1 = v0 - g * d - forcing * c;
            if (h1 < 0.0 && 4.0 * k * h <= h1 * h1) break; /* one root ahead, or just passed */
            d += fmax(safe_step(fmax(h, 0.0), h1, k), 4e-16 * d);
        }
        for (int j = 0;; j++) {
            const double h2 = forcing * s - g, h3 = forcing * c, h4 = -forcing * s;
            const double r = 1.0 / h1, v = -h * r;
            const double a2 = 0.5 * h2 * r, a3 = h3 * r * (1.0 / 6.0), a4 = h4 * r * (1.0 / 24.0);
            const double b3 = 2.0 * a2 * a2 - a3, b4 = 5.0 * a2 * (a3 - a2 * a2) - a4;
            x = v - v * v * (a2 - v * (b3 + v * b4));
            d += x;
            w = h1 + x * (h2 + x * (0.5 * h3 + x * (h4 * (1.0 / 6.0))));
            if (fabs(x) < 5e-4 || j == 12) break; /* x^5 is below rounding */
            sincos(tau + d, &s, &c);
            h = x0 + d * (v0 - 0.5 * g * d) - forcing * s;
            h1 = v0 - g * d - forcing * c;
        }
        /* sine and cosine of the launch: those at hand, turned by the last small step */
        const double z = x * x;
        const double sx = x - x * z * (1.0 / 6.0 - z * (1.0 / 120.0));
        const double cx = z * (0.5 - z * (1.0 / 24.0));
        const double turned = s + (c * sx - s * cx);
        c -= s * sx + c * cx;
        s = turned;
        tau += d;
        const double whole = floor(tau * (1.0 / TURN));
        tau -= whole * TURN;
        turns += (long)whole;
        u = -restitution * w;
        out[2 * i] = tau;
        out[2 * i + 1] = -w;
    }
    return turns;
}

/* How far ahead the core looks: n times ten divisions, each of the one before it, and with `other`
   180 independent instructions besides. Those cost next to nothing where the core reaches the next
   divisions in time; where it shares its buffers with another thread they cost a quarter. */
double divisions(long n, int other) {
    double x = 1.0;
    for (long i = 0; i < n; i++) {
#pragma GCC unroll 10
        for (int j = 0; j < 10; j++) {
            x = 1.0 / (x + 1.0);
            __asm__ volatile("" : "+x"(x));
        }
        if (other) {
            long y = i;
            __asm__ volatile(".rept 60\n\timul %0, %0\n\tnop\n\tnop\n\t.endr" : "+r"(y));
        }
    }
    return x;
}
