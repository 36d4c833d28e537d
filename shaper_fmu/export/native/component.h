/* What the generic FMI layers know about a component: a table that is generated from its declaration, and what can be
   done with a live record of it, whatever the version of FMI. */

#ifndef COMPONENT_H
#define COMPONENT_H

#include "kernel.h"

#include <float.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __GNUC__
#define COLD __attribute__((cold))
#define OUT_OF_LINE __attribute__((noinline))
#define LIKE_PRINTF __attribute__((format(printf, 3, 4)))
#else
#define COLD
#define OUT_OF_LINE
#define LIKE_PRINTF
#endif

#if defined(__GNUC__) && !defined(__OPTIMIZE_SIZE__)
#define IN_LINE inline __attribute__((always_inline))
#else
#define IN_LINE inline
#endif

/* In an FMU all but the kernels is one unit, fmu.c, and offers FMI's functions alone: several FMUs can be linked together. For the
   libraries that FMUs carry, the layer is a unit without the table, which is compiled once for all components. */
#if defined(ONE_UNIT) || defined(LAYER_UNIT)
#define INTERNAL static
#define HOT static IN_LINE /* in every step */
#else
#define INTERNAL
#define HOT
#endif

/* Refused by the compiler where it does not hold. */
#define REQUIRED(what, holds) typedef char what[(holds) ? 1 : -1]

/* Doubles are rounded to 64 bits after each operation; on 32-bit x86 that takes -msse2 -mfpmath=sse. */
#if FLT_EVAL_METHOD != 0 && !defined(SHAPER_FMU_ANY_ROUNDING)
#error "results would differ from those of other machines; on 32-bit x86 use -msse2 -mfpmath=sse, or define SHAPER_FMU_ANY_ROUNDING"
#endif

REQUIRED(a_double_has_8_bytes_and_an_int_4, sizeof(double) == 8 && sizeof(int) == 4);

#define NO_EVENT 1e300

typedef enum { REAL, INTEGER, BOOLEAN, ENUMERATION } Kind;
typedef enum { INPUT, OUTPUT, PARAMETER, CALCULATED, LOCAL, HIDDEN, SLOPE } Causality;
typedef enum { UNBOUNDED, INCLUSIVE, EXCLUSIVE } Bound;

typedef struct {
    int value;
    const char *text;
} NumberedText; /* an item of an enumeration, or a kernel's status number and its message */

typedef struct {
    const char *name;
    const char *unit;
    Kind kind;
    Causality causality;
    int tunable;
    int size;     /* number of elements; 0 for a scalar */
    int offset;   /* of the first element in the record: doubles for REAL, 32-bit integers for all other kinds */
    double start; /* of all elements, unless `starts` gives one for each */
    const double *starts;
    Bound lower, upper;
    double min, max;
    int items; /* of an enumeration */
    const NumberedText *item;
    int derivative; /* index of the variable that is its time derivative, or -1 */
    double nominal; /* usual size, unless a variable holds it: that of this index, or -1 */
    int nominal_of;
    int slope;      /* of an input: index of the hidden variable that is its time derivative over a step, or -1 */
} Variable;

static inline int length(const Variable *v) { return v->size ? v->size : 1; }

typedef struct {
    uint16_t variable, element;
    int offset; /* of the element in the record */
    uint8_t kind;
    uint8_t unchecked; /* an input that may be set to any value: it is checked when it is used */
} Scalar;

typedef struct {
    const char *name;
    const char *token; /* the GUID of FMI 2, the instantiation token of FMI 3 */
    uint64_t digest;   /* of name and record layout: marks saved states */
    int record_size;
    int left_limits;     /* offset of the flag that asks for values from the left */
    int next_event_time; /* offset of the announced event, or -1 */
    int next_kink_time;  /* offset of the announced kink (model exchange), or -1 */
    int sampled;         /* whether inputs act only when sampled (model exchange) */
    int model_exchange;  /* whether the component can be integrated by the importer */
    int variables;
    const Variable *variable;
    int inputs; /* element by element: first those that may be any finite number */
    int free_inputs;
    const Scalar *input;
    int results;    /* real outputs and locals, element by element */
    int calculated; /* real calculated parameters, which follow them */
    const Scalar *result;
    int visible; /* FMI 3 value references: index from 1 into visible_variable; `visible` itself is the time */
    const uint16_t *visible_variable;
    int scalars; /* FMI 2 value references: index into scalar */
    const Scalar *scalar;
    int states; /* continuous states, element by element */
    const Scalar *state;
    int messages;
    const NumberedText *message;
} Component;

#ifndef ONE_UNIT
NOT_EXPORTED extern const Component component;
#endif

/* Phases of an instance's life; a function may be called in the phases of its mask. */
typedef enum {
    INSTANTIATED = 1,
    INITIALIZING = 2,
    STEPPING = 4,    /* co-simulation */
    EVENT = 8,       /* event mode of model exchange, and of co-simulation in FMI 3 */
    CONTINUOUS = 16, /* model exchange */
    INTERMEDIATE = 32, /* inside the importer's intermediate update */
    TERMINATED = 64,
    FAILED = 128
} Phase;

enum { EXCHANGE_ONLY = 256, STEPS_ONLY = 512 }; /* in a mask of phases: a function of model exchange, of co-simulation */

typedef enum { OK, WARNING, DISCARD, ERROR, FATAL } Status; /* numbered alike in FMI 2 and 3 */

enum { LOG_EVENTS = 1, LOG_WARNING = 2, LOG_DISCARD = 4, LOG_ERROR = 8, LOG_FATAL = 16, LOG_ALL = 31 };

typedef struct Instance Instance;

struct Instance {
    char *name;
    unsigned char *record;  /* the component's values */
    unsigned char *trial;   /* derivatives: the values when one of them is changed */
    unsigned char *scratch; /* model exchange: the values at a trial time */
    unsigned char *held;    /* model exchange: the record of the last event, for its inputs */
    Phase phase;
    Status step_status;
    int model_exchange, event_mode, early_return, stale, tried, stop_defined;
    int untouched; /* since the reset no kernel has changed the record */
    double time;        /* of the record in co-simulation; the trial time in model exchange */
    double record_time; /* up to which the record has been advanced */
    double event_time;  /* of an event that waits to be handled, or NO_EVENT */
    double stop_time;
    int log_mask;
    void *environment;
    void (*log)(Instance *, Status, const char *category, const char *text);
    void (*callback)(void); /* of the FMI version: the logger, or the intermediate update */
    void (*second_callback)(void);
    char text[1024];
};

/* life.c */
INTERNAL Instance *new_instance(const char *name, int model_exchange);
INTERNAL void free_instance(Instance *);
INTERNAL void reset_instance(Instance *);
INTERNAL int check_identity(Instance *, const char *name, const char *token, int known_type);
HOT int allowed(Instance *, const char *function, int phases);
INTERNAL Status set_start(Instance *, double start, int stop_defined, double stop);
INTERNAL Status enter_initialization(Instance *);
INTERNAL Status exit_initialization(Instance *, Phase next);
HOT Status refresh(Instance *);
INTERNAL void note_set(Instance *, int changed);
HOT Status advance(Instance *, double t, double h, int left_limits);
HOT Status check_step(Instance *, double t, double h);
INTERNAL Status enter_event_mode(Instance *);
INTERNAL void terminate(Instance *);
INTERNAL double next_event(const Instance *);
INTERNAL double next_solver_event(const Instance *);
INTERNAL int samples_changed(const Instance *);

INTERNAL Status run_trial(Instance *, double t);

/* derivatives.c */
enum { UNKNOWNS_AT_ONCE = 16 };
INTERNAL int is_unknown(Instance *, const Variable *);
INTERNAL Status add_derivatives(Instance *, const Variable *known, int element, double seed, const int *unknown, int n, double *sensitivity);

/* states.c */
INTERNAL size_t serialized_size(void);
INTERNAL Status save_state(Instance *, void **state);
INTERNAL Status restore_state(Instance *, const void *state);
INTERNAL Status serialize_state(Instance *, const void *state, void *bytes, size_t size);
INTERNAL Status deserialize_state(Instance *, const void *bytes, size_t size, void **state);
INTERNAL void free_state(void **state);

/* exchange.c */
INTERNAL Status set_time(Instance *, double t);
INTERNAL Status get_states(Instance *, double *x, size_t n);
INTERNAL Status set_states(Instance *, const double *x, size_t n);
INTERNAL Status get_derivatives(Instance *, double *dx, size_t n);
INTERNAL Status get_nominals(Instance *, double *x, size_t n);
INTERNAL double nominal_value(const Instance *, const Variable *, int element);
INTERNAL Status enter_continuous_time(Instance *);
INTERNAL Status no_indicators(Instance *, size_t n);

/* values.c */
INTERNAL int in_domain(const Variable *, double value);
INTERNAL void *field(const Instance *, const Variable *, int element);
INTERNAL void start_values(unsigned char *record, int with_inputs_and_parameters);
INTERNAL Status check_domains(Instance *);
INTERNAL Status check_parameters(Instance *);
INTERNAL Status check_inputs(Instance *, double t);
INTERNAL Status check_results(Instance *, const unsigned char *record, double t, int with_calculated);
INTERNAL int check_element(Instance *, const Variable *, int element, double value, const double *t);
HOT Status settable(Instance *, const Variable *, int element, double value);
INTERNAL Status derivative_of(Instance *, const Variable *, int element, int order, double *value);
INTERNAL int check_null(Instance *, const void *pointer, size_t n, const char *function);

/* messages.c */
INTERNAL LIKE_PRINTF COLD Status refuse(Instance *, Status, const char *format, ...);
INTERNAL COLD Status kernel_failure(Instance *, const unsigned char *record, int status, double t);
INTERNAL COLD Status kernel_fault(Instance *, const Fault *fault, double t);
INTERNAL void put_label(char *text, int size, const Variable *, int element);
INTERNAL Status set_logging(Instance *, int on, size_t categories, const char *const category[]);

#endif
