/* Payloads of parameter blocks, see block_words.h. */
#include "block_words.h"

#include <string.h>

#include "msgpack.h"
#include "word_envelope.h"

#define SEGMENT 11
#define STATUS 12
#define INFO 0
#define WARNING 1
#define ERROR 2
#define FIELDS 8u
#define LARGEST_VERSION INT64_C(4294967295)
#define MOST_SEGMENTS 32
#define HASH_DIGITS (2u * SHA256_SIZE)

static void key_of_text(struct pack_writer *to, const char *key, const char *text)
{
    pack_text(to, key);
    pack_text(to, text);
}

static void key_of_digest(struct pack_writer *to, const char *key, const uint8_t digest[SHA256_SIZE])
{
    pack_text(to, key);
    pack_binary(to, digest, SHA256_SIZE);
}

/* Bytes that are as many as they are to be. */
static bool read_digest(struct pack_reader *from, const uint8_t **digest)
{
    uint32_t length;
    return read_binary(from, digest, &length) && length == SHA256_SIZE;
}

/* The value of a key; false where it is another one. A key of no field is passed over, as is the addressee. */
static bool read_field(struct pack_reader *from, uint8_t key, struct word_segment *segment)
{
    switch (key) {
    case 's':
        return read_integer(from, &segment->upload);
    case 'v':
        return read_integer(from, &segment->version);
    case 'n':
        return read_integer(from, &segment->count);
    case 'i':
        return read_integer(from, &segment->index);
    case 'd':
        return read_digest(from, &segment->digest);
    case 'b':
        return read_binary(from, &segment->data, &segment->length);
    case 'g':
        return read_digest(from, &segment->tag);
    default:
        return read_past(from);
    }
}

static bool is_within(const struct word_segment *segment)
{
    return segment->digest != NULL && segment->data != NULL && segment->tag != NULL && segment->upload >= 0 &&
           segment->version >= 1 && segment->version <= LARGEST_VERSION && segment->count >= 1 &&
           segment->count <= MOST_SEGMENTS && segment->index >= 0 && segment->index < MOST_SEGMENTS &&
           segment->length >= 1u && segment->length <= BLOCK_PART;
}

bool word_segment(const uint8_t *payload, uint32_t length, struct word_segment *segment)
{
    struct pack_reader from;
    int64_t kind = 0, target = 0;
    uint32_t fields, k, key_length;
    const uint8_t *key;
    memset(segment, 0, sizeof *segment);
    segment->upload = segment->index = -1;
    if (!word_body(payload, length, &kind, &target, &from) || kind != SEGMENT || !read_map(&from, &fields)) {
        return false;
    }
    for (k = 0u; k < fields; k++) {
        uint8_t name = 0u;
        if (!read_text(&from, &key, &key_length)) {
            return false;
        }
        if (key_length == 1u) {
            name = key[0];
        }
        if (!read_field(&from, name, segment)) {
            return false;
        }
    }
    return is_within(segment);
}

uint32_t word_status(
    uint8_t tube,
    const struct block_answer *answer,
    uint32_t received,
    const struct block_kept *kept,
    uint8_t *room,
    uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    word_envelope(&to, WORDS_PLAIN, STATUS, tube, answer->upload);
    pack_map(&to, FIELDS);
    word_integer(&to, "t", tube);
    word_integer(&to, "s", answer->upload);
    key_of_digest(&to, "d", answer->digest);
    word_integer(&to, "p", answer->phase);
    word_integer(&to, "r", received);
    word_integer(&to, "v", kept->version);
    key_of_digest(&to, "u", kept->in_use);
    key_of_text(&to, "x", answer->detail);
    return packed_length(&to);
}

uint32_t word_applied(
    const struct word_origin *origin,
    const struct block_kept *kept,
    uint32_t before,
    uint8_t *room,
    uint32_t size)
{
    static const char digits[] = "0123456789abcdef";
    struct pack_writer to = {room, size, 0u};
    char hash[HASH_DIGITS + 1u];
    uint32_t k;
    for (k = 0u; k < HASH_DIGITS; k++) {
        hash[k] = digits[(uint32_t)kept->in_use[k / 2u] >> (k % 2u == 0u ? 4u : 0u) & 15u];
    }
    hash[HASH_DIGITS] = '\0';
    word_begin_event(&to, origin, INFO, "parameters_applied");
    pack_map(&to, 3u);
    word_integer(&to, "version", kept->version);
    word_integer(&to, "before", before);
    key_of_text(&to, "hash", hash);
    word_end(&to, origin);
    return packed_length(&to);
}

/* An event with a block's version, why, and a number that has a name. */
static uint32_t word_why(
    const struct word_origin *origin,
    int severity,
    const char *code,
    int64_t version,
    const char *reason,
    const char *name,
    uint32_t number,
    uint8_t *room,
    uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    word_begin_event(&to, origin, severity, code);
    pack_map(&to, 3u);
    word_integer(&to, "version", version);
    key_of_text(&to, "reason", reason);
    word_integer(&to, name, number);
    word_end(&to, origin);
    return packed_length(&to);
}

uint32_t word_refused(
    const struct word_origin *origin,
    int64_t version,
    const char *reason,
    uint32_t in_use,
    uint8_t *room,
    uint32_t size)
{
    return word_why(origin, ERROR, "parameters_refused", version, reason, "in_use", in_use, room, size);
}

uint32_t word_untrusted(
    const struct word_origin *origin,
    int64_t version,
    const char *reason,
    uint32_t segments,
    uint8_t *room,
    uint32_t size)
{
    return word_why(origin, WARNING, "upload_untrusted", version, reason, "segments", segments, room, size);
}
