/* Many trajectories of the axial problem in vectorised C: the yardstick of the lanes in `make bench`.

   The same idea as in maps/lanes/lane_basics.py, in rounds over 64 lanes that the compiler vectorises: launch,
   two looks at the gap, landing. As in impacts.c it may do what the core may not: fused
   multiply-add and absolute positions, so it needs two sines an impact where the core needs three,
   and has no digits left for tiny bounces. A chatter is complete by the rule of the core; what
   comes after contact it does not know.

   It becomes vectors of 64, 32 or 16 bytes with -march=native (AVX-512), haswell or x86-64: loads
   stand before the choices, and most choices are joined by | and &, for without AVX a conditional
   load or a branch is no vector. */
#include <math.h>
#include <string.h>

#define N 64
#define TURN 6.283185307179586476925286766559
#define GRAVITY 0.31830988618379067153776752674503
#define FOR _Pragma("omp simd") for (int i = 0; i < N; i++)
#define ROUNDER 6755399441055744.0 /* 1.5 * 2^52 */

/* What a processor lacks would be a call of the C library, and no vector. */
#ifdef __FMA__
#define MULTIPLY_ADD(a, b, c) fma(a, b, c)
#else
#define MULTIPLY_ADD(a, b, c) ((a) * (b) + (c))
#endif
#ifdef __AVX__
#define BOTH(a, b) ((a) && (b)) /* a twentieth faster than & */
#else
#define BOTH(a, b) ((a) & (b)) /* no branch: without masked loads one would be no vector */
#endif
#ifdef __SSE4_1__
#define NEAREST(x) nearbyint(x)
#define DOWN(x) floor(x)
#else
#define NEAREST(x) (((x) + ROUNDER) - ROUNDER)
#define DOWN(x) (NEAREST(x) - (NEAREST(x) > (x) ? 1.0 : 0.0))
#endif

static inline double larger(double a, double b) { return a > b ? a : b; }
static inline double smaller(double a, double b) { return a < b ? a : b; }

struct lanes {
    double tau[N], s[N], c[N], u[N], w[N], d[N], x0[N], v0[N], end[N], begin[N], slope[N], step[N];
    double hit[N], left[N], run[N], forcing, restitution;
    long job[N];
} __attribute__((aligned(64)));

/* sine and cosine of 0 <= x < 1e6 by Taylor polynomials on [-pi/4, pi/4] */
static inline __attribute__((always_inline)) void turn(double x, double *s, double *c) {
    const double k = NEAREST(x * (4.0 / TURN));
    double r = MULTIPLY_ADD(-k, 0x1.921fb54400000p+0, x);
    r = MULTIPLY_ADD(-k, 0x1.0b4611a600000p-34, r);
    r = MULTIPLY_ADD(-k, 0x1.3198a2e037073p-69, r);
    const double z = r * r;
    double p = MULTIPLY_ADD(z, -1.0 / 1307674368000.0, 1.0 / 6227020800.0);
    p = MULTIPLY_ADD(p, z, -1.0 / 39916800.0);
    p = MULTIPLY_ADD(p, z, 1.0 / 362880.0);
    p = MULTIPLY_ADD(p, z, -1.0 / 5040.0);
    p = MULTIPLY_ADD(p, z, 1.0 / 120.0);
    p = MULTIPLY_ADD(p, z, -1.0 / 6.0);
    double q = MULTIPLY_ADD(z, 1.0 / 20922789888000.0, -1.0 / 87178291200.0);
    q = MULTIPLY_ADD(q, z, 1.0 / 479001600.0);
    q = MULTIPLY_ADD(q, z, -1.0 / 3628800.0);
    q = MULTIPLY_ADD(q, z, 1.0 / 40320.0);
    q = MULTIPLY_ADD(q, z, -1.0 / 720.0);
    q = MULTIPLY_ADD(q, z, 1.0 / 24.0);
    q = MULTIPLY_ADD(q, z, -0.5);
    const double sr = MULTIPLY_ADD(r * z, p, r), cr = MULTIPLY_ADD(z, q, 1.0);
    const double m = k - 4.0 * DOWN(0.25 * k);
    const int odd = (m == 1.0) | (m == 3.0);
    const double a = odd ? cr : sr, b = odd ? sr : cr;
    *s = m >= 2.0 ? -a : a;
    *c = (m == 1.0) | (m == 2.0) ? -b : b;
}

static void launch(struct lanes *z) {
    const double f = z->forcing, g = GRAVITY, k = g + f;
    FOR {
        const double x0 = f * z->s[i], v0 = f * z->c[i] + z->u[i], a = g - x0, u = z->u[i];
        const double q = v0 * v0 + 2.0 * g * (x0 - f), r = sqrt(larger(q, 0.0));
        const int rises = (q > 0.0) & (v0 > 0.0);
        const double end = rises ? (v0 + r) * (1.0 / GRAVITY) : 0.0;
        const double begin = rises ? (v0 - r) * (1.0 / GRAVITY) : 0.0;
        const double sharp = a * a + f * u * (2.0 / 3.0);
        const int sharper = (a > 0.0) & (sharp < k * a);
        double d = (sharper ? 2.0 * u * a : 2.0 * u) / (sharper ? sharp : k);
        d = (begin <= d) & (d < end) ? end : d;
        z->x0[i] = x0, z->v0[i] = v0, z->end[i] = end, z->begin[i] = begin;
        z->d[i] = z->hit[i] > 0.0 ? d : z->d[i];
    }
}

static inline __attribute__((always_inline)) void look(struct lanes *z, int last) {
    const double f = z->forcing, g = GRAVITY, k = g + f;
    FOR {
        const double d = z->d[i], x0 = z->x0[i], v0 = z->v0[i], begin = z->begin[i], end = z->end[i];
        const double s0 = z->s[i], c0 = z->c[i];
        double s, c;
        turn(z->tau[i] + d, &s, &c);
        const double h = x0 + d * (v0 - 0.5 * g * d) - f * s, h1 = v0 - g * d - f * c;
        const double h2 = f * s - g, h3 = f * c, h4 = -f * s, above = larger(h, 0.0);
        const int ahead = BOTH(h1 < 0.0, 4.0 * k * above <= h1 * h1);
        const double root = sqrt(h1 * h1 + 2.0 * k * above);
        const double over = h1 < 0.0 ? 2.0 * above : h1 + root, under = h1 < 0.0 ? root - h1 : k;
        const double r = (ahead ? 1.0 : over) / (ahead ? h1 : under); /* 1/h1, or the safe step */
        const double v = -h * r, a2 = 0.5 * h2 * r, a3 = h3 * r * (1.0 / 6.0), a4 = h4 * r * (1.0 / 24.0);
        const double b3 = 2.0 * a2 * a2 - a3, b4 = 5.0 * a2 * (a3 - a2 * a2) - a4;
        const double x = v - v * v * (a2 - v * (b3 + v * b4));
        double safe = d + larger(r, 4e-16 * d);
        safe = (begin <= safe) & (safe < end) ? end : safe;
        z->d[i] = ahead ? d + x : safe;
        if (last) {
            z->slope[i] = h1 + x * (h2 + x * (0.5 * h3 + x * (h4 * (1.0 / 6.0))));
            z->step[i] = x;
            const int hit = ahead & (fabs(x) < 5e-4);
            z->s[i] = hit ? s : s0;
            z->c[i] = hit ? c : c0;
            z->hit[i] = hit ? 1.0 : 0.0;
        }
    }
}

static int land(struct lanes *z) {
    const double f = z->forcing, e = z->restitution;
    const double cube = 8.0 * f / (0x1p-53 * (1.0 - e) * (1.0 - e) * (1.0 - e));
    long wanted = 0;
    _Pragma("omp simd reduction(+ : wanted)") for (int i = 0; i < N; i++) {
        const int hit = z->hit[i] > 0.0;
        const double x = z->step[i], y = x * x, s = z->s[i], c = z->c[i];
        const double sx = x - x * y * (1.0 / 6.0 - y * (1.0 / 120.0)), cx = y * (0.5 - y * (1.0 / 24.0));
        const double s1 = s + (c * sx - s * cx), c1 = c - (s * sx + c * cx);
        const double tau0 = z->tau[i], w0 = z->w[i], u0 = z->u[i], run0 = z->run[i];
        const double tau = tau0 + z->d[i], t1 = tau - TURN * DOWN(tau * (1.0 / TURN));
        const double slope = z->slope[i], u = hit ? -e * slope : u0;
        z->s[i] = hit ? s1 : s;
        z->c[i] = hit ? c1 : c;
        z->tau[i] = hit ? t1 : tau0;
        z->w[i] = hit ? slope : w0;
        z->u[i] = u;
        z->left[i] -= z->hit[i];
        const double a = GRAVITY - f * z->s[i];
        const int still = (a > 0.0) & (u * u * u * cube <= a * a * a * a);
        z->run[i] = still ? -1.0 : run0;
        wanted += still | (z->left[i] <= 0.0);
    }
    return (int)wanted;
}

static void enter(struct lanes *z, int i, long job, double tau, double w, double left) {
    z->job[i] = job, z->tau[i] = tau, z->w[i] = w, z->s[i] = sin(tau), z->c[i] = cos(tau);
    z->u[i] = -z->restitution * w, z->left[i] = left, z->hit[i] = 1.0, z->run[i] = 0.0;
}

/* n trajectories, `impacts` impacts each, in place; one that chatters to its end stays where it is */
void iterate(double *tau, double *w, long n, double forcing, double restitution, long impacts) {
    struct lanes z;
    memset(&z, 0, sizeof z);
    z.forcing = forcing, z.restitution = restitution;
    long todo = 0, busy = 0;
    for (int i = 0; i < N; i++) {
        z.job[i] = -1;
        enter(&z, i, -1, 1.0, -1.0, INFINITY);
        if (todo < n) enter(&z, i, todo, tau[todo], w[todo], (double)impacts), todo++, busy++;
    }
    while (busy > 0) {
        launch(&z);
        look(&z, 0);
        look(&z, 1);
        if (land(&z) == 0) continue;
        for (int i = 0; i < N; i++) {
            if (z.left[i] > 0.0 && z.run[i] >= 0.0) continue;
            if (z.job[i] >= 0) tau[z.job[i]] = z.tau[i], w[z.job[i]] = z.w[i], busy--;
            enter(&z, i, -1, 1.0, -1.0, INFINITY);
            if (todo < n) enter(&z, i, todo, tau[todo], w[todo], (double)impacts), todo++, busy++;
        }
    }
}

/* Label 1: `confirm` impacts in a row near (t0, w0); 0: chatters to its end; -1: neither by the cap */
void label(const double *tau, const double *w, long n, double forcing, double restitution, double t0,
           double w0, double tolerance, double confirm, long cap, int *out) {
    struct lanes z;
    memset(&z, 0, sizeof z);
    z.forcing = forcing, z.restitution = restitution;
    long todo = 0, busy = 0;
    for (int i = 0; i < N; i++) {
        enter(&z, i, -1, 1.0, -1.0, INFINITY);
        if (todo < n) enter(&z, i, todo, tau[todo], w[todo], (double)cap), todo++, busy++;
    }
    while (busy > 0) {
        launch(&z);
        look(&z, 0);
        look(&z, 1);
        long wanted = land(&z);
        _Pragma("omp simd reduction(+ : wanted)") for (int i = 0; i < N; i++) {
            const double apart = fabs(z.tau[i] - t0), way = smaller(apart, TURN - apart);
            const int near = (way <= tolerance) & (fabs(z.w[i] - w0) <= tolerance);
            const double run0 = z.run[i], longer = near ? run0 + 1.0 : 0.0;
            const double run = (z.hit[i] > 0.0) & (run0 >= 0.0) ? longer : run0;
            z.run[i] = run;
            wanted += run >= confirm;
        }
        if (wanted == 0) continue;
        for (int i = 0; i < N; i++) {
            if (z.left[i] > 0.0 && z.run[i] >= 0.0 && z.run[i] < confirm) continue;
            if (z.job[i] >= 0) out[z.job[i]] = z.run[i] < 0.0 ? 0 : z.run[i] >= confirm ? 1 : -1, busy--;
            enter(&z, i, -1, 1.0, -1.0, INFINITY);
            if (todo < n) enter(&z, i, todo, tau[todo], w[todo], (double)cap), todo++, busy++;
        }
    }
}
