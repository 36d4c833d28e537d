/* States: everything that a run changes in the container, and the states of all FMUs inside. */

#include "container.h"

#include <stdlib.h>
#include <string.h>

#define MARK 0x53545445u

typedef struct {
    uint32_t phase, dirty, ready, waiting, entered, terminated, sloping, steering;
    double origin;
} Flags;

/* A saved state; its bytes are flags, fields and wholes. */
typedef struct {
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
    if (!found)
        complain(container, ERROR, "%s: %s: its library lacks the function %s", container->name, inner->name, name_of(inner, which));
    return found;
}

static uint64_t digest(const char *text) {
    uint64_t sum = 0xcbf29ce484222325ull;
    for (; *text; text++) sum = (sum ^ (unsigned char)*text) * 0x100000001b3ull;
    return sum;
}

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
                         (uint32_t)container->sloping, (uint32_t)container->steering, container->origin};
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
    container->discarded = 0;
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

Status free_state(Container *container, void **place) {
    State *const state = place ? (State *)*place : 0;
    Status worst = OK;
    if (!state) return OK;
    for (size_t i = 0; i < state->inners; i++) {
        Inner *const inner = &container->inner[i];
        if (!state->inner[i]) continue;
        StateFunction *const function = (StateFunction *)function_for(container, inner, FREE_STATE);
        const Status status = function ? judge_call(container, inner, name_of(inner, FREE_STATE), function(inner->handle, &state->inner[i])) : ERROR;
        if (status > worst) worst = status;
    }
    free(state->bytes);
    free(state->inner);
    free(state);
    *place = 0;
    return worst;
}

Status save_state(Container *container, void **place) {
    if (!place) return complain(container, ERROR, "%s: a pointer is null", container->name);
    State *state = (State *)*place;
    if (!state) state = new_state(container);
    if (!state) return ERROR;
    write_own(container, state->bytes);
    for (size_t i = 0; i < container->inners; i++) {
        Inner *const inner = &container->inner[i];
        StateFunction *const function = (StateFunction *)function_for(container, inner, GET_STATE);
        const Status status = function ? judge_call(container, inner, name_of(inner, GET_STATE), function(inner->handle, &state->inner[i])) : ERROR;
        if (status > WARNING) {
            void *failed = state;
            free_state(container, &failed);
            *place = 0;
            return status;
        }
    }
    *place = state;
    return OK;
}

Status restore_state(Container *container, void *saved) {
    State *const state = (State *)saved;
    if (!state) return complain(container, ERROR, "%s: there is no state to restore", container->name);
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

Status state_size(Container *container, void *saved, size_t *size) {
    const State *const state = (const State *)saved;
    if (!state || !size) return complain(container, ERROR, "%s: a pointer is null", container->name);
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

Status serialize_state(Container *container, void *saved, void *bytes, size_t size) {
    const State *const state = (const State *)saved;
    size_t needed = 0;
    if (!bytes) return complain(container, ERROR, "%s: a pointer is null", container->name);
    const Status sized = state_size(container, saved, &needed);
    if (sized > WARNING) return sized;
    if (size != needed)
        return complain(container, ERROR, "%s: a state has %lu bytes, not %lu", container->name, (unsigned long)needed, (unsigned long)size);
    unsigned char *at = (unsigned char *)bytes;
    const Head head = {MARK, (uint32_t)container->inners, digest(container->token), (uint64_t)state->size};
    memcpy(at, &head, sizeof head);
    memcpy(at + sizeof head, state->bytes, state->size);
    at += sizeof head + state->size;
    for (size_t i = 0; i < container->inners; i++) {
        Inner *const inner = &container->inner[i];
        size_t one = 0;
        Status status = inner_size(container, inner, state->inner[i], &one);
        Serialize *const function = (Serialize *)function_for(container, inner, SERIALIZE);
        const uint64_t told = (uint64_t)one;
        memcpy(at, &told, 8);
        if (status <= WARNING)
            status = function ? judge_call(container, inner, name_of(inner, SERIALIZE), function(inner->handle, state->inner[i], at + 8, one)) : ERROR;
        if (status > WARNING) return status;
        at += 8 + one;
    }
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

Status deserialize_state(Container *container, const void *bytes, size_t size, void **place) {
    const unsigned char *const at = (const unsigned char *)bytes;
    Head head;
    if (!bytes || !place) return complain(container, ERROR, "%s: a pointer is null", container->name);
    if (size >= sizeof head) memcpy(&head, at, sizeof head);
    if (size < sizeof head || head.mark != MARK || head.inners != container->inners || head.token != digest(container->token) ||
        head.size != own_size(container) || size - sizeof head < head.size)
        return complain(container, ERROR, "%s: these %lu bytes are no state of this FMU", container->name, (unsigned long)size);
    State *const state = new_state(container);
    if (!state) return ERROR;
    memcpy(state->bytes, at + sizeof head, state->size);
    if (deserialize_inners(container, state, at + sizeof head + state->size, at + size)) {
        *place = state;
        return OK;
    }
    void *failed = state;
    free_state(container, &failed);
    return complain(container, ERROR, "%s: these %lu bytes are no state of this FMU", container->name, (unsigned long)size);
}
