/* The kernels of MassSpringDamper written in C by hand, for the same layer: what a compiled one has to compete with.

   The struct is the component's record: its variables in their declared order (bench/native.py checks that it is). */

#include "kernel.h"

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
    double usual_position;
    double usual_velocity;
    double force_slope;
    double known_step;
    double transition[4];
    double held_response;
    double ramp_response;
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

/* (1 - exp(-x)) / x and its like one order higher, (x - 1 + exp(-x)) / x^2. */
static void mean_decays(double x, double *once, double *twice) {
    if (x > 1.0) {
        *once = (1.0 - exp(-x)) / x;
        *twice = (1.0 - *once) / x;
        return;
    }
    double term = *twice = 0.5;
    for (int n = 3; n < 24; n++) {
        term *= -x / n;
        *twice += term;
    }
    *once = 1.0 - x * *twice;
}

/* Displacements after h from rest, under a unit acceleration and under one that rises by one a second. */
static void oscillator_forcing(const double *transition, double wn, double zeta, double h, double *held, double *ramp) {
    const double stiffness = wn * wn, damping = 2.0 * zeta * wn;
    if (stiffness * h * h < 1.0 && damping * h < 1.0) {
        double earlier = 0.0, term = 0.5 * h * h;
        *held = term;
        *ramp = term * h / 3.0;
        for (int n = 2; n < 24; n++) {
            const double following = -(damping * h * term + stiffness * h * h * earlier / n) / (n + 1);
            earlier = term;
            term = following;
            *held += term;
            *ramp += term * h / (n + 2);
        }
    } else if (zeta > 2.0) {
        const double spread = wn * sqrt(zeta * zeta - 1.0), fast = 0.5 * damping + spread;
        double slow_once, slow_twice, fast_once, fast_twice;
        mean_decays(stiffness / fast * h, &slow_once, &slow_twice);
        mean_decays(fast * h, &fast_once, &fast_twice);
        *held = 0.5 * h * (slow_once - fast_once) / spread;
        *ramp = 0.5 * h * h * (slow_twice - fast_twice) / spread;
    } else {
        *held = (1.0 - transition[0]) / stiffness;
        *ramp = (h - transition[1] - damping * *held) / stiffness;
    }
}

int kernel_start(void *record, Fault *fault) {
    MassSpringDamper *m = record;
    (void)fault;
    m->natural_frequency = sqrt(m->stiffness / m->mass);
    m->damping_ratio = 0.5 * m->damping / sqrt(m->stiffness * m->mass);
    m->usual_position = 1.0 / m->stiffness;
    m->usual_velocity = m->natural_frequency / m->stiffness;
    return 0;
}

int kernel_step(void *record, double t, double h, Fault *fault) {
    MassSpringDamper *m = record;
    (void)fault, (void)t;
    if (h > 0.0) {
        if (h != m->known_step) {
            m->known_step = h;
            oscillator_transition(m->transition, m->natural_frequency, m->damping_ratio, h);
            oscillator_forcing(m->transition, m->natural_frequency, m->damping_ratio, h, &m->held_response, &m->ramp_response);
        }
        const double unbalanced = (m->force - m->stiffness * m->position) / m->mass, growing = m->force_slope / m->mass;
        const double speed = m->velocity;
        m->position += m->transition[1] * speed + m->held_response * unbalanced + m->ramp_response * growing;
        m->velocity = m->transition[3] * speed + m->transition[1] * unbalanced + m->held_response * growing;
        m->force += m->force_slope * h;
    }
    m->acceleration = (m->force - m->damping * m->velocity - m->stiffness * m->position) / m->mass;
    return 0;
}
