/* The outer variables in the file, and their ways inside. */

#include "reader.h"

static void read_wholes(Reader *reader) {
    Container *const container = reader->container;
    container->wholes = read_count(reader, 8);
    container->whole = (Whole *)read_room(reader, container->wholes, sizeof *container->whole);
    for (size_t i = 0; i < container->wholes && !reader->damaged; i++) {
        Whole *const whole = &container->whole[i];
        whole->inner = read_number(reader);
        (void)read_word(reader); /* the version, which the instance tells */
        whole->type = read_number(reader);
        whole->reference = (uint32_t)read_word(reader);
        whole->length = (size_t)read_word(reader);
        whole->get_name = read_symbol(reader);
        whole->set_name = read_symbol(reader);
        whole->in_event_mode = read_number(reader);
        whole->known = read_number(reader);
        if (whole->length > 100000000 || whole->inner < 0 || (size_t)whole->inner >= container->inners) reader->damaged = 1;
        if (reader->damaged) return;
        whole->values = whole->known ? read_values(reader, whole->type, whole->length) : read_room(reader, whole->length, 16);
        void *const library = container->inner[whole->inner].library;
        whole->get = find_function(library, whole->get_name);
        whole->set = find_function(library, whole->set_name);
    }
}

static void read_targets(Reader *reader, const Variable *variable, Slot *slot) {
    slot->targets = read_count(reader, 5);
    Target *const target = (Target *)read_room(reader, slot->targets, sizeof *target);
    slot->target = target;
    for (size_t i = 0; i < slot->targets && !reader->damaged; i++) {
        target[i].place = read_number(reader);
        target[i].element = read_number(reader);
        target[i].gain = read_real(reader);
        target[i].offset = read_real(reader);
        target[i].mapped = read_count(reader, 2);
        target[i].mapping = (const double *)read_values(reader, TYPE_F8, 2 * target[i].mapped);
        const size_t places = variable->on_bus ? reader->container->system.bus.count : reader->container->wholes;
        if (target[i].place < 0 || (size_t)target[i].place >= places) reader->damaged = 1;
        if (reader->damaged || variable->on_bus) continue;
        const Whole *const whole = &reader->container->whole[target[i].place];
        if (target[i].element < 0 || (size_t)target[i].element >= whole->length) reader->damaged = 1;
    }
}

static void read_steered(Reader *reader, Slot *slot) {
    slot->steered = read_count(reader, 3);
    Steered *const steer = (Steered *)read_room(reader, slot->steered, sizeof *steer);
    slot->steer = steer;
    for (size_t i = 0; i < slot->steered && !reader->damaged; i++) {
        steer[i].inner = read_number(reader);
        steer[i].reference = (uint32_t)read_word(reader);
        steer[i].gain = read_real(reader);
        if (steer[i].inner < 0 || (size_t)steer[i].inner >= reader->container->inners) reader->damaged = 1;
    }
}

static void read_variables(Reader *reader) {
    Container *const container = reader->container;
    container->variables = read_count(reader, 5);
    container->variable = (Variable *)read_room(reader, container->variables, sizeof *container->variable);
    for (size_t i = 0; i < container->variables && !reader->damaged; i++) {
        Variable *const variable = &container->variable[i];
        variable->name = read_text(reader);
        variable->type = read_number(reader);
        variable->settable = (Settable)read_number(reader);
        variable->on_bus = read_number(reader);
        variable->slots = read_count(reader, 2);
        variable->slot = (Slot *)read_room(reader, variable->slots, sizeof *variable->slot);
        for (size_t k = 0; k < variable->slots && !reader->damaged; k++) {
            variable->slot[k].start = read_real(reader);
            read_targets(reader, variable, &variable->slot[k]);
            if (!variable->slot[k].targets) reader->damaged = 1;
            read_steered(reader, &variable->slot[k]);
        }
    }
}

void read_outside(Reader *reader) {
    read_wholes(reader);
    if (!reader->damaged) read_variables(reader);
}
