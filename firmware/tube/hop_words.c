/* What neighbours say to each other as payloads, see hop_words.h. Keys are those of the schema, in its order. */
#include "hop_words.h"

#include <stddef.h>
#include <string.h>

#include "levels.h"
#include "msgpack.h"
#include "word_envelope.h"

#define NOBODY 255u
#define DATED 4 /* version of the schema in which an epoch is said, and the one in which an aiding has a seal */
#define SEALED 5
#define TIME_Q 28
#define VAR_Q 56
#define ANGLE_Q 40
#define RATE_Q 32
#define TURN_Q 60
#define COUNT_OF_TURN INT64_C(431777206545) /* 2 pi / 2^24 in Q60 */
#define INFINITE UINT64_C(0x7FF0000000000000)
#define ONE 1000000000

static void float_of(struct pack_writer *to, const char *key, int64_t value, int32_t q)
{
    pack_text(to, key);
    pack_float(to, value, q);
}

static void bits_of(struct pack_writer *to, const char *key, uint64_t bits)
{
    pack_text(to, key);
    pack_bits(to, bits);
}

static void time_of(struct pack_writer *to, const char *key, int64_t us)
{
    const int64_t whole = us / 1000000, part = us % 1000000;
    float_of(to, key, whole * (INT64_C(1) << TIME_Q) + part * (INT64_C(1) << TIME_Q) / 1000000, TIME_Q);
}

uint32_t word_hello(const struct hop_hello *hello, uint8_t *room, uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    word_envelope(&to, WORDS_PLAIN, HOP_HELLO, (uint8_t)hello->tube, 0);
    pack_map(&to, 5u);
    word_integer(&to, "t", hello->tube);
    word_integer(&to, "b", hello->boots);
    word_integer(&to, "h", hello->hops);
    word_integer(&to, "m", hello->mode);
    float_of(&to, "q", 1, 0);
    return packed_length(&to);
}

uint32_t word_time_request(int64_t asked_us, uint8_t *room, uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    word_envelope(&to, WORDS_PLAIN, HOP_TIME_REQUEST, NOBODY, 0);
    pack_map(&to, 1u);
    time_of(&to, "a", asked_us);
    return packed_length(&to);
}

uint32_t word_time_reply(const struct hop_reply *reply, uint8_t *room, uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    word_envelope(&to, DATED, HOP_TIME_REPLY, NOBODY, 0);
    pack_map(&to, 7u);
    bits_of(&to, "a", reply->asked_at);
    time_of(&to, "r", reply->received_us);
    time_of(&to, "p", reply->replied_us);
    time_of(&to, "g", reply->rig_us);
    float_of(&to, "k", (reply->rig_rate << RATE_Q) / ONE, RATE_Q);
    float_of(&to, "v", reply->rig_var, VAR_Q);
    word_integer(&to, "ep", reply->epoch);
    return packed_length(&to);
}

uint32_t word_aiding(const struct hop_aiding *aiding, uint8_t *room, uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    const struct measured *const told = &aiding->told;
    const bool is_sealed = told->seal_length > 0u;
    word_envelope(&to, is_sealed ? SEALED : DATED, HOP_AIDING, NOBODY, (int64_t)told->sequence);
    pack_map(&to, is_sealed ? 13u : 12u);
    bits_of(&to, "y", told->yaw);
    bits_of(&to, "yv", told->yaw_var);
    float_of(&to, "sv", aiding->systematic_var, VAR_Q);
    float_of(&to, "o", aiding->offset, ANGLE_Q);
    bits_of(&to, "r", told->rate);
    bits_of(&to, "at", told->valid_at);
    word_integer(&to, "s", (int64_t)told->sequence);
    word_integer(&to, "h", aiding->hops);
    bits_of(&to, "q", told->torque);
    float_of(&to, "tv", aiding->torsion_var, VAR_Q);
    pack_text(&to, "u");
    pack_bool(&to, told->is_under_torque);
    word_integer(&to, "ep", told->epoch);
    if (is_sealed) {
        pack_text(&to, "m");
        pack_binary(&to, told->seal, told->seal_length);
    }
    return packed_length(&to);
}

/* Steps of 1e-6 or 1e-7 as a float64 to within a part in 2^40 of a step's unit. */
static void steps_of(struct pack_writer *to, int64_t steps, int64_t in_one)
{
    pack_float(to, steps * (INT64_C(1) << 38) / in_one, 38);
}

static void angle_of(struct pack_writer *to, const char *key, int64_t counts)
{
    pack_text(to, key);
    pack_float(to, counts * COUNT_OF_TURN, TURN_Q);
}

static void level_of(struct pack_writer *to, const char *key, uint32_t level, int32_t first)
{
    float_of(to, key, variance_of_level(level, first), VAR_Q);
}

static void hash_of(struct pack_writer *to, const struct borechain_native_node_state *state)
{
    uint8_t hash[8];
    uint32_t k;
    for (k = 0u; k < 4u; k++) {
        hash[k] = (uint8_t)(state->parameters_hash_1 >> (24u - 8u * k) & 0xFFu);
        hash[4u + k] = (uint8_t)(state->parameters_hash_2 >> (24u - 8u * k) & 0xFFu);
    }
    pack_text(to, "ph");
    pack_binary(to, hash, sizeof hash);
}

uint32_t word_state(const struct borechain_native_node_state *state, uint32_t epoch, uint8_t *room, uint32_t size)
{
    struct pack_writer to = {room, size, 0u};
    word_envelope(&to, DATED, HOP_STATE, state->tube, 0);
    pack_long_map(&to, 23u);
    word_integer(&to, "t", state->tube);
    time_of(&to, "at", state->at * 10);
    word_integer(&to, "h", state->hops);
    word_integer(&to, "m", state->mode);
    angle_of(&to, "y", state->yaw);
    level_of(&to, "yv", state->yaw_var, LEVELS_OF_ANGLES);
    level_of(&to, "sv", state->systematic_var, LEVELS_OF_ANGLES);
    pack_text(&to, "g");
    pack_array(&to, 3u);
    steps_of(&to, state->gyro_bias_x, 10000000);
    steps_of(&to, state->gyro_bias_y, 10000000);
    steps_of(&to, state->gyro_bias_z, 10000000);
    pack_text(&to, "k");
    steps_of(&to, state->scale_factor, 1000000);
    angle_of(&to, "i", state->innovation);
    level_of(&to, "iv", state->innovation_var, LEVELS_OF_ANGLES);
    if (state->aiding_age == BORECHAIN_NATIVE_NODE_STATE_INFINITE_AIDING_AGE) {
        bits_of(&to, "aa", INFINITE);
    } else {
        pack_text(&to, "aa");
        steps_of(&to, state->aiding_age, 100);
    }
    level_of(&to, "cv", state->clock_var, LEVELS_OF_TIMES);
    word_integer(&to, "f", state->flags);
    word_integer(&to, "c", state->cycles);
    word_integer(&to, "ov", state->overruns);
    word_integer(&to, "pv", state->parameters_version);
    hash_of(&to, state);
    pack_text(&to, "al");
    pack_array(&to, 3u);
    steps_of(&to, state->alignment_x, 1000000);
    steps_of(&to, state->alignment_y, 1000000);
    steps_of(&to, state->alignment_z, 1000000);
    word_integer(&to, "ep", epoch);
    word_integer(&to, "nn", state->numbered);
    bits_of(&to, "um", INFINITE);
    bits_of(&to, "lm", INFINITE);
    return packed_length(&to);
}
