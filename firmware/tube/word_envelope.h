/* What every payload of a chip has around its fields. */
#ifndef BORECHAIN_WORD_ENVELOPE_H
#define BORECHAIN_WORD_ENVELOPE_H

#include "chip_words.h"
#include "msgpack.h"

#define WORDS_PLAIN 1 /* version of the schema without an epoch */

void word_envelope(struct pack_writer *to, int version, int kind, uint8_t tube, int64_t number);
/* Everything of an event before its arguments, and what follows them. */
void word_begin_event(struct pack_writer *to, const struct word_origin *origin, int severity, const char *name);
void word_end(struct pack_writer *to, const struct word_origin *origin);
/* Reads the envelope; the body begins where `body` then stands. */
bool word_body(const uint8_t *payload, uint32_t length, int64_t *kind, int64_t *target, struct pack_reader *body);
void word_integer(struct pack_writer *to, const char *key, int64_t value);

#endif
