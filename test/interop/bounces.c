/* A disk on an oscillating platform as a map for AUTO-07p: IMPACTS impacts in as many periods.

   Written from the paper's equations of flight and impact (eq. 2a), with nothing of the package:
   the state is the forcing phase and the disk's velocity just after an impact. Unit of time:
   1/omega, of velocity: pi g/omega. Parameters: axial forcing, restitution. */
#include <auto_f2c.h>

static const double PI = 3.14159265358979323846;

/* From one impact to the next; also the derivatives by phase, velocity, forcing, restitution. */
static void flight(double *phase, double *launch, double forcing, double restitution,
                   double by_phase[4], double by_launch[4])
{
    const double t = *phase, v = *launch;
    double since = 1e-3, speed, gap;
    do { /* to the first sign change of the gap, then Newton's method */
        since += 1e-3;
        gap = v * since - since * since / (2.0 * PI) - forcing * (sin(t + since) - sin(t));
    } while (gap > 0.0 && since < 100.0);
    for (int i = 0; i < 8; i++) {
        gap = v * since - since * since / (2.0 * PI) - forcing * (sin(t + since) - sin(t));
        speed = v - since / PI - forcing * cos(t + since);
        since -= gap / speed;
    }
    const double s = sin(t + since), c = cos(t + since);
    const double arrival = v - since / PI;
    speed = arrival - forcing * c;
    const double gap_by[4] = {-forcing * (c - cos(t)), since, -(s - sin(t)), 0.0};
    const double rest[4] = {-(1.0 + restitution) * forcing * s, -restitution,
                            (1.0 + restitution) * c, forcing * c - arrival};
    for (int k = 0; k < 4; k++) {
        const double duration_by = -gap_by[k] / speed;
        by_phase[k] = (k == 0) + duration_by;
        by_launch[k] = rest[k] + duration_by * (restitution / PI
                                                - (1.0 + restitution) * forcing * s);
    }
    *phase = t + since;
    *launch = (1.0 + restitution) * forcing * c - restitution * arrival;
}

int func(integer ndim, const doublereal *u, const integer *icp, const doublereal *par,
         integer ijac, doublereal *f, doublereal *dfdu, doublereal *dfdp)
{
    double total[2][4] = {{1.0, 0.0, 0.0, 0.0}, {0.0, 1.0, 0.0, 0.0}}, one[2][4];
    f[0] = u[0];
    f[1] = u[1];
    for (int i = 0; i < IMPACTS; i++) {
        flight(&f[0], &f[1], par[0], par[1], one[0], one[1]);
        for (int k = 0; k < 4; k++) {
            const double a = total[0][k], b = total[1][k];
            for (int j = 0; j < 2; j++)
                total[j][k] = one[j][0] * a + one[j][1] * b + (k > 1 ? one[j][k] : 0.0);
        }
    }
    f[0] -= 2.0 * PI * IMPACTS;
    for (int j = 0; ijac > 0 && j < 2; j++)
        for (int k = 0; k < 2; k++) {
            dfdu[j + 2 * k] = total[j][k];
            if (ijac > 1) dfdp[j + 2 * k] = total[j][2 + k];
        }
    return 0;
}

/* The start: the orbit is stable there, so the map goes to it. */
int stpnt(integer ndim, doublereal t, doublereal *u, doublereal *par)
{
    double unused[2][4];
    par[0] = FORCING;
    par[1] = RESTITUTION;
    u[0] = acos((1.0 - par[1]) / (1.0 + par[1]) / par[0]) + 0.01;
    u[1] = 1.0;
    for (int i = 0; i < 4000; i++)
        flight(&u[0], &u[1], par[0], par[1], unused[0], unused[1]);
    u[0] = fmod(u[0], 2.0 * PI);
    return 0;
}

int bcnd(integer ndim, const doublereal *par, const integer *icp, integer nbc,
         const doublereal *u0, const doublereal *u1, integer ijac, doublereal *f, doublereal *dbc)
{ return 0; }
int icnd(integer ndim, const doublereal *par, const integer *icp, integer nint,
         const doublereal *u, const doublereal *uold, const doublereal *udot,
         const doublereal *upold, integer ijac, doublereal *fi, doublereal *dint)
{ return 0; }
int fopt(integer ndim, const doublereal *u, const integer *icp, const doublereal *par,
         integer ijac, doublereal *fs, doublereal *dfdu, doublereal *dfdp)
{ return 0; }
int pvls(integer ndim, const doublereal *u, doublereal *par)
{ return 0; }
