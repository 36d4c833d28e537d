/* A system of FMUs as one FMU: the master's loop over instances of FMUs that are in the container's resources.

   file.c, outer.c and reader.c read the system; libraries.c finds and loads the FMUs' libraries; inner.c makes and initializes
   instances; life.c is the container's life from its instantiation to its end, stepping.c its steps and events; values.c moves outer
   variables, whose numbers are in numbers.c; states.c saves and restores everything; messages.c says what has happened. fmi2.c and
   fmi3.c are the two faces of it. */

#ifndef CONTAINER_H
#define CONTAINER_H

/* The loop is a part of this library: none of its functions is seen outside. */
#define LOOP_API
#include "loop.h"

#include "fmi2FunctionTypes.h"
#include "fmi3FunctionTypes.h"

#include <stddef.h>
#include <stdint.h>

#ifdef __GNUC__
#define LIKE_PRINTF(format_at) __attribute__((format(printf, format_at, (format_at) + 1)))
#else
#define LIKE_PRINTF(format_at)
#endif

/* Phases of a container's life; a function may be called in the phases of its mask. */
typedef enum {
    INSTANTIATED = 1,
    INITIALIZING = 2,
    STEPPING = 4,
    EVENT = 8,       /* event mode of FMI 3.0 */
    TERMINATED = 16,
    FAILED = 32,     /* after an error: to be reset, freed, or set back to a saved state */
    LOST = 64        /* after a fatal error: no call of any kind reaches the FMUs any more */
} Phase;

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status; /* numbered alike in FMI 2.0 and 3.0 */

enum { TYPE_STRING = 12, TYPE_BINARY = 13 }; /* beside those of the loop */

typedef struct Container Container;

/* What an instance is told before it is initialized: in configuration mode, after its instantiation, in initialization mode. */
enum { IN_CONFIGURATION, WHEN_INSTANTIATED, IN_INITIALIZATION };

typedef struct {
    int phase;
    int type;
    Function set;
    const char *function;
    uint32_t reference;
    size_t count;
    void *values;
} Setting;

/* An FMU inside. */
typedef struct {
    Container *container;
    const char *name;
    const char *folder;
    const char *identifier;
    const char *token;
    int version;
    int event_mode;
    int early_return;
    int events_logged; /* whether it would log every event */
    int failed;        /* it must not be called any more */
    char *full_name;   /* with the container's */
    void *library;
    void *handle;
    Setting *settings;
    size_t setting_count;
    fmi2CallbackFunctions callbacks;
    char said[600];    /* its last message */
} Inner;

/* A scalar or an array inside, which calls move as a whole. */
typedef struct {
    int inner;
    int type;
    uint32_t reference;
    size_t length;
    Function get;
    Function set;
    const char *get_name;
    const char *set_name;
    int in_event_mode; /* it is set in event mode alone */
    int known;         /* `values` are what it has been set to; `first` what they are at the beginning */
    int waiting;       /* to be set: in the call at work, or at the next event */
    void *values;
    void *first;
} Whole;

/* What an element of an outer variable stands for: a place on the bus, or an element of a whole. */
typedef struct {
    int place; /* on the bus, or the whole's number */
    int element;
    double gain;
    double offset;
    size_t mapped;
    const double *mapping; /* pairs */
} Target;

/* An input inside that takes its time derivative. */
typedef struct {
    int inner;
    uint32_t reference;
    double gain;
} Steered;

typedef struct {
    double start;
    double slope; /* over the coming steps */
    size_t targets;
    const Target *target;
    size_t steered;
    const Steered *steer;
} Slot;

typedef enum { NEVER, BEFORE_START, ALWAYS, AN_INPUT } Settable;

typedef struct {
    const char *name;
    int type;
    Settable settable;
    int on_bus;
    size_t slots;
    Slot *slot;
} Variable;

/* For messages. */
typedef struct {
    int inner;
    const char *function;
    size_t elements;
    const char **element;
} Label;

struct Container {
    const char *name; /* of the FMU */
    const char *token;
    const char *given_token; /* by the host, at the instantiation alone */
    char *instance_name;
    char *resources;
    System system;
    Control control;
    Control fresh;
    unsigned char *beginning; /* the fields of all arrays before a run */
    Numbers cuts;       /* places on the bus at which loops without delay are cut */
    Doubles cut_memory; /* of what closes them */
    double longest; /* inner step [s]; 0: that of the host */
    int saves_states, serializes; /* as all FMUs inside do */
    double origin;  /* the experiment's start [s], where the grid of the inner steps begins */
    size_t inners;
    Inner *inner;
    size_t symbols;
    const char **symbol;
    size_t wholes;
    Whole *whole;
    size_t variables;
    Variable *variable;
    Label *label;
    size_t clocks;
    const char **clock;
    void **taken; /* all memory, to be freed at the end */
    size_t takings, room;
    Phase phase;
    int dirty;        /* inputs have other values than were brought inside */
    int ready;        /* the instances have got the inputs of the next step */
    int waiting;      /* wholes wait to be set at an event */
    int discarded;    /* a step was: only a saved state, or a reset, leads on */
    int terminated;   /* an FMU inside asked to end the simulation */
    int event_mode, early_return; /* of FMI 3.0, as the host wants them */
    int sloping;      /* an input has a slope */
    int steering;     /* or had one in the last step */
    int entered;      /* the instances are in event mode */
    Status step_status;
    int tolerance_defined, stop_defined;
    double tolerance, stop;
    int hurt;            /* an FMU inside has failed in the call at work, or halfway: only a reset or a saved state leads on */
    void *states;        /* all that have been saved and not freed */
    uint64_t arithmetic; /* the host's */
    Container *outer;    /* that was at work before in this thread */
    int logging;
    void *environment;
    void (*callback)(void);
    void (*log)(Container *, Status, const char *category, const char *text);
    char text[1200];
};

/* file.c */
int read_system(Container *, const char *path);
void *take(Container *, size_t count, size_t size);
void put_handles(Container *); /* of the instances, once they are made */

/* libraries.c */
char *resource_folder(const char *location, int is_url, const void *here);
void *load_library(const char *path, char *why, size_t size);
Function find_function(void *library, const char *name);
void unload_library(void *library);
char *joined(const char *folder, const char *rest);
int is_folder(const char *path);
int is_readable(const void *address, size_t size);
void *open_file(const char *path);
extern const char *const LIBRARY_FOLDERS[2][3]; /* of FMI 2.0, of FMI 3.0 */
extern const char *const LIBRARY_SUFFIX;

/* inner.c */
int load_inner(Container *, Inner *);
int instantiate_inner(Container *, Inner *);
void free_inner(Inner *);
Status prepare_inner(Container *, Inner *);
Status set_up_inner(Container *, Inner *);
Status call_inner(Container *, Inner *, const char *function); /* fmi2... or fmi3..., that takes the instance alone */
Status judge_call(Container *, Inner *, const char *function, int status);
Function function_of(const Inner *, const char *function);
Status lacks(Container *, const Inner *, const char *function); /* says so; an error */

/* life.c */
Container *new_container(const char *name, const char *token, char *resources);
int begin_container(Container *, int known_kind);
void free_container(Container *);
int allowed(Container *, const char *function, int phases);
Status set_start(Container *, double start, int stop_defined, double stop, int tolerance_defined, double tolerance);
Status enter_initialization(Container *);
Status exit_initialization(Container *);
Status settle_phase(Container *, Status);
Status terminate(Container *);
Status reset(Container *);

/* stepping.c */
Status advance(Container *, double t, double h, int no_going_back);
Status update_events(Container *, double *next);
Status look_through(Container *);
Status initialize_again(Container *);

/* slopes.c */
Status set_slopes(Container *, const uint32_t *references, size_t count, const fmi2Integer *orders, const double *values);
int run_with_slopes(Container *);

/* values.c */
enum { FOR_FMI2 = 2, FOR_FMI3 = 3 };
Status set_variables(Container *, const char *function, int fmi, int type, const uint32_t *references, size_t count, const void *values,
                     const size_t *sizes, size_t value_count);
Status get_variables(Container *, const char *function, int fmi, int type, const uint32_t *references, size_t count, void *values,
                     size_t *sizes, size_t value_count);
Status set_waiting(Container *);

/* states.c */
Status save_state(Container *, void **state);
Status restore_state(Container *, void *state);
Status free_state(Container *, void **state);
Status state_size(Container *, void *state, size_t *size);
Status serialize_state(Container *, void *state, void *bytes, size_t size);
Status deserialize_state(Container *, const void *bytes, size_t size, void **state);
void free_all_states(Container *, int lost);
size_t fields_size(const Container *);
void write_fields(const Container *, unsigned char *at);
void read_fields(Container *, const unsigned char *at);

/* messages.c */
Status complain(Container *, Status, const char *format, ...) LIKE_PRINTF(3);
Status inner_failure(Container *, Inner *, const char *function, int status);
Status tell_fault(Container *);
void logger2(void *environment, fmi2String name, fmi2Status status, fmi2String category, fmi2String message, ...);
void logger3(void *environment, fmi3Status status, fmi3String category, fmi3String message);
int set_logging(Container *, int on, size_t categories, const char *const category[]);

/* The container's calls of FMUs begin and end here: the host's rounding is kept, and messages without an environment find it. The
   call's status, worse if an FMU must not be called any more, comes back; the phase is settled. */
void enter(Container *);
Status leave(Container *, Status);

#endif
