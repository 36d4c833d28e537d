/* What is gathered, by the metric's kind. Comparisons are written so that they mean the same as Python's min and max. */

#include "metrics.h"

#include <math.h>

static double larger(double a, double b) { return b > a ? b : a; }

static double smaller(double a, double b) { return b < a ? b : a; }

/* Begin at t, with the value x. */
static void begin_anew(Metric *metric, double x, double t) {
    metric->begin = t;
    metric->first = x;
    metric->sum = metric->kind == GATHER_OUTSIDE ? t : 0.0;
    metric->largest = metric->kind == GATHER_ENVELOPE ? 0.0 : x;
    metric->smallest = x;
}

static void take(Metric *metric, const double *bus, double x, double t) {
    int anew = isnan(metric->time);
    if (metric->command >= 0) {
        const double command = bus[metric->command];
        anew = anew || command != metric->commanded;
        metric->commanded = command;
    }
    if (anew)
        begin_anew(metric, x, t);
    else if (metric->kind == GATHER_SQUARE)
        metric->sum += metric->last * metric->last * (t - metric->time);
    if (metric->kind == GATHER_ENVELOPE)
        metric->largest = larger(metric->largest, hypot(x - metric->rest, bus[metric->rate] / metric->parameter));
    else
        metric->largest = larger(metric->largest, x);
    metric->smallest = smaller(metric->smallest, x);
    if (metric->kind == GATHER_OUTSIDE && fabs(x - metric->rest) > metric->parameter) metric->sum = t;
    if (isnan(x)) metric->largest = metric->smallest = metric->sum = x; /* which comparisons pass over */
}

void measure(const System *system, double t) {
    const double *const bus = system->bus.at;
    for (size_t i = 0; i < system->metrics.count; i++) {
        Metric *const metric = &system->metrics.at[i];
        const double x = bus[metric->place];
        const int unmoved = metric->command < 0 || bus[metric->command] == metric->commanded;
        const int within = metric->kind == GATHER_EXTREMES && metric->smallest <= x && x <= metric->largest;
        if (!(within && unmoved && !isnan(metric->time))) take(metric, bus, x, t); /* else nothing is new, as in most steps */
        metric->last = x;
        metric->time = t;
    }
}
