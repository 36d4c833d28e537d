/* The exports that co-simulation and model exchange have alike; included once for each KIND. An instance is known to the host by a handle,
   and comes here as its address. */

#undef METHOD
#undef SIMPLE
#undef VALUES
#undef CLOCKS

/* `how` the interface's function belongs to the resource: "[static]" or "[method]". */
#define METHOD(Result, how, name, function, parameters) \
    EXPORTED(PACKAGE(KIND) "#" how KIND "-instance." name) Result OF_KIND(function) parameters

#define SIMPLE(name, function) \
    METHOD(int, "[method]", name, function, (fmi3Instance self)) { return function(self); }

__attribute__((import_module("[export]" PACKAGE(KIND)), import_name("[resource-new]" KIND "-instance"))) int32_t OF_KIND(new_handle)(
    fmi3Instance);

/* The host drops its handle; runtimes refuse that while the instance is at work. */
EXPORTED(PACKAGE(KIND) "#[dtor]" KIND "-instance") void OF_KIND(drop)(fmi3Instance self) { fmi3FreeInstance(self); }

METHOD(int, "[method]", "set-debug-logging", set_debug_logging, (fmi3Instance self, int on, const Text *categories, size_t n)) {
    const char **names = (const char **)cabi_realloc(0, 0, 4, n * sizeof *names);
    for (size_t i = 0; i < n; i++) names[i] = c_text(categories[i].at, categories[i].length);
    return ended(fmi3SetDebugLogging(self, on != 0, n, names));
}

METHOD(int, "[method]", "enter-initialization-mode", enter_initialization_mode,
       (fmi3Instance self, int with_tolerance, double tolerance, double start, int with_stop, double stop)) {
    return fmi3EnterInitializationMode(self, with_tolerance != 0, tolerance, start, with_stop != 0, stop);
}

SIMPLE("exit-initialization-mode", fmi3ExitInitializationMode)
SIMPLE("enter-event-mode", fmi3EnterEventMode)
SIMPLE("enter-step-mode", fmi3EnterStepMode)
SIMPLE("terminate", fmi3Terminate)
SIMPLE("reset", fmi3Reset)
SIMPLE("enter-configuration-mode", fmi3EnterConfigurationMode)
SIMPLE("exit-configuration-mode", fmi3ExitConfigurationMode)
SIMPLE("evaluate-discrete-states", fmi3EvaluateDiscreteStates)

METHOD(Discrete *, "[method]", "update-discrete-states", update_discrete_states, (fmi3Instance self)) {
    bool needed = false, terminate = false, nominals = false, values = false, defined = false;
    double time = 0.0;
    fmi3Status status = fmi3UpdateDiscreteStates(self, &needed, &terminate, &nominals, &values, &defined, &time);
    memset(&reply, 0, sizeof reply);
    reply.discrete.failed = status > fmi3Warning;
    if (reply.discrete.failed)
        reply.discrete.is.status = (uint8_t)status;
    else {
        reply.discrete.is.info.needed = needed;
        reply.discrete.is.info.terminate = terminate;
        reply.discrete.is.info.nominals_changed = nominals;
        reply.discrete.is.info.values_changed = values;
        reply.discrete.is.info.time_defined = defined;
        reply.discrete.is.info.time = time;
    }
    return &reply.discrete;
}

#define VALUES(name, Name) \
    METHOD(List *, "[method]", "get-" name, get_##Name, (fmi3Instance self, const uint32_t *references, size_t n)) { \
        size_t values = elements(references, n); \
        return listed(fmi3Get##Name(self, references, n, (fmi3##Name *)keep(values * sizeof(fmi3##Name)), values), values); \
    } \
    METHOD(int, "[method]", "set-" name, set_##Name, \
           (fmi3Instance self, const uint32_t *references, size_t n, const fmi3##Name *values, size_t n_values)) { \
        return ended(fmi3Set##Name(self, references, n, values, n_values)); \
    }

VALUES("float32", Float32)
VALUES("float64", Float64)
VALUES("int8", Int8)
VALUES("int16", Int16)
VALUES("int32", Int32)
VALUES("int64", Int64)
VALUES("uint8", UInt8)
VALUES("uint16", UInt16)
VALUES("uint32", UInt32)
VALUES("uint64", UInt64)
VALUES("boolean", Boolean)

/* There are no variables of these types, and so no values: what fails says which. */

METHOD(List *, "[method]", "get-string", get_string, (fmi3Instance self, const uint32_t *references, size_t n)) {
    return listed(fmi3GetString(self, references, n, (fmi3String *)keep(0), 0), 0);
}

METHOD(int, "[method]", "set-string", set_string,
       (fmi3Instance self, const uint32_t *references, size_t n, const Text *values, size_t n_values)) {
    (void)values;
    return ended(fmi3SetString(self, references, n, (const fmi3String *)keep(0), n_values));
}

METHOD(List *, "[method]", "get-binary", get_binary, (fmi3Instance self, const uint32_t *references, size_t n)) {
    return listed(fmi3GetBinary(self, references, n, 0, 0, 0), 0);
}

METHOD(int, "[method]", "set-binary", set_binary,
       (fmi3Instance self, const uint32_t *references, size_t n, const Text *values, size_t n_values)) {
    (void)values;
    return ended(fmi3SetBinary(self, references, n, 0, 0, n_values));
}

METHOD(List *, "[method]", "get-clock", get_clock, (fmi3Instance self, const uint32_t *references, size_t n)) {
    return listed(fmi3GetClock(self, references, n, 0), 0);
}

METHOD(int, "[method]", "set-clock", set_clock,
       (fmi3Instance self, const uint32_t *references, size_t n, const bool *values, size_t n_values)) {
    (void)n_values;
    return ended(fmi3SetClock(self, references, n, values));
}

#define CLOCKS(get, set, Name, ...) \
    METHOD(List *, "[method]", get, get_##Name, (fmi3Instance self, const uint32_t *references, size_t n)) { \
        return listed(fmi3Get##Name(self, references, n, __VA_ARGS__), 0); \
    } \
    METHOD(int, "[method]", set, set_##Name, \
           (fmi3Instance self, const uint32_t *references, size_t n, const void *values, size_t n_values)) { \
        (void)values, (void)n_values; \
        return ended(fmi3Set##Name(self, references, n SET_##Name)); \
    }
#define SET_IntervalDecimal , 0
#define SET_IntervalFraction , 0, 0
#define SET_ShiftDecimal , 0
#define SET_ShiftFraction , 0, 0

CLOCKS("get-interval-decimal", "set-interval-decimal", IntervalDecimal, 0, 0)
CLOCKS("get-interval-fraction", "set-interval-fraction", IntervalFraction, 0, 0, 0)
CLOCKS("get-shift-decimal", "set-shift-decimal", ShiftDecimal, 0)
CLOCKS("get-shift-fraction", "set-shift-fraction", ShiftFraction, 0, 0)

METHOD(Number *, "[method]", "get-number-of-variable-dependencies", number_of_dependencies, (fmi3Instance self, uint32_t reference)) {
    size_t n = 0;
    fmi3Status status = fmi3GetNumberOfVariableDependencies(self, reference, &n);
    return counted(status, n);
}

METHOD(List *, "[method]", "get-variable-dependencies", dependencies, (fmi3Instance self, uint32_t reference)) {
    return listed(fmi3GetVariableDependencies(self, reference, 0, 0, 0, 0, 0), 0);
}

METHOD(List *, "[method]", "get-fmu-state", get_state, (fmi3Instance self)) {
    fmi3FMUState state = 0;
    size_t size = 0;
    fmi3Status status = fmi3GetFMUState(self, &state);
    if (!status) status = fmi3SerializedFMUStateSize(self, state, &size);
    if (!status) status = fmi3SerializeFMUState(self, state, (fmi3Byte *)keep(size), size);
    if (state) fmi3FreeFMUState(self, &state);
    return listed(status, size);
}

METHOD(int, "[method]", "set-fmu-state", set_state, (fmi3Instance self, const uint8_t *bytes, size_t size)) {
    fmi3FMUState state = 0;
    fmi3Status status = fmi3DeserializeFMUState(self, bytes, size, &state);
    if (!status) status = fmi3SetFMUState(self, state);
    if (state) fmi3FreeFMUState(self, &state);
    return ended(status);
}

METHOD(List *, "[method]", "get-directional-derivative", directional,
       (fmi3Instance self, const uint32_t *unknowns, size_t n, const uint32_t *knowns, size_t n_knowns, const double *seed, size_t n_seed)) {
    size_t values = elements(unknowns, n);
    return listed(fmi3GetDirectionalDerivative(self, unknowns, n, knowns, n_knowns, seed, n_seed, (double *)keep(8 * values), values), values);
}

METHOD(List *, "[method]", "get-adjoint-derivative", adjoint,
       (fmi3Instance self, const uint32_t *unknowns, size_t n, const uint32_t *knowns, size_t n_knowns, const double *seed, size_t n_seed)) {
    return listed(fmi3GetAdjointDerivative(self, unknowns, n, knowns, n_knowns, seed, n_seed, (double *)keep(0), 0), 0);
}

METHOD(List *, "[method]", "get-output-derivatives", output_derivatives, (fmi3Instance self, const Request *requests, size_t n)) {
    uint32_t *references = (uint32_t *)cabi_realloc(0, 0, 4, n * sizeof *references);
    int32_t *orders = (int32_t *)cabi_realloc(0, 0, 4, n * sizeof *orders);
    for (size_t i = 0; i < n; i++) {
        references[i] = requests[i].reference;
        orders[i] = (int32_t)(requests[i].order < INT32_MAX ? requests[i].order : INT32_MAX);
    }
    size_t values = elements(references, n);
    return listed(fmi3GetOutputDerivatives(self, references, n, orders, (double *)keep(8 * values), values), values);
}
