/* What neighbours say to each other, read from payloads, see hop_words.h. */
#include "hop_words.h"

#include <stddef.h>
#include <string.h>

#include "levels.h"
#include "msgpack.h"
#include "word_envelope.h"

#define TIME_Q 28
#define VAR_Q 56
#define ANGLE_Q 40
#define RATE_Q 32
#define INFINITE UINT64_C(0x7FF0000000000000)
#define ONE 1000000000
#define MOST_HOPS 251
#define MOST_EPOCH INT64_C(0xFFFFFFFF)

int64_t us_of_bits(uint64_t bits)
{
    const int64_t seconds = quantity_of_bits(bits, TIME_Q);
    const int64_t whole = seconds >> TIME_Q, part = seconds - whole * (INT64_C(1) << TIME_Q);
    return whole * 1000000 + ((part * 1000000 + (INT64_C(1) << (TIME_Q - 1))) >> TIME_Q);
}

/* One field of a body, by its key; false where its value is none of its kind. */
typedef bool (*read_field)(void *into, const uint8_t *key, uint32_t key_length, struct pack_reader *from);

/* Fields of a payload of a kind, each once given to its reader. */
static bool read_fields(const uint8_t *payload, uint32_t length, int64_t kind, read_field read, void *into)
{
    struct pack_reader from;
    int64_t found = 0, target = 0;
    uint32_t fields, key_length;
    const uint8_t *key;
    if (!word_body(payload, length, &found, &target, &from) || found != kind || !read_map(&from, &fields)) {
        return false;
    }
    while (fields > 0u) {
        fields--;
        if (!read_text(&from, &key, &key_length) || !read(into, key, key_length, &from)) {
            return false;
        }
    }
    return true;
}

struct reading_hello {
    struct hop_hello *hello;
    uint32_t found;
};

static bool read_of_hello(void *into, const uint8_t *key, uint32_t key_length, struct pack_reader *from)
{
    struct reading_hello *const one = into;
    if (text_is(key, key_length, "t")) {
        one->found |= 1u;
        return read_integer(from, &one->hello->tube) && one->hello->tube >= 0 && one->hello->tube <= MOST_HOPS;
    }
    if (text_is(key, key_length, "h")) {
        one->found |= 2u;
        return read_integer(from, &one->hello->hops) && one->hello->hops >= -1 && one->hello->hops <= MOST_HOPS;
    }
    return read_past(from);
}

bool read_hello(const uint8_t *payload, uint32_t length, struct hop_hello *hello)
{
    struct reading_hello one = {hello, 0u};
    return read_fields(payload, length, HOP_HELLO, read_of_hello, &one) && one.found == 3u;
}

static bool read_of_request(void *into, const uint8_t *key, uint32_t key_length, struct pack_reader *from)
{
    return text_is(key, key_length, "a") ? read_bits(from, into) : read_past(from);
}

bool read_time_request(const uint8_t *payload, uint32_t length, uint64_t *asked_at)
{
    *asked_at = INFINITE;
    return read_fields(payload, length, HOP_TIME_REQUEST, read_of_request, asked_at) && *asked_at != INFINITE;
}

struct reading_reply {
    struct clock_reply *reply;
    uint32_t found;
};

static bool read_us(struct pack_reader *from, int64_t *us)
{
    uint64_t bits;
    if (!read_bits(from, &bits)) {
        return false;
    }
    *us = us_of_bits(bits);
    return true;
}

static bool read_epoch(struct pack_reader *from, uint32_t *epoch)
{
    int64_t value;
    if (!read_integer(from, &value) || value < 0 || value > MOST_EPOCH) {
        return false;
    }
    *epoch = (uint32_t)value;
    return true;
}

static bool read_of_reply(void *into, const uint8_t *key, uint32_t key_length, struct pack_reader *from)
{
    struct reading_reply *const one = into;
    struct clock_reply *const reply = one->reply;
    int64_t value;
    if (text_is(key, key_length, "a")) {
        one->found |= 1u;
        return read_us(from, &reply->asked_us);
    }
    if (text_is(key, key_length, "r")) {
        one->found |= 2u;
        return read_us(from, &reply->received_us);
    }
    if (text_is(key, key_length, "p")) {
        one->found |= 4u;
        return read_us(from, &reply->replied_us);
    }
    if (text_is(key, key_length, "g")) {
        one->found |= 8u;
        return read_us(from, &reply->rig_us);
    }
    if (text_is(key, key_length, "k")) {
        one->found |= 16u;
        if (!read_quantity(from, RATE_Q, &value) || value < INT64_C(1) << (RATE_Q - 1) ||
            value > INT64_C(1) << (RATE_Q + 1)) {
            return false;
        }
        reply->rig_rate = (value * ONE + (INT64_C(1) << (RATE_Q - 1))) >> RATE_Q;
        return true;
    }
    if (text_is(key, key_length, "v")) {
        one->found |= 32u;
        if (!read_quantity(from, VAR_Q, &value) || value < 0) {
            return false;
        }
        reply->rig_var = (value < LEVEL_CEILING ? value : LEVEL_CEILING) / 72058 + 1; /* 1e-12 s^2 in Q56 */
        return true;
    }
    return text_is(key, key_length, "ep") ? read_epoch(from, &reply->epoch) : read_past(from);
}

bool read_time_reply(const uint8_t *payload, uint32_t length, struct clock_reply *reply)
{
    struct reading_reply one = {reply, 0u};
    memset(reply, 0, sizeof *reply);
    return read_fields(payload, length, HOP_TIME_REPLY, read_of_reply, &one) && one.found == 63u;
}

struct reading_aiding {
    struct hop_aiding *aiding;
    uint32_t found;
};

static bool read_seal(struct pack_reader *from, struct measured *told)
{
    const uint8_t *seal;
    uint32_t length;
    if (!read_binary(from, &seal, &length) || length > MEASUREMENT_SEAL) {
        return false;
    }
    memcpy(told->seal, seal, length);
    told->seal_length = (uint8_t)length;
    return true;
}

static bool read_number(struct pack_reader *from, struct measured *told)
{
    int64_t value;
    if (!read_integer(from, &value) || value < 0) {
        return false;
    }
    told->sequence = (uint64_t)value;
    return true;
}

static bool read_flag(struct pack_reader *from, bool *flag)
{
    if (from->left == 0u || (from->at[0] & 0xFEu) != 0xC2u) {
        return false;
    }
    *flag = from->at[0] == 0xC3u;
    return read_past(from);
}

static bool read_of_aiding(void *into, const uint8_t *key, uint32_t key_length, struct pack_reader *from)
{
    struct reading_aiding *const one = into;
    struct hop_aiding *const aiding = one->aiding;
    struct measured *const told = &aiding->told;
    static const char *const keys[] = {"y", "yv", "r", "at", "q", "sv", "tv", "o", "s", "h", "u", "ep", "m"};
    uint32_t which = 0u;
    while (which < 13u && !text_is(key, key_length, keys[which])) {
        which++;
    }
    one->found |= (uint32_t)1u << which;
    switch (which) {
    case 0:
        return read_bits(from, &told->yaw);
    case 1:
        return read_bits(from, &told->yaw_var);
    case 2:
        return read_bits(from, &told->rate);
    case 3:
        return read_bits(from, &told->valid_at);
    case 4:
        return read_bits(from, &told->torque);
    case 5:
        return read_quantity(from, VAR_Q, &aiding->systematic_var) && aiding->systematic_var >= 0;
    case 6:
        return read_quantity(from, VAR_Q, &aiding->torsion_var) && aiding->torsion_var >= 0;
    case 7:
        return read_quantity(from, ANGLE_Q, &aiding->offset);
    case 8:
        return read_number(from, told);
    case 9:
        return read_integer(from, &aiding->hops) && aiding->hops >= -1 && aiding->hops <= MOST_HOPS;
    case 10:
        return read_flag(from, &told->is_under_torque);
    case 11:
        return read_epoch(from, &told->epoch);
    case 12:
        return read_seal(from, told);
    default:
        return read_past(from);
    }
}

bool read_aiding(const uint8_t *payload, uint32_t length, struct hop_aiding *aiding)
{
    struct reading_aiding one = {aiding, 0u};
    const uint32_t needed = 1u | 2u | 4u | 8u | 32u | 128u | 256u | 512u; /* of the first version */
    memset(aiding, 0, sizeof *aiding);
    return read_fields(payload, length, HOP_AIDING, read_of_aiding, &one) && (one.found & needed) == needed;
}
