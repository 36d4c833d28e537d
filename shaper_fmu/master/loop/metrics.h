/* Metrics: a few numbers of a run, gathered at every macro step and on both sides of every event. */

#ifndef METRICS_H
#define METRICS_H

#include "loop.h"

/* Take the values at t into the metrics; see metrics/metric.py for what they are. */
void measure(const System *system, double t);

#endif
