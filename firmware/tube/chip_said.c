/* What a chip says by words, see chip_said.h. */
#include "chip_said.h"

#include <string.h>

#include "chip_node.h"
#include "chip_relays.h"
#include "chip_seals.h"
#include "chip_signals.h"
#include "msgpack.h"
#include "node_signals.h"

#define ANGLE_Q 40
#define VAR_Q 56
#define RATE_Q 46
#define TORQUE_Q 20
#define TURN INT64_C(6908435304715) /* 2 pi in Q40, the next above */
#define LARGEST_VAR (INT64_C(100) << VAR_Q)
#define LARGEST_RATE (INT64_C(100) << RATE_Q)
#define LARGEST_TORQUE (INT64_C(1000000) << TORQUE_Q)
#define REPLY_WITHIN_US 2 /* of what was asked: a float64 comes back */

bool said_by_words(const struct chip_node *node, uint32_t epoch)
{
    return seals_are_used(node) || epoch > SAID_HIGHEST_EPOCH;
}

static bool is_within(int64_t value, int64_t low, int64_t high)
{
    return value >= low && value <= high;
}

/* An aiding as the step takes it; false where a number is out of the schema's range. */
static bool for_step(const struct hop_aiding *heard, int64_t aiding[12])
{
    aiding[0] = quantity_of_bits(heard->told.yaw, ANGLE_Q);
    aiding[1] = quantity_of_bits(heard->told.yaw_var, VAR_Q);
    aiding[2] = heard->systematic_var;
    aiding[3] = heard->offset;
    aiding[4] = quantity_of_bits(heard->told.rate, RATE_Q);
    aiding[6] = (int64_t)heard->told.sequence;
    aiding[7] = heard->hops;
    aiding[8] = quantity_of_bits(heard->told.torque, TORQUE_Q);
    aiding[9] = heard->torsion_var;
    aiding[10] = heard->told.is_under_torque ? 1 : 0;
    return is_within(aiding[0], 0, TURN) && is_within(aiding[1], 0, LARGEST_VAR) &&
           is_within(aiding[2], 0, LARGEST_VAR) && is_within(aiding[3], -TURN, TURN) &&
           is_within(aiding[4], -LARGEST_RATE, LARGEST_RATE) && is_within(aiding[8], 0, LARGEST_TORQUE) &&
           is_within(aiding[9], 0, LARGEST_VAR);
}

static void hear_aiding(struct chip_node *node, const uint8_t *payload, uint32_t length)
{
    struct hop_aiding heard;
    int64_t aiding[12], valid_us;
    if (!read_aiding(payload, length, &heard) || !for_step(&heard, aiding) || node->clock.exchanges == 0u) {
        return;
    }
    valid_us = us_of_bits(heard.told.valid_at);
    if (!seals_admit(node, &heard.told, valid_us) ||
        !signals_take_aiding(node, aiding, valid_us, heard.told.epoch)) {
        return;
    }
    node->said.aiding = heard;
    node->said.aiding.offset = node->record.down_offset;
    node->said.aiding.systematic_var = node->record.down_systematic;
    node->said.aiding.torsion_var = node->record.down_torsion;
    node->said.aiding.hops = heard.hops + 1;
    node->said.is_aiding_due = true;
}

static void hear_reply(struct chip_node *node, const uint8_t *payload, uint32_t length)
{
    struct clock_reply reply;
    const int64_t asked_us = node->said.asked_us;
    if (asked_us != 0 && read_time_reply(payload, length, &reply) &&
        is_within(reply.asked_us, asked_us - REPLY_WITHIN_US, asked_us + REPLY_WITHIN_US)) {
        node->said.asked_us = 0;
        clock_exchange(&node->clock, &reply, node->now_us);
    }
}

void said_asked(struct chip_node *node, uint64_t asked_at)
{
    node->said.asked_at = asked_at;
    node->said.received_us = node->now_us;
    node->said.is_reply_due = true;
}

void said_hear(struct chip_node *node, uint32_t side, int64_t kind, const uint8_t *payload, uint32_t length)
{
    struct hop_hello hello;
    uint64_t asked_at;
    if (kind == HOP_HELLO && read_hello(payload, length, &hello)) {
        signals_meet(node, (enum node_side)side, (uint8_t)hello.tube, hello.hops);
    } else if (kind == HOP_AIDING && side == NODE_UPPER) {
        hear_aiding(node, payload, length);
    } else if (kind == HOP_TIME_REPLY && side == NODE_UPPER) {
        hear_reply(node, payload, length);
    } else if (kind == HOP_TIME_REQUEST && side == NODE_LOWER && node->clock.exchanges > 0u &&
               read_time_request(payload, length, &asked_at)) {
        said_asked(node, asked_at);
    }
}

static uint32_t reply_words(struct chip_node *node, uint8_t *room, uint32_t size)
{
    struct hop_reply reply;
    reply.asked_at = node->said.asked_at;
    reply.received_us = node->said.received_us;
    reply.replied_us = node->now_us;
    reply.rig_us = clock_rig_from_local(&node->clock, node->now_us);
    reply.rig_rate = clock_rig_rate(&node->clock);
    reply.rig_var = node_var_q56(node_clock_var(node));
    reply.epoch = node->clock.told.epoch;
    return word_time_reply(&reply, room, size);
}

static uint32_t hello_words(const struct chip_node *node, uint8_t *room, uint32_t size)
{
    struct hop_hello hello;
    hello.tube = node->identity.tube;
    hello.boots = node->kept.boots;
    hello.hops = node->kept.hops;
    hello.mode = node->record.filter.mode;
    return word_hello(&hello, room, size);
}

static uint32_t request_words(struct chip_node *node, uint8_t *room, uint32_t size)
{
    node->said.asked_us = node->now_us;
    return word_time_request(node->now_us, room, size);
}

static uint32_t state_words(const struct chip_node *node, uint8_t *room, uint32_t size)
{
    struct borechain_native_node_state state;
    state_of_node(node, node->cycle_us, &state);
    return word_state(&state, node->clock.told.epoch, room, size);
}

static bool take(bool *is_due)
{
    const bool was_due = *is_due;
    *is_due = false;
    return was_due;
}

uint32_t said_next(struct chip_node *node, uint32_t side, uint8_t *room, uint32_t size)
{
    struct chip_said *const said = &node->said;
    if (side == NODE_LOWER && take(&said->is_reply_due)) {
        return reply_words(node, room, size);
    }
    if (side == NODE_LOWER && take(&said->is_aiding_due)) {
        return word_aiding(&said->aiding, room, size);
    }
    if (side == NODE_UPPER && take(&said->is_request_due)) {
        return request_words(node, room, size);
    }
    if (take(&said->is_hello_due[side])) {
        return hello_words(node, room, size);
    }
    if (side == NODE_UPPER && take(&said->is_state_due)) {
        return state_words(node, room, size);
    }
    return side == NODE_UPPER ? relay_take_state(node, room, size) : 0u;
}
