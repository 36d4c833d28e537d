/* FMI 3.0's functions as the exports of a component of WebAssembly: the draft of fmi-ls-wasm in the component model's canonical ABI.

   Lists and texts of the host are put into memory by cabi_realloc, and given back when the call ends. What a call returns stays until
   the next one that returns a list. So a call out of `log-message` that would take or give memory back traps. */

#include "fmi3.h"

#include <stdlib.h>
#include <string.h>

#define EXPORTED(name) __attribute__((export_name(name)))
#define PACKAGE(interface) "fmi:fmi3/" interface "@3.0.0"

typedef struct {
    char *at;
    size_t length;
} Text; /* also in lists */

typedef struct {
    uint32_t reference, order;
} Request;

typedef struct {
    uint8_t is_some;
    int32_t handle;
} Instantiated;

/* Results: a value, or the status of what failed. */

typedef struct {
    uint8_t failed;
    union {
        struct {
            void *at;
            size_t length;
        } list;
        uint8_t status;
    } is;
} List;

typedef struct {
    uint8_t failed;
    union {
        uint64_t number;
        uint8_t status;
    } is;
} Number;

typedef struct {
    uint8_t failed;
    union {
        struct {
            bool needed, terminate, nominals_changed, values_changed, time_defined;
            double time;
        } info;
        uint8_t status;
    } is;
} Discrete;

typedef struct {
    uint8_t failed;
    union {
        struct {
            double time;
            bool event, terminate, early;
        } step;
        uint8_t status;
    } is;
} Stepped;

typedef struct {
    uint8_t failed;
    union {
        struct {
            bool enter_event_mode, terminate;
        } step;
        uint8_t status;
    } is;
} Completed;

REQUIRED(a_list_is_4_bytes_on, offsetof(List, is) == 4 && sizeof(Text) == 8);
REQUIRED(a_double_is_8_bytes_on, offsetof(Discrete, is.info.time) == 16 && offsetof(Stepped, is) == 8 && offsetof(Completed, is) == 1);

static union {
    Text text;
    Instantiated instantiated;
    List list;
    Number number;
    Discrete discrete;
    Stepped stepped;
    Completed completed;
} reply;

/* Memory */

typedef struct Block Block;
struct Block {
    Block *next;
    double aligned[1];
};

static Block *given; /* by the host, for the call that follows */
static void *kept;   /* for the host, from the last call */

static int telling;  /* the host a message, in the middle of a call */

static void *checked(void *memory) {
    if (!memory || telling) __builtin_trap(); /* the host is told */
    return memory;
}

/* One byte more than asked for: texts get their 0. */
EXPORTED("cabi_realloc") void *cabi_realloc(void *old, size_t old_size, size_t align, size_t size) {
    (void)align; /* at most 8 */
    Block *block = (Block *)checked(malloc(offsetof(Block, aligned) + size + 1));
    block->next = given;
    given = block;
    if (old) memcpy(block->aligned, old, old_size < size ? old_size : size);
    return block->aligned;
}

static fmi3Status ended(fmi3Status status) {
    checked(&telling);
    while (given) {
        Block *next = given->next;
        free(given);
        given = next;
    }
    return status;
}

static void *keep(size_t size) {
    checked(&telling);
    free(kept);
    return kept = checked(malloc(size + 1));
}

static const char *c_text(char *at, size_t length) {
    if (!length) return "";
    at[length] = 0;
    return at;
}

static List *listed(fmi3Status status, size_t length) {
    memset(&reply, 0, sizeof reply);
    reply.list.failed = status > fmi3Warning;
    if (reply.list.failed)
        reply.list.is.status = (uint8_t)status;
    else {
        reply.list.is.list.at = kept;
        reply.list.is.list.length = length;
    }
    ended(status);
    return &reply.list;
}

static Number *counted(fmi3Status status, size_t value) {
    memset(&reply, 0, sizeof reply);
    reply.number.failed = status > fmi3Warning;
    if (reply.number.failed)
        reply.number.is.status = (uint8_t)status;
    else
        reply.number.is.number = value;
    return &reply.number;
}

/* How many values these variables have; an unknown one is refused by who is called next. */
static size_t elements(const uint32_t *references, size_t n) {
    size_t found = 0;
    for (size_t i = 0; i < n; i++) {
        uint32_t vr = references[i], time = (uint32_t)component.visible;
        found += vr && vr < time ? (size_t)length(&component.variable[component.visible_variable[vr]]) : vr == time;
    }
    return found;
}

/* Messages */

__attribute__((import_module(PACKAGE("callbacks")), import_name("log-message"))) void log_message(
    const char *name, size_t name_length, int status, const char *category, size_t category_length, const char *message,
    size_t message_length);

/* The length of a text without a character that was cut in two at its end: the host takes UTF-8 alone. */
static size_t whole(const char *text) {
    size_t end = strlen(text), tail = 0;
    while (tail < end && tail < 3 && ((unsigned char)text[end - 1 - tail] & 0xC0) == 0x80) tail++;
    if (tail == end) return end;
    unsigned char lead = (unsigned char)text[end - 1 - tail];
    size_t needed = lead >= 0xF0 ? 3 : lead >= 0xE0 ? 2 : lead >= 0xC0 ? 1 : 0;
    return needed > tail ? end - 1 - tail : end;
}

static void tell(fmi3InstanceEnvironment name, fmi3Status status, fmi3String category, fmi3String message) {
    telling++;
    log_message((const char *)name, whole((const char *)name), (int)status, category, strlen(category), message, whole(message));
    telling--;
}

/* The instance's messages begin with its own copy of its name. */
static fmi3Instance named(fmi3Instance instance) {
    if (instance) ((Instance *)instance)->environment = ((Instance *)instance)->name;
    return instance;
}

static Instantiated *instantiated(int made, int32_t handle) {
    ended(fmi3OK);
    reply.instantiated.is_some = (uint8_t)made;
    reply.instantiated.handle = handle;
    return &reply.instantiated;
}

EXPORTED(PACKAGE("common") "#get-version") Text *get_version(void) {
    const char *version = fmi3GetVersion();
    reply.text.length = strlen(version);
    reply.text.at = (char *)memcpy(keep(reply.text.length), version, reply.text.length);
    return &reply.text;
}

/* What both kinds of simulation have is in methods.h. */

#define KIND "co-simulation"
#define OF_KIND(name) co_simulation_##name
#include "methods.h"

METHOD(Instantiated *, "[static]", "instantiate-co-simulation", instantiate,
       (char *name, size_t name_length, char *token, size_t token_length, char *path, size_t path_length, int visible, int logging,
        int events, int early, const uint32_t *required, size_t n)) {
    fmi3Instance made = named(fmi3InstantiateCoSimulation(c_text(name, name_length), c_text(token, token_length), c_text(path, path_length),
                                                          visible != 0, logging != 0, events != 0, early != 0, required, n,
                                                          (void *)c_text(name, name_length), tell, 0));
    if (made && n)
        refuse((Instance *)made, WARNING, "%s: there are no intermediate updates in WebAssembly",
               component.name);
    return instantiated(made != 0, made ? co_simulation_new_handle(made) : 0);
}

METHOD(Stepped *, "[method]", "do-step", do_step, (fmi3Instance self, double t, double h, int no_set)) {
    bool event = false, terminate = false, early = false;
    double time = 0.0;
    fmi3Status status = fmi3DoStep(self, t, h, no_set != 0, &event, &terminate, &early, &time);
    memset(&reply, 0, sizeof reply);
    reply.stepped.failed = status > fmi3Warning;
    if (reply.stepped.failed)
        reply.stepped.is.status = (uint8_t)status;
    else {
        reply.stepped.is.step.time = time;
        reply.stepped.is.step.event = event;
        reply.stepped.is.step.terminate = terminate;
        reply.stepped.is.step.early = early;
    }
    return &reply.stepped;
}

METHOD(int, "[method]", "set-input-derivatives", set_input_derivatives,
       (fmi3Instance self, const Request *requests, size_t n, const double *values, size_t n_values)) {
    (void)requests, (void)n, (void)values, (void)n_values;
    return ended((fmi3Status)refuse((Instance *)self, ERROR, "%s: FMI 3.0 has no derivatives of inputs", component.name));
}

#undef KIND
#undef OF_KIND

#ifdef WITH_MODEL_EXCHANGE

#define KIND "model-exchange"
#define OF_KIND(name) model_exchange_##name
#include "methods.h"

METHOD(Instantiated *, "[static]", "instantiate-model-exchange", instantiate,
       (char *name, size_t name_length, char *token, size_t token_length, char *path, size_t path_length, int visible, int logging)) {
    fmi3Instance made = named(fmi3InstantiateModelExchange(c_text(name, name_length), c_text(token, token_length),
                                                           c_text(path, path_length), visible != 0, logging != 0,
                                                           (void *)c_text(name, name_length), tell));
    return instantiated(made != 0, made ? model_exchange_new_handle(made) : 0);
}

SIMPLE("enter-continuous-time-mode", fmi3EnterContinuousTimeMode)

METHOD(int, "[method]", "set-time", set_time, (fmi3Instance self, double t)) { return fmi3SetTime(self, t); }

METHOD(int, "[method]", "set-continuous-states", set_states, (fmi3Instance self, const double *x, size_t n)) {
    return ended(fmi3SetContinuousStates(self, x, n));
}

#define STATES(name, function, count) \
    METHOD(List *, "[method]", name, function, (fmi3Instance self)) { \
        size_t n = (size_t)(count); \
        return listed(function(self, (double *)keep(8 * n), n), n); \
    }

STATES("get-continuous-state-derivatives", fmi3GetContinuousStateDerivatives, component.states)
STATES("get-continuous-states", fmi3GetContinuousStates, component.states)
STATES("get-nominals-of-continuous-states", fmi3GetNominalsOfContinuousStates, component.states)
STATES("get-event-indicators", fmi3GetEventIndicators, 0)

#define COUNT(name, function) \
    METHOD(Number *, "[method]", name, function, (fmi3Instance self)) { \
        size_t n = 0; \
        fmi3Status status = function(self, &n); \
        return counted(status, n); \
    }

COUNT("get-number-of-event-indicators", fmi3GetNumberOfEventIndicators)
COUNT("get-number-of-continuous-states", fmi3GetNumberOfContinuousStates)

METHOD(Completed *, "[method]", "completed-integrator-step", completed_step, (fmi3Instance self, int no_set)) {
    bool enter = false, terminate = false;
    fmi3Status status = fmi3CompletedIntegratorStep(self, no_set != 0, &enter, &terminate);
    memset(&reply, 0, sizeof reply);
    reply.completed.failed = status > fmi3Warning;
    if (reply.completed.failed)
        reply.completed.is.status = (uint8_t)status;
    else {
        reply.completed.is.step.enter_event_mode = enter;
        reply.completed.is.step.terminate = terminate;
    }
    return &reply.completed;
}

#endif
