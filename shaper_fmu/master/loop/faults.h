/* What fails is told in the control; nothing else happens until somebody has asked. */

#ifndef FAULTS_H
#define FAULTS_H

#include "loop.h"

/* `where`: the transfer, or -1 - the instance; `element` of a transfer, or the function that was called, or the clock. */
static inline int fail(Control *control, int fault, int status, int where, int element, double t) {
    control->fault = fault;
    control->fault_status = status;
    control->fault_where = where;
    control->fault_element = element;
    control->fault_time = t;
    return 0;
}

/* Whether a call's status lets the run go on; warnings are counted. */
static inline int judge(Control *control, int status, int where, int function, double t) {
    if (status == 0) return 1;
    if (status == 1) {
        control->warnings++;
        control->warned = where;
        return 1;
    }
    return fail(control, FAULT_CALL_FAILED, status, where, function, t);
}

#endif
