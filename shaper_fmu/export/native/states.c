/* Saved states: an instance's life and its whole record, as one block of bytes. */

#include "component.h"

#include <stdlib.h>
#include <string.h>

typedef struct {
    uint64_t digest;
    int32_t phase, stale, model_exchange, event_mode, stop_defined, step_status;
    double time, record_time, event_time, stop_time;
} SavedLife;

static const uint64_t CHECKSUM_START = 14695981039346656037u, CHECKSUM_FACTOR = 1099511628211u; /* FNV-1a */

static size_t state_size(void) { return sizeof(SavedLife) + 2 * (size_t)component.record_size; }

size_t serialized_size(void) { return sizeof(uint64_t) + state_size(); }

static Status no_memory(Instance *instance) { return refuse(instance, ERROR, "%s: not enough memory for a state", component.name); }

/* Whether bytes begin like a state of this component and version; another one's may be shorter. */
static int is_own(const void *bytes) {
    uint64_t found;
    memcpy(&found, bytes, sizeof found);
    return found == component.digest;
}

static Status not_own(Instance *instance) {
    return refuse(instance, ERROR, "%s: this is not the state of this component and version", component.name);
}

/* Save into *state, which is made if it is null. */
Status save_state(Instance *instance, void **state) {
    if (!state) return refuse(instance, ERROR, "%s: there is no place to save a state to (null pointer)", component.name);
    if (*state && !is_own(*state)) return not_own(instance);
    SavedLife life = {component.digest, instance->phase, instance->stale, instance->model_exchange, instance->event_mode,
                      instance->stop_defined, instance->step_status, instance->time, instance->record_time, instance->event_time,
                      instance->stop_time};
    size_t size = (size_t)component.record_size;
    unsigned char *bytes = (unsigned char *)(*state ? *state : malloc(state_size()));
    if (!bytes) return no_memory(instance);
    memcpy(bytes, &life, sizeof life);
    memcpy(bytes + sizeof life, instance->record, size);
    memcpy(bytes + sizeof life + size, instance->held ? instance->held : instance->record, size);
    *state = bytes;
    return OK;
}

static int is_phase(int phase) { return phase > 0 && phase <= FAILED && !(phase & (phase - 1)) && phase != INTERMEDIATE; }

/* Whether parameters and held inputs of a restored state are in their domains: kernels rely on it. Other inputs are checked
   when they are used. */
static int in_domains(Instance *instance) {
    unsigned char *own = instance->record;
    if (check_parameters(instance)) return 0;
    if (!instance->held || !component.sampled) return 1;
    instance->record = instance->held;
    Status status = check_inputs(instance, instance->record_time);
    instance->record = own;
    return status == OK;
}

/* Whether Booleans are 0 or 1: kernels take them as indexes, too. */
static int has_booleans(const unsigned char *record) {
    for (int k = 0; k < component.variables; k++) {
        const Variable *v = &component.variable[k];
        for (int i = 0; v->kind == BOOLEAN && i < length(v); i++) {
            uint32_t value;
            memcpy(&value, record + v->offset + 4 * i, sizeof value);
            if (value > 1) return 0;
        }
    }
    return 1;
}

/* The state must be this component's, of an instance for the same kind of simulation. */
Status restore_state(Instance *instance, const void *state) {
    SavedLife life;
    const unsigned char *bytes = (const unsigned char *)state;
    if (!state) return refuse(instance, ERROR, "%s: there is no state to restore (null pointer)", component.name);
    memcpy(&life, bytes, sizeof life);
    if (!is_own(state) || !is_phase(life.phase)) return not_own(instance);
    if (life.model_exchange != instance->model_exchange || life.event_mode != instance->event_mode)
        return refuse(instance, ERROR, "%s: this state was saved by an instance for another kind of simulation", component.name);
    if (!has_booleans(bytes + sizeof life) || (instance->held && !has_booleans(bytes + sizeof life + component.record_size)))
        return refuse(instance, ERROR, "%s: this state has a Boolean that is neither true nor false", component.name);
    instance->phase = (Phase)life.phase;
    instance->stale = life.phase == CONTINUOUS ? 1 : life.stale;
    instance->tried = instance->untouched = 0;
    instance->stop_defined = life.stop_defined;
    instance->step_status = (Status)life.step_status;
    instance->time = life.time;
    instance->record_time = life.record_time;
    instance->event_time = life.event_time;
    instance->stop_time = life.stop_time;
    memcpy(instance->record, bytes + sizeof life, (size_t)component.record_size);
    if (instance->held) memcpy(instance->held, bytes + sizeof life + component.record_size, (size_t)component.record_size);
    if (life.phase & (INSTANTIATED | INITIALIZING | FAILED)) return OK; /* the values are checked before they are used */
    if (in_domains(instance)) return OK;
    instance->phase = FAILED;
    return ERROR;
}

static uint64_t checksum(const unsigned char *bytes, size_t size) {
    uint64_t sum = CHECKSUM_START;
    for (size_t i = 0; i < size; i++) sum = (sum ^ bytes[i]) * CHECKSUM_FACTOR;
    return sum;
}

/* The bytes of a saved state behind their checksum. */
Status serialize_state(Instance *instance, const void *state, void *bytes, size_t size) {
    if (!state || !bytes) return refuse(instance, ERROR, "%s: there is no state to serialize (null pointer)", component.name);
    if (!is_own(state)) return not_own(instance);
    if (size < serialized_size())
        return refuse(instance, ERROR, "%s: a serialized state needs %d bytes, not %d", component.name, (int)serialized_size(), (int)size);
    uint64_t sum = checksum((const unsigned char *)state, state_size());
    memcpy(bytes, &sum, sizeof sum);
    memcpy((unsigned char *)bytes + sizeof sum, state, state_size());
    return OK;
}

Status deserialize_state(Instance *instance, const void *bytes, size_t size, void **state) {
    uint64_t sum = 0;
    if (!bytes || !state) return refuse(instance, ERROR, "%s: there is no state to deserialize (null pointer)", component.name);
    if (size != serialized_size())
        return refuse(instance, ERROR, "%s: a serialized state has %d bytes, not %d", component.name, (int)serialized_size(), (int)size);
    const unsigned char *content = (const unsigned char *)bytes + sizeof sum;
    memcpy(&sum, bytes, sizeof sum);
    if (sum != checksum(content, state_size())) return refuse(instance, ERROR, "%s: the serialized state is damaged", component.name);
    if (!is_own(content) || (*state && !is_own(*state))) return not_own(instance);
    if (!*state) *state = malloc(state_size());
    if (!*state) return no_memory(instance);
    memcpy(*state, content, state_size());
    return OK;
}

void free_state(void **state) {
    if (!state) return;
    free(*state);
    *state = 0;
}
