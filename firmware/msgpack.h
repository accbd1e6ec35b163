/* The part of msgpack that payloads are made of, written and read without a heap and without a float.
 *
 * A writer that ran out of room says so at its end; a reader that found something else answers false and stands where
 * it is. Numbers are written in their shortest form, as Python's codec has them: a receipt names the very bytes.
 */
#ifndef BORECHAIN_MSGPACK_H
#define BORECHAIN_MSGPACK_H

#include <stdbool.h>
#include <stdint.h>

struct pack_writer {
    uint8_t *room;
    uint32_t size;
    uint32_t length; /* more than `size` where there was no room */
};

struct pack_reader {
    const uint8_t *at;
    uint32_t left;
};

void pack_map(struct pack_writer *to, uint32_t count);   /* up to 15 */
void pack_long_map(struct pack_writer *to, uint32_t count); /* of more */
void pack_array(struct pack_writer *to, uint32_t count); /* likewise */
void pack_integer(struct pack_writer *to, int64_t value);
void pack_text(struct pack_writer *to, const char *text); /* up to 255 bytes */
void pack_binary(struct pack_writer *to, const uint8_t *bytes, uint32_t length); /* likewise */
void pack_bool(struct pack_writer *to, bool value);
/* A float64 of `value` in Qq: the nearest, ties to even. */
void pack_float(struct pack_writer *to, int64_t value, int32_t q);
/* Bits of the float64 that is nearest to a number in Qq, ties to even. */
uint64_t bits_of_quantity(int64_t value, int32_t q);
/* The bits of a float64 as they are. */
void pack_bits(struct pack_writer *to, uint64_t bits);
/* The bytes, or 0 where there was no room. */
uint32_t packed_length(const struct pack_writer *to);

bool read_map(struct pack_reader *from, uint32_t *count);
bool read_integer(struct pack_reader *from, int64_t *value);
bool read_text(struct pack_reader *from, const uint8_t **text, uint32_t *length);
bool read_binary(struct pack_reader *from, const uint8_t **bytes, uint32_t *length);
/* The bits of a finite float64 in Qq, to the nearest, held at the ends of 62 bits. */
int64_t quantity_of_bits(uint64_t bits, int32_t q);
/* A float64 or a whole number in Qq, held at the ends of 62 bits. */
bool read_quantity(struct pack_reader *from, int32_t q, int64_t *value);
/* The bits of a finite float64, as which a whole number is read too. */
bool read_bits(struct pack_reader *from, uint64_t *bits);
/* Passes over one value, whatever it is. */
bool read_past(struct pack_reader *from);
/* Whether a text is this one. */
bool text_is(const uint8_t *text, uint32_t length, const char *wanted);

#endif
