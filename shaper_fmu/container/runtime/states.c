/* States: everything that a run changes in the container, and the states of all FMUs inside. */

#include "container.h"

#include <stdlib.h>
#include <string.h>

#define MARK 0x53545445u

typedef struct {
    uint32_t phase, dirty, ready, waiting, entered, terminated, sloping, steering, discarded, event_mode, stop_defined, tolerance_defined;
    double origin, stop, tolerance;
} Flags;

/* A saved state; its bytes are flags, fields and wholes. */
typedef struct State {
    struct State *next; /* of the same container */
    size_t size;
    unsigned char *bytes;
    size_t inners;
    void **inner;
} State;

/* What comes first in serialized bytes. */
typedef struct {
    uint32_t mark, inners;
    uint64_t token; /* its digest */
    uint64_t size;  /* of the container's own bytes; those of the instances follow, each after their number */
    uint64_t sum;   /* checksum of all that follows */
} Head;

typedef int StateFunction(void *instance, void **state);
typedef int SetState(void *instance, void *state);
typedef int StateSize(void *instance, void *state, size_t *size);
typedef int Serialize(void *instance, void *state, void *bytes, size_t size);
typedef int Deserialize(void *instance, const void *bytes, size_t size, void **state);

/* The standard's name, which FMI 2.0 and 3.0 write differently. */
static const char *name_of(const Inner *inner, int which) {
    static const char *const names[2][6] = {
        {"fmi2GetFMUstate", "fmi2SetFMUstate", "fmi2FreeFMUstate", "fmi2SerializedFMUstateSize", "fmi2SerializeFMUstate",
         "fmi2DeSerializeFMUstate"},
        {"fmi3GetFMUState", "fmi3SetFMUState", "fmi3FreeFMUState", "fmi3SerializedFMUStateSize", "fmi3SerializeFMUState",
         "fmi3DeserializeFMUState"}};
    return names[inner->version == 3][which];
}

enum { GET_STATE, SET_STATE, FREE_STATE, STATE_SIZE, SERIALIZE, DESERIALIZE };

static Function function_for(Container *container, Inner *inner, int which) {
    const Function found = function_of(inner, name_of(inner, which));
    if (!found) lacks(container, inner, name_of(inner, which));
    return found;
}

/* FNV-1a */
static uint64_t digest(const void *bytes, size_t size) {
    const unsigned char *const at = (const unsigned char *)bytes;
    uint64_t sum = 0xcbf29ce484222325u;
    for (size_t i = 0; i < size; i++) sum = (sum ^ at[i]) * 0x100000001b3u;
    return sum;
}

static uint64_t token_digest(const Container *container) { return digest(container->token, strlen(container->token)); }

static size_t bytes_of(const Whole *whole) { return whole->type >= TYPE_STRING ? 0 : 8 * whole->length; }

static size_t own_size(const Container *container) {
    size_t size = sizeof(Flags) + fields_size(container);
    for (size_t i = 0; i < container->variables; i++) size += 8 * container->variable[i].slots;
    for (size_t i = 0; i < container->wholes; i++) size += 8 + bytes_of(&container->whole[i]);
    return size;
}

static void write_own(Container *container, unsigned char *at) {
    const Flags flags = {(uint32_t)container->phase,   (uint32_t)container->dirty,   (uint32_t)container->ready,
                         (uint32_t)container->waiting, (uint32_t)container->entered, (uint32_t)container->terminated,
                         (uint32_t)container->sloping, (uint32_t)container->steering, (uint32_t)container->discarded,
                         (uint32_t)container->event_mode, (uint32_t)container->stop_defined, (uint32_t)container->tolerance_defined,
                         container->origin, container->stop, container->tolerance};
    memcpy(at, &flags, sizeof flags);
    write_fields(container, at + sizeof flags);
    at += sizeof flags + fields_size(container);
    for (size_t i = 0; i < container->variables; i++)
        for (size_t k = 0; k < container->variable[i].slots; k++, at += 8) memcpy(at, &container->variable[i].slot[k].slope, 8);
    for (size_t i = 0; i < container->wholes; i++) {
        const Whole *const whole = &container->whole[i];
        const uint64_t waiting = (uint64_t)whole->waiting;
        memcpy(at, &waiting, 8);
        memcpy(at + 8, whole->values, bytes_of(whole));
        at += 8 + bytes_of(whole);
    }
}

static void read_own(Container *container, const unsigned char *at) {
    Flags flags;
    memcpy(&flags, at, sizeof flags);
    container->phase = (Phase)flags.phase;
    container->dirty = (int)flags.dirty;
    container->ready = (int)flags.ready;
    container->waiting = (int)flags.waiting;
    container->entered = (int)flags.entered;
    container->terminated = (int)flags.terminated;
    container->origin = flags.origin;
    container->sloping = (int)flags.sloping;
    container->steering = (int)flags.steering;
    container->discarded = (int)flags.discarded;
    container->stop_defined = (int)flags.stop_defined;
    container->stop = flags.stop;
    container->tolerance_defined = (int)flags.tolerance_defined;
    container->tolerance = flags.tolerance;
    read_fields(container, at + sizeof flags);
    at += sizeof flags + fields_size(container);
    for (size_t i = 0; i < container->variables; i++)
        for (size_t k = 0; k < container->variable[i].slots; k++, at += 8) memcpy(&container->variable[i].slot[k].slope, at, 8);
    for (size_t i = 0; i < container->wholes; i++) {
        Whole *const whole = &container->whole[i];
        uint64_t waiting;
        memcpy(&waiting, at, 8);
        whole->waiting = (int)waiting;
        memcpy(whole->values, at + 8, bytes_of(whole));
        at += 8 + bytes_of(whole);
    }
}

static State *new_state(Container *container) {
    State *const state = (State *)calloc(1, sizeof *state);
    if (state) {
        state->size = own_size(container);
        state->bytes = (unsigned char *)malloc(state->size);
        state->inners = container->inners;
        state->inner = (void **)calloc(container->inners ? container->inners : 1, sizeof *state->inner);
        if (state->bytes && state->inner) return state;
        free(state->bytes);
        free(state->inner);
        free(state);
    }
    complain(container, ERROR, "%s: there is not enough memory for a state", container->name);
    return 0;
}

/* The host's state, if this container has saved it, or the place where it is kept; else null, and that is said. */
static State **find_state(Container *container, const void *told) {
    State **place = (State **)&container->states;
    while (*place && *place != told) place = &(*place)->next;
    if (told && *place) return place;
    complain(container, ERROR, told ? "%s: this is no state of this instance, or it has been freed" : "%s: there is no state (null pointer)",
             container->name);
    return 0;
}

/* Free a state that is not, or no more, among the container's; the FMUs' parts of it, too, unless they are lost. */
static Status destroy(Container *container, State *state, int lost) {
    Status worst = OK;
    for (size_t i = 0; i < state->inners && !lost; i++) {
        Inner *const inner = &container->inner[i];
        if (!state->inner[i]) continue;
        StateFunction *const function = (StateFunction *)function_for(container, inner, FREE_STATE);
        const Status status = function ? judge_call(container, inner, name_of(inner, FREE_STATE), function(inner->handle, &state->inner[i])) : ERROR;
        if (status > worst) worst = status;
    }
    free(state->bytes);
    free(state->inner);
    free(state);
    return worst;
}

Status free_state(Container *container, void **told) {
    if (!told || !*told) return OK;
    State **const place = find_state(container, *told);
    if (!place) return ERROR;
    State *const state = *place;
    *place = state->next;
    *told = 0;
    return destroy(container, state, 0);
}

/* At the container's end: those that the host has left. */
void free_all_states(Container *container, int lost) {
    while (container->states) {
        State *const state = (State *)container->states;
        container->states = state->next;
        destroy(container, state, lost);
    }
}

/* From now on it is one of the container's. */
static void keep_state(Container *container, State *state) {
    state->next = (State *)container->states;
    container->states = state;
}

/* Whether all FMUs inside have what is asked for; if not, says so. */
static int are_able(Container *container, int able, const char *verb) {
    if (!able) complain(container, ERROR, "%s: not all FMUs inside can %s their states", container->name, verb);
    return able;
}

Status save_state(Container *container, void **told) {
    if (!are_able(container, container->saves_states, "save")) return ERROR;
    if (!told) return complain(container, ERROR, "%s: a pointer is null", container->name);
    State **const place = *told ? find_state(container, *told) : 0;
    if (*told && !place) return ERROR;
    State *const state = place ? *place : new_state(container);
    if (!state) return ERROR;
    write_own(container, state->bytes);
    Status status = OK;
    for (size_t i = 0; i < container->inners && status <= WARNING; i++) {
        Inner *const inner = &container->inner[i];
        StateFunction *const function = (StateFunction *)function_for(container, inner, GET_STATE);
        status = function ? judge_call(container, inner, name_of(inner, GET_STATE), function(inner->handle, &state->inner[i])) : ERROR;
    }
    if (status > WARNING && place) { /* one half is of now, the other as it was */
        *place = state->next;
        *told = 0;
    }
    if (status > WARNING) {
        destroy(container, state, 0);
        return status;
    }
    if (!place) keep_state(container, state);
    *told = state;
    return OK;
}

static int is_phase(uint32_t phase) { return phase && phase <= FAILED && !(phase & (phase - 1)); }

Status restore_state(Container *container, void *told) {
    State **const place = find_state(container, told);
    if (!place) return ERROR;
    const State *const state = *place;
    Flags flags;
    memcpy(&flags, state->bytes, sizeof flags);
    if (!is_phase(flags.phase) || flags.event_mode != (uint32_t)container->event_mode)
        return complain(container, ERROR, "%s: this state was saved by an instance %s event mode", container->name,
                        flags.event_mode ? "with" : "without");
    for (size_t i = 0; i < container->inners; i++) {
        Inner *const inner = &container->inner[i];
        SetState *const function = (SetState *)function_for(container, inner, SET_STATE);
        const Status status = function ? judge_call(container, inner, name_of(inner, SET_STATE), function(inner->handle, state->inner[i])) : ERROR;
        if (status > WARNING) return settle_phase(container, status);
    }
    read_own(container, state->bytes);
    return OK;
}

static Status inner_size(Container *container, Inner *inner, void *state, size_t *size) {
    StateSize *const function = (StateSize *)function_for(container, inner, STATE_SIZE);
    return function ? judge_call(container, inner, name_of(inner, STATE_SIZE), function(inner->handle, state, size)) : ERROR;
}

static Status size_of_state(Container *container, const State *state, size_t *size) {
    size_t all = sizeof(Head) + state->size;
    for (size_t i = 0; i < container->inners; i++) {
        size_t one = 0;
        const Status status = inner_size(container, &container->inner[i], state->inner[i], &one);
        if (status > WARNING) return status;
        all += 8 + one;
    }
    *size = all;
    return OK;
}

Status state_size(Container *container, void *told, size_t *size) {
    if (!are_able(container, container->serializes, "serialize")) return ERROR;
    if (!size) return complain(container, ERROR, "%s: a pointer is null", container->name);
    State **const place = find_state(container, told);
    return place ? size_of_state(container, *place, size) : ERROR;
}

/* The states of the instances, each after its size; of the bytes there are enough for them, but for what an FMU tells anew. */
static Status serialize_inners(Container *container, const State *state, unsigned char *at, const unsigned char *end) {
    for (size_t i = 0; i < container->inners; i++) {
        Inner *const inner = &container->inner[i];
        size_t size = 0;
        const Status sized = inner_size(container, inner, state->inner[i], &size);
        if (sized > WARNING) return sized;
        if ((size_t)(end - at) < 8 || (size_t)(end - at) - 8 < size)
            return complain(container, ERROR, "%s: %s tells another size of the same state", container->name, inner->name);
        Serialize *const function = (Serialize *)function_for(container, inner, SERIALIZE);
        const uint64_t told = (uint64_t)size;
        memcpy(at, &told, 8);
        const Status status = function ? judge_call(container, inner, name_of(inner, SERIALIZE), function(inner->handle, state->inner[i], at + 8, size)) : ERROR;
        if (status > WARNING) return status;
        at += 8 + size;
    }
    return OK;
}

Status serialize_state(Container *container, void *told, void *bytes, size_t size) {
    size_t needed = 0;
    if (!are_able(container, container->serializes, "serialize")) return ERROR;
    if (!bytes) return complain(container, ERROR, "%s: a pointer is null", container->name);
    State **const place = find_state(container, told);
    if (!place) return ERROR;
    const State *const state = *place;
    const Status sized = size_of_state(container, state, &needed);
    if (sized > WARNING) return sized;
    if (size < needed)
        return complain(container, ERROR, "%s: a state has %lu bytes, not %lu", container->name, (unsigned long)needed, (unsigned long)size);
    unsigned char *const own = (unsigned char *)bytes + sizeof(Head);
    memcpy(own, state->bytes, state->size);
    const Status status = serialize_inners(container, state, own + state->size, (unsigned char *)bytes + needed);
    if (status > WARNING) return status;
    const Head head = {MARK, (uint32_t)container->inners, token_digest(container), (uint64_t)state->size, digest(own, needed - sizeof head)};
    memcpy(bytes, &head, sizeof head);
    return OK;
}

/* The states of the instances from bytes that begin with their number; 0 if they are not whole. */
static int deserialize_inners(Container *container, State *state, const unsigned char *at, const unsigned char *end) {
    for (size_t i = 0; i < container->inners; i++) {
        Inner *const inner = &container->inner[i];
        uint64_t size;
        if (end - at < 8) return 0;
        memcpy(&size, at, 8);
        at += 8;
        if (size > (uint64_t)(end - at)) return 0;
        Deserialize *const function = (Deserialize *)function_for(container, inner, DESERIALIZE);
        if (!function || judge_call(container, inner, name_of(inner, DESERIALIZE), function(inner->handle, at, (size_t)size, &state->inner[i])) > WARNING)
            return 0;
        at += size;
    }
    return at == end;
}

/* Whether bytes are those of a state of this container, whole and unchanged. */
static int is_own(const Container *container, const unsigned char *at, size_t size) {
    Head head;
    if (size < sizeof head) return 0;
    memcpy(&head, at, sizeof head);
    return head.mark == MARK && head.inners == container->inners && head.token == token_digest(container) &&
           head.size == own_size(container) && size - sizeof head >= head.size && head.sum == digest(at + sizeof head, size - sizeof head);
}

/* A state that the host's pointer tells already gets the new content; whatever else is there, the standard says that it is replaced. */
Status deserialize_state(Container *container, const void *bytes, size_t size, void **told) {
    const unsigned char *const at = (const unsigned char *)bytes;
    if (!are_able(container, container->serializes, "serialize")) return ERROR;
    if (!bytes || !told) return complain(container, ERROR, "%s: a pointer is null", container->name);
    if (!is_own(container, at, size))
        return complain(container, ERROR, "%s: these %lu bytes are no state of this FMU, or damaged", container->name, (unsigned long)size);
    State *const state = new_state(container);
    if (!state) return ERROR;
    memcpy(state->bytes, at + sizeof(Head), state->size);
    if (!deserialize_inners(container, state, at + sizeof(Head) + state->size, at + size)) {
        destroy(container, state, 0);
        return complain(container, ERROR, "%s: these %lu bytes are no state of this FMU", container->name, (unsigned long)size);
    }
    State *old = (State *)container->states;
    while (old && old != *told) old = old->next;
    if (!old) {
        keep_state(container, state);
        *told = state;
        return OK;
    }
    const State spare = *old;
    old->bytes = state->bytes;
    old->inner = state->inner;
    state->bytes = spare.bytes;
    state->inner = spare.inner;
    return destroy(container, state, 0);
}
