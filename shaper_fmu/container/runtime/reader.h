/* The words of a file: eight bytes each, the lowest first, whatever the platform. */

#ifndef READER_H
#define READER_H

#include "container.h"

typedef struct {
    const unsigned char *at;
    const unsigned char *end;
    Container *container;
    int damaged;
} Reader;

uint64_t word_at(const unsigned char *at);
uint64_t read_word(Reader *);
double read_real(Reader *);
int read_number(Reader *);

/* How many items follow, each of so many words at least. */
size_t read_count(Reader *, size_t words);
const char *read_text(Reader *);
const char **read_texts(Reader *, size_t *items);

/* The name of a function. */
const char *read_symbol(Reader *);

/* Memory for what is read, all zero. */
void *read_room(Reader *, size_t items, size_t size);

/* Values of one type, one after the other. */
void *read_values(Reader *, int type, size_t items);

uint64_t checksum(const unsigned char *at, size_t words);
unsigned char *content_of(const char *path, size_t *size);

/* The outer variables, and what calls move for them; see outer.c. */
void read_outside(Reader *);

#endif
