/* The kernels of MassSpringDamper written in C by hand, for the same layer: what a compiled one has to compete with.

   The struct is the component's record: its variables in their declared order (bench/native.py checks that it is). */

#include <math.h>

typedef struct {
    int left_limits;
    double force;
    double mass;
    double stiffness;
    double damping;
    double natural_frequency;
    double damping_ratio;
    double position;
    double velocity;
    double acceleration;
    double known_step;
    double transition[4];
} MassSpringDamper;

/* exp(A h), row by row, for A = [[0, 1], [-wn^2, -2 zeta wn]]. */
static void oscillator_transition(double *restrict transition, double wn, double zeta, double h) {
    const double stiffness = wn * wn, decay = zeta * wn;
    const double square = (zeta * zeta - 1.0) * stiffness * h * h;
    double cosine, sine;
    if (fabs(square) < 1e-2) { /* near critical damping the closed forms cancel; the series has converged at this order */
        const double envelope = exp(-decay * h);
        cosine = envelope * (1.0 + square / 2.0 * (1.0 + square / 12.0 * (1.0 + square / 30.0 * (1.0 + square / 56.0))));
        sine = envelope * h * (1.0 + square / 6.0 * (1.0 + square / 20.0 * (1.0 + square / 42.0 * (1.0 + square / 72.0))));
    } else if (square < 0.0) {
        const double damped = wn * sqrt(1.0 - zeta * zeta), envelope = exp(-decay * h);
        cosine = envelope * cos(damped * h);
        sine = envelope * sin(damped * h) / damped;
    } else {
        const double spread = wn * sqrt(zeta * zeta - 1.0);
        const double slow = exp(-stiffness / (decay + spread) * h), fast = exp(-(decay + spread) * h);
        cosine = 0.5 * (slow + fast);
        sine = 0.5 * (slow - fast) / spread;
    }
    transition[0] = cosine + decay * sine;
    transition[1] = sine;
    transition[2] = -stiffness * sine;
    transition[3] = cosine - decay * sine;
}

int kernel_start(int *status, void **unused, void *record) {
    MassSpringDamper *m = record;
    (void)unused;
    m->natural_frequency = sqrt(m->stiffness / m->mass);
    m->damping_ratio = 0.5 * m->damping / sqrt(m->stiffness * m->mass);
    *status = 0;
    return 0;
}

int kernel_step(int *status, void **unused, void *record, double t, double h) {
    MassSpringDamper *m = record;
    (void)unused, (void)t;
    if (h > 0.0) {
        if (h != m->known_step) {
            m->known_step = h;
            oscillator_transition(m->transition, m->natural_frequency, m->damping_ratio, h);
        }
        const double rest = m->force / m->stiffness;
        const double deviation = m->position - rest, speed = m->velocity;
        m->position = rest + m->transition[0] * deviation + m->transition[1] * speed;
        m->velocity = m->transition[2] * deviation + m->transition[3] * speed;
    }
    m->acceleration = (m->force - m->damping * m->velocity - m->stiffness * m->position) / m->mass;
    *status = 0;
    return 0;
}
