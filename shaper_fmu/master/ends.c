/* What hears of the end of the process while an FMU is called; see process_ends.py. In C, since exit() and faults call the
   handlers after Python's end, too, and in the midst of anything. This is the master's alone: it is no part of the loop. */

#include "ends.h"

#if defined(__linux__) && UINTPTR_MAX > 0xffffffffu

#include <pthread.h>
#include <string.h>
#include <sys/types.h>
#include <unistd.h>

static struct {
    volatile pid_t process; /* whose thread is in calls; 0 for none */
    pthread_t thread;
    const char *volatile text;
    volatile size_t length;
    Answer *answer;
    struct sigaction before[NSIG];
} ends;

static const int faults[] = {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};
#define FAULTS (sizeof faults / sizeof *faults)

int ends_in_calls(void) { return getpid() == ends.process && pthread_equal(pthread_self(), ends.thread); }

/* Of exit(). */
static void ended(int status, void *nothing) {
    (void)nothing;
    if (ends_in_calls()) ends.answer(status);
}

/* Of a fault's signal: write the text, and give the signal to who had it. */
static void crashed(int number) {
    if (getpid() == ends.process) {
        const ssize_t written = write(2, ends.text, ends.length);
        (void)written;
    }
    sigaction(number, &ends.before[number], NULL);
    raise(number);
}

int ends_hear(Answer *answer) {
    ends.answer = answer;
#if defined(__GLIBC__)
    return on_exit(ended, NULL) == 0;
#else
    (void)ended;
    return 0;
#endif
}

void ends_enter(const char *text, size_t length) {
    struct sigaction action, found;
    memset(&action, 0, sizeof action);
    action.sa_handler = crashed;
    action.sa_flags = SA_ONSTACK; /* the handler's own stack, if there is one */
    ends.text = text;
    ends.length = length;
    ends.thread = pthread_self();
    ends.process = getpid();
    for (size_t i = 0; i < FAULTS; i++) {
        sigaction(faults[i], NULL, &found);
        if (found.sa_handler == SIG_DFL) /* nobody else's, such as faulthandler's, or that of a runtime */
            sigaction(faults[i], &action, &ends.before[faults[i]]);
    }
}

void ends_leave(void) {
    struct sigaction found;
    ends.process = 0;
    for (size_t i = 0; i < FAULTS; i++) {
        sigaction(faults[i], NULL, &found);
        if (found.sa_handler == crashed) sigaction(faults[i], &ends.before[faults[i]], NULL);
    }
}

#else

int ends_hear(Answer *answer) {
    (void)answer;
    return 0;
}

void ends_enter(const char *text, size_t length) {
    (void)text;
    (void)length;
}

void ends_leave(void) {}

int ends_in_calls(void) { return 0; }

#endif
