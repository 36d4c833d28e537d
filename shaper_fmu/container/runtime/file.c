/* The system's file: words of eight bytes, written by container/serialize.py in the order in which they are read here. */

#include "fields.h"
#include "reader.h"

#include <stdlib.h>
#include <string.h>

#define MARK 0x5348415045523031ull /* "SHAPER01" */

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

static void read_inner(Reader *reader, Inner *inner) {
    inner->container = reader->container;
    inner->name = read_text(reader);
    inner->folder = read_text(reader);
    inner->identifier = read_text(reader);
    inner->token = read_text(reader);
    inner->version = read_number(reader);
    inner->event_mode = read_number(reader);
    inner->early_return = read_number(reader);
    inner->events_logged = read_number(reader);
    inner->setting_count = read_count(reader, 5);
    inner->settings = (Setting *)read_room(reader, inner->setting_count, sizeof *inner->settings);
    for (size_t i = 0; !reader->damaged && i < inner->setting_count; i++) {
        Setting *const setting = &inner->settings[i];
        setting->phase = read_number(reader);
        setting->function = read_symbol(reader);
        setting->type = read_number(reader);
        setting->reference = (uint32_t)read_word(reader);
        setting->count = read_count(reader, 1);
        setting->values = read_values(reader, setting->type, setting->count);
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
    const uint64_t told = read_word(reader);
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
    const size_t extras = read_count(reader, 2), all = ARRAY_COUNT + extras;
    AnyArray *const array = (AnyArray *)read_room(reader, all, sizeof *array);
    const RecordKind **const kind = (const RecordKind **)read_room(reader, all, sizeof *kind);
    if (reader->damaged) return;
    for (size_t i = 0; i < extras; i++) {
        const uint64_t which = read_word(reader);
        array[ARRAY_COUNT + i].count = read_count(reader, 1);
        if (which > EXTRA_REFERENCES) reader->damaged = 1;
        kind[ARRAY_COUNT + i] = &EXTRAS[reader->damaged ? 0 : which];
    }
    for (size_t i = 0; i < ARRAY_COUNT; i++) {
        kind[i] = &ARRAYS[i];
        array[i].count = read_count(reader, (size_t)ARRAYS[i].fields);
    }
    for (size_t i = 0; i < all; i++) array[i].at = read_room(reader, array[i].count, kind[i]->size);
    const Arrays arrays = {all, array, kind};
    for (size_t i = 0; i < all && !reader->damaged; i++) read_records(reader, &arrays, (int)i, kind[i], array[i].at, array[i].count);
    memcpy(&container->system, array, sizeof container->system);
    read_records(reader, &arrays, -1, &CONTROL_KIND, &container->fresh, 1);
}

/* Where loops without delay are cut. */
static void read_cuts(Reader *reader) {
    Container *const container = reader->container;
    const size_t cuts = read_count(reader, 1);
    container->cuts.count = cuts;
    container->cuts.at = (int32_t *)read_room(reader, cuts, sizeof *container->cuts.at);
    container->cut_memory.count = cuts * (cuts + 4) + 1;
    container->cut_memory.at = (double *)read_room(reader, container->cut_memory.count, sizeof(double));
    for (size_t i = 0; i < cuts && !reader->damaged; i++) {
        container->cuts.at[i] = (int32_t)read_word(reader);
        if ((size_t)container->cuts.at[i] >= container->system.bus.count) reader->damaged = 1;
    }
}

static void read_labels(Reader *reader) {
    Container *const container = reader->container;
    container->label = (Label *)read_room(reader, container->system.transfers.count, sizeof *container->label);
    for (size_t i = 0; i < container->system.transfers.count && !reader->damaged; i++) {
        Label *const label = &container->label[i];
        label->inner = read_number(reader);
        if (label->inner < 0 || (size_t)label->inner >= container->inners) reader->damaged = 1;
        label->function = read_symbol(reader);
        label->element = read_texts(reader, &label->elements);
    }
    container->clock = read_texts(reader, &container->clocks);
}

static void read_all(Reader *reader) {
    Container *const container = reader->container;
    const char *const name = read_text(reader), *const token = read_text(reader);
    if (!reader->damaged) container->name = name, container->token = token;
    container->longest = read_real(reader);
    container->saves_states = read_number(reader);
    container->serializes = read_number(reader);
    container->symbol = read_texts(reader, &container->symbols);
    const size_t inners = read_count(reader, 10);
    container->inner = (Inner *)read_room(reader, inners, sizeof *container->inner);
    container->inners = container->inner ? inners : 0;
    for (size_t i = 0; i < container->inners && !reader->damaged; i++) read_inner(reader, &container->inner[i]);
    for (size_t i = 0; i < container->inners && !reader->damaged; i++)
        if (!load_inner(container, &container->inner[i])) reader->damaged = 2; /* which is said */
    if (!reader->damaged) read_arrays(reader);
    if (!reader->damaged) read_cuts(reader);
    if (!reader->damaged) read_labels(reader);
    if (!reader->damaged) read_outside(reader);
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
