/* Reading words, and what is made of them. What is not whole is marked as damaged, and read as nothing. */

#include "reader.h"

#include "numbers.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

uint64_t word_at(const unsigned char *at) {
    uint64_t word = 0;
    for (int i = 7; i >= 0; i--) word = word << 8 | at[i];
    return word;
}

uint64_t read_word(Reader *reader) {
    if (reader->end - reader->at < 8) {
        reader->damaged = 1;
        return 0;
    }
    reader->at += 8;
    return word_at(reader->at - 8);
}

double read_real(Reader *reader) {
    const uint64_t bits = read_word(reader);
    double value;
    memcpy(&value, &bits, sizeof value);
    return value;
}

int read_number(Reader *reader) { return (int)(int64_t)read_word(reader); }

/* How many items follow, each of so many words at least. */
size_t read_count(Reader *reader, size_t words) {
    const uint64_t found = read_word(reader), most = (uint64_t)(reader->end - reader->at) / (8 * (words ? words : 1));
    if (found <= most) return (size_t)found;
    reader->damaged = 1;
    return 0;
}

const char *read_text(Reader *reader) {
    const uint64_t length = read_word(reader), left = (uint64_t)(reader->end - reader->at);
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

void *read_room(Reader *reader, size_t items, size_t size) {
    void *const found = take(reader->container, items, size);
    if (!found) reader->damaged = 1;
    return found;
}

const char **read_texts(Reader *reader, size_t *items) {
    *items = read_count(reader, 2);
    const char **const found = (const char **)read_room(reader, *items, sizeof *found);
    for (size_t i = 0; found && i < *items; i++) found[i] = read_text(reader);
    return found;
}

const char *read_symbol(Reader *reader) {
    const uint64_t which = read_word(reader);
    if (which < reader->container->symbols) return reader->container->symbol[which];
    reader->damaged = 1;
    return "";
}

/* Values of one type, one after the other, each from a word. */
void *read_values(Reader *reader, int type, size_t items) {
    unsigned char *const found = (unsigned char *)read_room(reader, items, 8);
    for (size_t i = 0; found && i < items; i++) {
        const uint64_t bits = read_word(reader);
        double value;
        memcpy(&value, &bits, sizeof value);
        const float single = fabs(value) <= FLT_MAX || !isfinite(value) ? (float)value : 0.0f;
        unsigned char *const at = found + i * value_size(type);
        if (type == TYPE_F4)
            memcpy(at, &single, 4);
        else if (value_size(type) == 8)
            memcpy(at, &bits, 8);
        else
            for (size_t k = 0; k < value_size(type); k++) { /* in the processor's own order */
                const uint32_t part = (uint32_t)bits;
                const uint16_t half = (uint16_t)bits;
                const uint8_t byte = (uint8_t)bits;
                memcpy(at, value_size(type) == 4 ? (const void *)&part : value_size(type) == 2 ? (const void *)&half : (const void *)&byte,
                       value_size(type));
            }
    }
    return found;
}

/* FNV-1a, word by word, and the high bits mixed with the low ones: changes of two words' highest bits would cancel each other. */
uint64_t checksum(const unsigned char *at, size_t words) {
    uint64_t sum = 0xcbf29ce484222325ull;
    for (size_t i = 0; i < words; i++) {
        sum = (sum ^ word_at(at + 8 * i)) * 0x100000001b3u;
        sum ^= sum >> 32;
    }
    return sum;
}

unsigned char *content_of(const char *path, size_t *size) {
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
