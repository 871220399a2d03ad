/* Single tosses in scalar C: the yardstick of maps/lanes/toss_lanes.py in `make bench`.

   One ride after the other, with the sines, arc sines and arc tangents of libm. With x = wt, speeds
   over w, and everything over Iw^2, a slip obeys sign*w_T = K - fall*x - (p cos x - q sin x), so that
   its drive p sin x + q cos x - fall is one sinusoid: its zeros, the extremes of the slip, and the end
   of sticking have closed forms, and only the end of a slip needs steps, on a monotone piece. It may
   do what the core may not: absolute phases, fused multiply-add. No load torque, friction above 0. */
#define _GNU_SOURCE
#include <math.h>

#define TURN 6.283185307179586476925286766559
#define LAST_SLIP 1e-8 /* the core's: a slip that begins so close to separation is none */

struct at { double x, s, c; };
struct ride { double turning, st, ct, rise, fall; struct at end; };
struct drive { double p, q, square, root; }; /* root^2 = p^2 + q^2 - fall^2: below 0 without zeros */

static inline double sine_b(const struct ride *r, struct at a) { return r->turning * (a.s * r->ct + a.c * r->st); }
static inline double cosine_b(const struct ride *r, struct at a) { return r->turning * (a.c * r->ct - a.s * r->st); }

static inline double drag(const struct ride *r, struct at a) { /* integral of (load x platform speed) */
    const double sb = a.s * r->ct + a.c * r->st, cb = a.c * r->ct - a.s * r->st;
    return r->turning * (r->fall * sb + r->rise * (0.25 * (a.c * cb - a.s * sb) + 0.5 * a.x * r->st));
}

static inline struct drive drive_of(const struct ride *r, double sign) {
    struct drive d = {r->rise + sign * r->turning * r->ct, sign * r->turning * r->st, 0.0, -1.0};
    d.square = d.p * d.p + d.q * d.q;
    const double rest = d.square - r->fall * r->fall;
    if (rest > 0.0) d.root = sqrt(rest);
    return d;
}

/* where the drive next passes zero, upward (up = 1) or downward (-1) */
static inline struct at zero(const struct ride *r, const struct drive *d, double up, struct at a) {
    const double k = up * d->root, f = r->fall, over = 1.0 / d->square;
    const double s = (f * d->p - k * d->q) * over, c = (k * d->p + f * d->q) * over;
    const double ahead = atan2(s * a.c - c * a.s, c * a.c + s * a.s);
    return (struct at){a.x + (ahead < 0.0 ? ahead + TURN : ahead), s, c};
}

/* whether the upward zero of one drive comes before that of the other: no arc tangent needed */
static inline double way(const struct ride *r, const struct drive *d, struct at a) {
    const double s = r->fall * d->p - d->root * d->q, c = d->root * d->p + r->fall * d->q;
    const double y = s * a.c - c * a.s, z = (c * a.c + s * a.s) / d->square;
    return y >= 0.0 ? 1.0 - z : 3.0 + z;
}

static inline double slip(const struct ride *r, const struct drive *d, double k, struct at a) {
    return k - r->fall * a.x - (d->p * a.c - d->q * a.s);
}

/* the zero of a slip that falls from `a`, where it is above 0, to `b`, where it is not */
static struct at fallen(const struct ride *r, const struct drive *d, double k, struct at a, double b) {
    double low = a.x;
    for (int i = 0; i < 60; i++) {
        const double f = slip(r, d, k, a), f3 = -(d->p * a.s + d->q * a.c), f1 = -f3 - r->fall;
        const double f2 = d->p * a.c - d->q * a.s, inside = f1 * f1 - 2.0 * f * f2;
        if (f > 0.0) low = a.x; else b = a.x;
        double step = f == 0.0 ? 0.0 : inside >= 0.0 ? 2.0 * f / (sqrt(inside) - f1) : INFINITY;
        const double t = step, here = f1 + t * (f2 + t * (0.5 * f3 - t * f2 * (1.0 / 6.0)));
        const double more = t * t * t * (f3 * (1.0 / 6.0) - t * (f2 * (1.0 / 24.0) + t * f3 * (1.0 / 120.0)));
        if (here < 0.0) step -= more / here;
        if (fabs(step) < 1e-3 && here < 0.5 * f1) { /* what is left out is below rounding */
            const double y = step * step, u = step - step * y * (1.0 / 6.0 - y * (1.0 / 120.0));
            const double v = y * (0.5 - y * (1.0 / 24.0));
            return (struct at){a.x + step, a.s + (a.c * u - a.s * v), a.c - (a.s * u + a.c * v)};
        }
        a.x += step;
        if (!(a.x > low && a.x < b)) a.x = 0.5 * (low + b);
        if (b - low < 4e-16 * b) return a;
        sincos(a.x, &a.s, &a.c);
    }
    return a;
}

/* the first zero of a slip after `a`, up to separation: 1 and where, or 0 */
static int slip_ends(const struct ride *r, double sign, double k, struct at a, int grows, struct at *found) {
    const struct drive d = drive_of(r, sign);
    const int below = slip(r, &d, k, r->end) <= 0.0;
    if (d.root >= 0.0) {
        grows = grows || d.p * a.s + d.q * a.c > r->fall;
        if (!grows) {
            const struct at least = zero(r, &d, 1.0, a);
            if (least.x < r->end.x) {
                if (slip(r, &d, k, least) <= 0.0) {
                    *found = fallen(r, &d, k, a, least.x);
                    return 1;
                }
                a = least, grows = 1;
            }
        }
        if (grows) {
            a = zero(r, &d, -1.0, a);
            if (a.x >= r->end.x) return 0;
            const struct at least = zero(r, &d, 1.0, a);
            if (least.x < r->end.x) {
                if (slip(r, &d, k, least) > 0.0) return 0; /* the next fall begins a turn later */
                *found = fallen(r, &d, k, a, least.x);
                return 1;
            }
        }
    }
    if (!below) return 0;
    *found = fallen(r, &d, k, a, r->end.x);
    return 1;
}

/* where sticking fails: out with which sign */
static double stick_fails(const struct ride *r, struct at *a) {
    const struct drive up = drive_of(r, 1.0), down = drive_of(r, -1.0);
    if (up.root < 0.0 && down.root < 0.0) return 0.0;
    const int first = down.root < 0.0 || (up.root >= 0.0 && way(r, &up, *a) <= way(r, &down, *a));
    *a = zero(r, first ? &up : &down, 1.0, *a);
    return first ? 1.0 : -1.0;
}

/* from `a` with speed v to separation: speed and work there; 1: it left sticking */
static int go(const struct ride *r, struct at a, double v, double *speed, double *work) {
    const double load = r->fall - r->rise * a.s, w = v - cosine_b(r, a), b = sine_b(r, a);
    int sticks = w == 0.0 && fabs(b) <= load, grows = w == 0.0;
    double sign = (w == 0.0 ? b : w) > 0.0 ? 1.0 : -1.0, done = 0.0;
    double k = sign * v + r->fall * a.x + r->rise * a.c;
    for (;;) {
        if (sticks) {
            struct at fails = a;
            const double out = stick_fails(r, &fails), before = cosine_b(r, a);
            const int stays = out == 0.0 || fails.x > r->end.x - LAST_SLIP;
            const double after = cosine_b(r, stays ? r->end : fails);
            done += 0.5 * (after - before) * (after + before);
            if (stays) {
                *speed = after, *work = done;
                return 1;
            }
            a = fails, sign = out, sticks = 0, grows = 1;
            k = sign * after + r->fall * a.x + r->rise * a.c;
        }
        struct at ends;
        const int touches = slip_ends(r, sign, k, a, grows, &ends);
        if (!touches) ends = r->end;
        done -= sign * (drag(r, ends) - drag(r, a));
        if (!touches) {
            *speed = sign * (k - r->fall * ends.x - r->rise * ends.c), *work = done;
            return 0;
        }
        a = ends;
        const double need = sine_b(r, a);
        sticks = fabs(need) <= r->fall - r->rise * a.s, grows = 1;
        sign = need > 0.0 ? 1.0 : -1.0;
        k = sign * cosine_b(r, a) + r->fall * a.x + r->rise * a.c;
    }
}

/* rows of starts: A, Phi, theta, tau, speed; of out: speed, delay, axial and angular work, SI units.
   Codes as core/ride.py: 0 slid, 1 stuck, 2 in flight at once, 3 stays. g is with the preload. */
void tosses(const double *starts, long n, double omega, double grip, double g, double mass, double inertia,
            double *out, signed char *codes) {
    const double fall = g / (omega * omega);
    for (long i = 0; i < n; i++, starts += 5, out += 4) {
        const double amplitude = starts[0], v = starts[4] / omega;
        struct ride r = {.turning = starts[1], .rise = grip * amplitude, .fall = grip * fall};
        struct at a = {.x = starts[3]};
        sincos(a.x, &a.s, &a.c);
        sincos(starts[2], &r.st, &r.ct);
        out[0] = starts[4], out[1] = out[2] = out[3] = 0.0;
        codes[i] = 2;
        if (amplitude <= fall) {
            out[0] = out[1] = out[2] = out[3] = NAN, codes[i] = 3;
        } else if (amplitude * a.s < fall) {
            const double s = fall / amplitude, leave = asin(s), rate = amplitude * omega;
            r.end = (struct at){leave > a.x ? leave : leave + TURN, s, sqrt((1.0 - s) * (1.0 + s))};
            double speed, work;
            codes[i] = (signed char)go(&r, a, v, &speed, &work);
            out[0] = omega * speed, out[1] = (r.end.x - a.x) / omega;
            out[2] = mass * (s - a.s) * (g * amplitude - 0.5 * rate * rate * (s + a.s));
            out[3] = inertia * omega * omega * work;
        }
    }
}
