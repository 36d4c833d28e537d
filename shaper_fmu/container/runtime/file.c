/* The system's file: words of eight bytes, written by container/serialize.py in the order in which they are read here. */

#include "container.h"
#include "fields.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MARK 0x5348415045523031ull /* "SHAPER01" */

typedef struct {
    const unsigned char *at;
    const unsigned char *end;
    Container *container;
    int damaged;
} Reader;

/* Memory that lasts as long as the container, all zero; null if there is none. */
void *take(Container *container, size_t count, size_t size) {
    if (container->takings == container->room) {
        const size_t room = container->room ? 2 * container->room : 64;
        void **const more = (void **)realloc(container->taken, room * sizeof *more);
        if (!more) return 0;
        container->taken = more;
        container->room = room;
    }
    void *const found = calloc(count ? count : 1, size ? size : 1);
    if (found) container->taken[container->takings++] = found;
    return found;
}

static uint64_t word_at(const unsigned char *at) {
    uint64_t word = 0;
    for (int i = 7; i >= 0; i--) word = word << 8 | at[i];
    return word;
}

static uint64_t word(Reader *reader) {
    if (reader->end - reader->at < 8) {
        reader->damaged = 1;
        return 0;
    }
    reader->at += 8;
    return word_at(reader->at - 8);
}

static double real(Reader *reader) {
    const uint64_t bits = word(reader);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

static int number(Reader *reader) { return (int)(int64_t)word(reader); }

/* How many items follow, each of so many words at least. */
static size_t count(Reader *reader, size_t words) {
    const uint64_t found = word(reader), most = (uint64_t)(reader->end - reader->at) / (8 * (words ? words : 1));
    if (found <= most) return (size_t)found;
    reader->damaged = 1;
    return 0;
}

static const char *text(Reader *reader) {
    const uint64_t length = word(reader), left = (uint64_t)(reader->end - reader->at);
    if (reader->damaged || length >= left || left - length < 8 - length % 8) {
        reader->damaged = 1;
        return "";
    }
    char *const found = (char *)take(reader->container, (size_t)length + 1, 1);
    if (found) memcpy(found, reader->at, (size_t)length);
    reader->at += length + 8 - length % 8;
    if (!found) reader->damaged = 1;
    return found ? found : "";
}

static void *room(Reader *reader, size_t items, size_t size) {
    void *const found = take(reader->container, items, size);
    if (!found) reader->damaged = 1;
    return found;
}

static const char **texts(Reader *reader, size_t *items) {
    *items = count(reader, 2);
    const char **const found = (const char **)room(reader, *items, sizeof *found);
    for (size_t i = 0; found && i < *items; i++) found[i] = text(reader);
    return found;
}

static const char *symbol(Reader *reader) {
    const uint64_t which = word(reader);
    if (which < reader->container->symbols) return reader->container->symbol[which];
    reader->damaged = 1;
    return "";
}

/* How many bytes a value has in memory. */
static size_t size_of(int type) {
    switch (type) {
    case TYPE_F8: case TYPE_I8: case TYPE_U8: return 8;
    case TYPE_I2: case TYPE_U2: return 2;
    case TYPE_I1: case TYPE_U1: case TYPE_BOOLEAN3: return 1;
    default: return 4;
    }
}

/* Values of one type, one after the other, each from a word. */
static void *values(Reader *reader, int type, size_t items) {
    unsigned char *const found = (unsigned char *)room(reader, items, 8);
    for (size_t i = 0; found && i < items; i++) {
        const uint64_t bits = word(reader);
        double value;
        memcpy(&value, &bits, sizeof value);
        const float single = fabs(value) <= FLT_MAX || !isfinite(value) ? (float)value : 0.0f;
        unsigned char *const at = found + i * size_of(type);
        if (type == TYPE_F4)
            memcpy(at, &single, 4);
        else if (size_of(type) == 8)
            memcpy(at, &bits, 8);
        else
            for (size_t k = 0; k < size_of(type); k++) { /* in the processor's own order */
                const uint32_t part = (uint32_t)bits;
                const uint16_t half = (uint16_t)bits;
                const uint8_t byte = (uint8_t)bits;
                memcpy(at, size_of(type) == 4 ? (const void *)&part : size_of(type) == 2 ? (const void *)&half : (const void *)&byte,
                       size_of(type));
            }
    }
    return found;
}

static void read_inner(Reader *reader, Inner *inner) {
    inner->container = reader->container;
    inner->name = text(reader);
    inner->folder = text(reader);
    inner->identifier = text(reader);
    inner->token = text(reader);
    inner->version = number(reader);
    inner->event_mode = number(reader);
    inner->early_return = number(reader);
    inner->events_logged = number(reader);
    inner->setting_count = count(reader, 5);
    inner->settings = (Setting *)room(reader, inner->setting_count, sizeof *inner->settings);
    for (size_t i = 0; !reader->damaged && i < inner->setting_count; i++) {
        Setting *const setting = &inner->settings[i];
        setting->phase = number(reader);
        setting->function = symbol(reader);
        setting->type = number(reader);
        setting->reference = (uint32_t)word(reader);
        setting->count = count(reader, 1);
        setting->values = values(reader, setting->type, setting->count);
    }
}

#define ARRAY_COUNT (sizeof ARRAYS / sizeof *ARRAYS)

typedef struct {
    void *at;
    size_t count;
} AnyArray;

/* The arrays in memory: those of System, then the extra ones. */
typedef struct {
    size_t count;
    AnyArray *array;
    const RecordKind **kind;
} Arrays;

static void *pointer(Reader *reader, const Arrays *arrays, uint64_t told) {
    if (!told) return 0;
    const uint64_t which = (told >> 40) - 1, place = told & ((UINT64_C(1) << 40) - 1);
    if (which >= arrays->count) {
        reader->damaged = 1;
        return 0;
    }
    const size_t size = arrays->kind[which]->fields > 1 ? arrays->kind[which]->size : 1;
    const uint64_t bytes = place * size, all = (uint64_t)arrays->array[which].count * arrays->kind[which]->size;
    if (bytes > all) reader->damaged = 1;
    return bytes > all ? 0 : (char *)arrays->array[which].at + (size_t)bytes;
}

/* Some functions need not exist: what is called in event mode alone, and the reset, which is looked for when it is asked for. */
static int may_lack(int which, const Inner *inner, const char *name) {
    if (which == 0) return strstr(name, "Reset") || (!inner->event_mode && (strstr(name, "Mode") || strstr(name, "Discrete")) &&
                                                     !strstr(name, "InitializationMode"));
    return ARRAYS[which].field == Clock_fields;
}

static Function function(Reader *reader, int which, uint64_t told) {
    Container *const container = reader->container;
    if (!told) return 0;
    const uint64_t inner = (told >> 32) - 1, name = told & 0xffffffffu;
    if (inner >= container->inners || name >= container->symbols) {
        reader->damaged = 1;
        return 0;
    }
    Inner *const owner = &container->inner[inner];
    const Function found = find_function(owner->library, container->symbol[name]);
    if (!found && !may_lack(which, owner, container->symbol[name])) {
        complain(container, ERROR, "%s: %s: its library lacks the function %s", container->name, owner->name, container->symbol[name]);
        reader->damaged = 2;
    }
    return found;
}

static void read_field(Reader *reader, const Arrays *arrays, int which, const Field *field, unsigned char *record) {
    const uint64_t told = word(reader);
    unsigned char *const at = record + field->offset;
    const int32_t whole = (int32_t)told;
    const size_t size = (size_t)told;
    switch (field->kind) {
    case FIELD_I4: memcpy(at, &whole, 4); break;
    case FIELD_I8: case FIELD_F8: memcpy(at, &told, 8); break;
    case FIELD_SIZE: memcpy(at, &size, sizeof size); break;
    case FIELD_POINTER: {
        void *const found = pointer(reader, arrays, told);
        memcpy(at, &found, sizeof found);
        break;
    }
    case FIELD_FUNCTION: {
        const Function found = function(reader, which, told);
        memcpy(at, &found, sizeof found);
        break;
    }
    default: { /* the instance's handle: it is not made yet, so its number; see put_handles */
        void *const found = (void *)(uintptr_t)told;
        memcpy(at, &found, sizeof found);
    }
    }
}

static void read_records(Reader *reader, const Arrays *arrays, int which, const RecordKind *kind, void *at, size_t items) {
    for (size_t i = 0; i < items && !reader->damaged; i++)
        for (int k = 0; k < kind->fields; k++)
            read_field(reader, arrays, which, &kind->field[k], (unsigned char *)at + i * kind->size);
}

static void read_arrays(Reader *reader) {
    Container *const container = reader->container;
    const size_t extras = count(reader, 2), all = ARRAY_COUNT + extras;
    AnyArray *const array = (AnyArray *)room(reader, all, sizeof *array);
    const RecordKind **const kind = (const RecordKind **)room(reader, all, sizeof *kind);
    if (reader->damaged) return;
    for (size_t i = 0; i < extras; i++) {
        const uint64_t which = word(reader);
        array[ARRAY_COUNT + i].count = count(reader, 1);
        if (which > EXTRA_REFERENCES) reader->damaged = 1;
        kind[ARRAY_COUNT + i] = &EXTRAS[reader->damaged ? 0 : which];
    }
    for (size_t i = 0; i < ARRAY_COUNT; i++) {
        kind[i] = &ARRAYS[i];
        array[i].count = count(reader, (size_t)ARRAYS[i].fields);
    }
    for (size_t i = 0; i < all; i++) array[i].at = room(reader, array[i].count, kind[i]->size);
    const Arrays arrays = {all, array, kind};
    for (size_t i = 0; i < all && !reader->damaged; i++) read_records(reader, &arrays, (int)i, kind[i], array[i].at, array[i].count);
    memcpy(&container->system, array, sizeof container->system);
    read_records(reader, &arrays, -1, &CONTROL_KIND, &container->fresh, 1);
}

/* Where loops without delay are cut. */
static void read_cuts(Reader *reader) {
    Container *const container = reader->container;
    const size_t cuts = count(reader, 1);
    container->cuts.count = cuts;
    container->cuts.at = (int32_t *)room(reader, cuts, sizeof *container->cuts.at);
    container->cut_memory.count = cuts * (cuts + 4) + 1;
    container->cut_memory.at = (double *)room(reader, container->cut_memory.count, sizeof(double));
    for (size_t i = 0; i < cuts && !reader->damaged; i++) {
        container->cuts.at[i] = (int32_t)word(reader);
        if ((size_t)container->cuts.at[i] >= container->system.bus.count) reader->damaged = 1;
    }
}

static void read_labels(Reader *reader) {
    Container *const container = reader->container;
    container->label = (Label *)room(reader, container->system.transfers.count, sizeof *container->label);
    for (size_t i = 0; i < container->system.transfers.count && !reader->damaged; i++) {
        Label *const label = &container->label[i];
        label->inner = number(reader);
        if (label->inner < 0 || (size_t)label->inner >= container->inners) reader->damaged = 1;
        label->function = symbol(reader);
        label->element = texts(reader, &label->elements);
    }
    container->clock = texts(reader, &container->clocks);
}

static void read_wholes(Reader *reader) {
    Container *const container = reader->container;
    container->wholes = count(reader, 8);
    container->whole = (Whole *)room(reader, container->wholes, sizeof *container->whole);
    for (size_t i = 0; i < container->wholes && !reader->damaged; i++) {
        Whole *const whole = &container->whole[i];
        whole->inner = number(reader);
        (void)word(reader); /* the version, which the instance tells */
        whole->type = number(reader);
        whole->reference = (uint32_t)word(reader);
        whole->length = (size_t)word(reader);
        whole->get_name = symbol(reader);
        whole->set_name = symbol(reader);
        whole->in_event_mode = number(reader);
        whole->known = number(reader);
        if (whole->length > 100000000 || whole->inner < 0 || (size_t)whole->inner >= container->inners) reader->damaged = 1;
        if (reader->damaged) return;
        whole->values = whole->known ? values(reader, whole->type, whole->length) : room(reader, whole->length, 16);
        void *const library = container->inner[whole->inner].library;
        whole->get = find_function(library, whole->get_name);
        whole->set = find_function(library, whole->set_name);
    }
}

static void read_targets(Reader *reader, const Variable *variable, Slot *slot) {
    slot->targets = count(reader, 5);
    Target *const target = (Target *)room(reader, slot->targets, sizeof *target);
    slot->target = target;
    for (size_t i = 0; i < slot->targets && !reader->damaged; i++) {
        target[i].place = number(reader);
        target[i].element = number(reader);
        target[i].gain = real(reader);
        target[i].offset = real(reader);
        target[i].mapped = count(reader, 2);
        target[i].mapping = (const double *)values(reader, TYPE_F8, 2 * target[i].mapped);
        const size_t places = variable->on_bus ? reader->container->system.bus.count : reader->container->wholes;
        if (target[i].place < 0 || (size_t)target[i].place >= places) reader->damaged = 1;
        if (reader->damaged || variable->on_bus) continue;
        const Whole *const whole = &reader->container->whole[target[i].place];
        if (target[i].element < 0 || (size_t)target[i].element >= whole->length) reader->damaged = 1;
    }
}

static void read_steered(Reader *reader, Slot *slot) {
    slot->steered = count(reader, 3);
    Steered *const steer = (Steered *)room(reader, slot->steered, sizeof *steer);
    slot->steer = steer;
    for (size_t i = 0; i < slot->steered && !reader->damaged; i++) {
        steer[i].inner = number(reader);
        steer[i].reference = (uint32_t)word(reader);
        steer[i].gain = real(reader);
        if (steer[i].inner < 0 || (size_t)steer[i].inner >= reader->container->inners) reader->damaged = 1;
    }
}

static void read_variables(Reader *reader) {
    Container *const container = reader->container;
    container->variables = count(reader, 5);
    container->variable = (Variable *)room(reader, container->variables, sizeof *container->variable);
    for (size_t i = 0; i < container->variables && !reader->damaged; i++) {
        Variable *const variable = &container->variable[i];
        variable->name = text(reader);
        variable->type = number(reader);
        variable->settable = (Settable)number(reader);
        variable->on_bus = number(reader);
        variable->slots = count(reader, 2);
        variable->slot = (Slot *)room(reader, variable->slots, sizeof *variable->slot);
        for (size_t k = 0; k < variable->slots && !reader->damaged; k++) {
            variable->slot[k].start = real(reader);
            read_targets(reader, variable, &variable->slot[k]);
            if (!variable->slot[k].targets) reader->damaged = 1;
            read_steered(reader, &variable->slot[k]);
        }
    }
}

static void read_all(Reader *reader) {
    Container *const container = reader->container;
    const char *const name = text(reader), *const token = text(reader);
    if (!reader->damaged) container->name = name, container->token = token;
    container->longest = real(reader);
    container->saves_states = number(reader);
    container->serializes = number(reader);
    container->symbol = texts(reader, &container->symbols);
    const size_t inners = count(reader, 10);
    container->inner = (Inner *)room(reader, inners, sizeof *container->inner);
    container->inners = container->inner ? inners : 0;
    for (size_t i = 0; i < container->inners && !reader->damaged; i++) read_inner(reader, &container->inner[i]);
    for (size_t i = 0; i < container->inners && !reader->damaged; i++)
        if (!load_inner(container, &container->inner[i])) reader->damaged = 2; /* which is said */
    if (!reader->damaged) read_arrays(reader);
    if (!reader->damaged) read_cuts(reader);
    if (!reader->damaged) read_labels(reader);
    if (!reader->damaged) read_wholes(reader);
    if (!reader->damaged) read_variables(reader);
}

/* FNV-1a, word by word, and the high bits mixed with the low ones: changes of two words' highest bits would cancel each other. */
static uint64_t checksum(const unsigned char *at, size_t words) {
    uint64_t sum = 0xcbf29ce484222325ull;
    for (size_t i = 0; i < words; i++) {
        sum = (sum ^ word_at(at + 8 * i)) * 0x100000001b3u;
        sum ^= sum >> 32;
    }
    return sum;
}

static unsigned char *content_of(const char *path, size_t *size) {
    FILE *const file = (FILE *)open_file(path);
    if (!file) return 0;
    size_t length = 0, space = 1 << 16;
    unsigned char *content = (unsigned char *)malloc(space);
    while (content) {
        length += fread(content + length, 1, space - length, file);
        if (length < space) break;
        unsigned char *const more = (unsigned char *)realloc(content, space *= 2);
        if (!more) free(content);
        content = more;
    }
    fclose(file);
    *size = length;
    return content;
}

int read_system(Container *container, const char *path) {
    size_t size = 0;
    unsigned char *const content = content_of(path, &size);
    if (!content) return complain(container, ERROR, "%s: cannot read %s", container->name, path), 0;
    int whole = size % 8 == 0 && size >= 24 && word_at(content) == MARK;
    whole = whole && checksum(content, size / 8 - 1) == word_at(content + size - 8);
    if (!whole) {
        complain(container, ERROR, "%s: %s is damaged; get the FMU again, or pack it anew", container->name, path);
    } else if (word_at(content + 8) != LAYOUT_DIGEST) {
        complain(container, ERROR, "%s: %s belongs to another version of this library; pack the FMU anew", container->name, path);
        whole = 0;
    } else {
        Reader reader = {content + 16, content + size - 8, container, 0};
        read_all(&reader);
        if (reader.damaged == 1)
            complain(container, ERROR, "%s: %s makes no sense, or there is not enough memory; pack the FMU anew", container->name, path);
        whole = !reader.damaged;
    }
    free(content);
    return whole;
}

/* Its arrays differ in what they point to, so that they are copied, not looked at by another type. */
static AnyArray array_of(const Container *container, size_t which) {
    AnyArray found;
    memcpy(&found, (const char *)&container->system + which * sizeof found, sizeof found);
    return found;
}

void put_handles(Container *container) {
    for (size_t which = 0; which < ARRAY_COUNT; which++)
        for (int k = 0; k < ARRAYS[which].fields; k++) {
            if (ARRAYS[which].field[k].kind != FIELD_HANDLE) continue;
            unsigned char *at = (unsigned char *)array_of(container, which).at + ARRAYS[which].field[k].offset;
            for (size_t i = 0; i < array_of(container, which).count; i++, at += ARRAYS[which].size) {
                void *handle;
                memcpy(&handle, at, sizeof handle);
                const uintptr_t inner = (uintptr_t)handle;
                handle = inner && inner <= container->inners ? container->inner[inner - 1].handle : 0;
                memcpy(at, &handle, sizeof handle);
            }
        }
}

/* What a run changes: all fields that are no addresses, of all arrays. */

static size_t fields_of(const RecordKind *kind) {
    size_t found = 0;
    for (int i = 0; i < kind->fields; i++) found += kind->field[i].kind <= FIELD_SIZE;
    return found;
}

size_t fields_size(const Container *container) {
    size_t fields = fields_of(&CONTROL_KIND);
    for (size_t i = 0; i < ARRAY_COUNT; i++) fields += fields_of(&ARRAYS[i]) * array_of(container, i).count;
    return 8 * fields;
}

static size_t field_size(int kind) { return kind == FIELD_I4 ? 4 : kind == FIELD_SIZE ? sizeof(size_t) : 8; }

/* Copy the fields of records to bytes, eight for each. */
static unsigned char *write_records(const RecordKind *kind, const unsigned char *records, size_t count, unsigned char *at) {
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < kind->fields; k++) {
            const Field *const field = &kind->field[k];
            if (field->kind > FIELD_SIZE) continue;
            memset(at, 0, 8);
            memcpy(at, records + i * kind->size + field->offset, field_size(field->kind));
            at += 8;
        }
    return at;
}

/* And back. */
static const unsigned char *read_back(const RecordKind *kind, unsigned char *records, size_t count, const unsigned char *at) {
    for (size_t i = 0; i < count; i++)
        for (int k = 0; k < kind->fields; k++) {
            const Field *const field = &kind->field[k];
            if (field->kind > FIELD_SIZE) continue;
            memcpy(records + i * kind->size + field->offset, at, field_size(field->kind));
            at += 8;
        }
    return at;
}

void write_fields(const Container *container, unsigned char *at) {
    at = write_records(&CONTROL_KIND, (const unsigned char *)&container->control, 1, at);
    for (size_t i = 0; i < ARRAY_COUNT; i++) {
        const AnyArray array = array_of(container, i);
        at = write_records(&ARRAYS[i], (const unsigned char *)array.at, array.count, at);
    }
}

void read_fields(Container *container, const unsigned char *at) {
    at = read_back(&CONTROL_KIND, (unsigned char *)&container->control, 1, at);
    for (size_t i = 0; i < ARRAY_COUNT; i++) {
        const AnyArray array = array_of(container, i);
        at = read_back(&ARRAYS[i], (unsigned char *)array.at, array.count, at);
    }
}
