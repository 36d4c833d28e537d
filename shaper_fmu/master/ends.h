/* What hears of the end of the process while an FMU is called. */

#ifndef ENDS_H
#define ENDS_H

#if defined(__linux__)
#define _GNU_SOURCE /* on_exit, sigaction */
#include <signal.h>
#include <stdlib.h>
#endif

#include "loop.h"

typedef void Answer(int status);

/* Have exit() call `answer` with its status while this thread is in calls of FMUs; 0 where the system cannot. */
LOOP_API int ends_hear(Answer *answer);

/* This thread calls FMUs from now on; a fault writes the text, which has to stay, to standard error. */
LOOP_API void ends_enter(const char *text, size_t length);

/* The calls have come back. */
LOOP_API void ends_leave(void);

/* Whether this thread of this process is in calls. */
LOOP_API int ends_in_calls(void);

#endif
